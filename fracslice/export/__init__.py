"""Mesh file formats: one module each with `write`, selected by file name extension."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO

import numpy as np

from ..common.files import check_target, flushing, replacing
from ..errors import ExportError
from ..version import __version__
from ..work import Work

if TYPE_CHECKING:
    from ..mesh.model import Mesh

__all__ = ["FORMATS", "application", "check_format", "check_target", "flushing", "replacing", "write"]

Write = Callable[["Mesh", BinaryIO, Mapping[str, str], Work], None]
"""Writer of a format: the mesh, mm; a binary file, open for writing and able to seek; names and values of
metadata, with Application among them; threads and cancellation."""


def _writer(module: str) -> Write:
    """Writer of a module, which is imported at its first use: a job writes one format."""
    return lambda *arguments: import_module(f".{module}", __name__).write(*arguments)


def _in_order(write: Write) -> Write:
    """Writer of a mesh whose vertices are sorted by their first use: equal triangles give equal bytes,
    however the mesh was made.
    """
    return lambda mesh, *arguments: write(mesh.in_order(), *arguments)


FORMATS: dict[str, Write] = {
    ".stl": _writer("stl"),
    ".3mf": _in_order(_writer("threemf")),
    ".ply": _in_order(_writer("ply")),
    ".obj": _in_order(_writer("obj")),
    ".glb": _in_order(_writer("glb")),
}


def application() -> str:
    """Name and version of this program, for file metadata.

    Returns
    -------
    str
    """
    return f"fracslice {__version__}"


def check_format(path: str | Path) -> str:
    """Extension of a mesh file.

    Parameters
    ----------
    path : str or path
        The file to write.

    Returns
    -------
    str
        Extension in lower case, a key of `FORMATS`.

    Raises
    ------
    ExportError
        For an unknown extension; the message lists the known ones.
    """
    ending = Path(path).suffix.lower()
    if ending not in FORMATS:
        raise ExportError(f"{path}: unknown kind of file; known are {', '.join(FORMATS)}")
    return ending


def write(
    mesh: Mesh,
    path: str | Path,
    metadata: Mapping[str, str] | None = None,
    work: Work | None = None,
) -> Path:
    """Write a mesh to a file atomically, in the format of its extension. Equal meshes give equal bytes.

    Coordinates are written as float32: quantise the mesh with `fracslice.mesh.cleaning.quantised` first,
    and check the quantised mesh.

    Parameters
    ----------
    mesh : Mesh
        The mesh, mm.
    path : str or path
        The file to write.
    metadata : mapping of str to str, optional
        Names and values for the file, such as Title, Description or scene_hash, as far as the format holds
        them; Application is added.
    work : Work, optional
        Threads and cancellation.

    Returns
    -------
    Path

    Raises
    ------
    ExportError
        For an empty or invalid mesh, an unknown extension, or an error of the file system.
    Cancelled
        If the job was cancelled.
    """
    format_write = FORMATS[check_format(path)]
    if not len(mesh.triangles):
        raise ExportError(f"{path}: the mesh has no triangles")
    if not 0 <= mesh.triangles.min() <= mesh.triangles.max() < len(mesh.vertices):
        raise ExportError(f"{path}: a triangle of the mesh names a vertex that does not exist")
    if not np.abs(mesh.vertices).max() <= np.finfo(np.float32).max:  # false for NaN, too
        raise ExportError(f"{path}: the mesh has a coordinate that is not a finite number of 32 bits")
    with replacing(path) as file:
        format_write(mesh, file, {"Application": application()} | dict(metadata or {}), work or Work())
    return Path(path)
