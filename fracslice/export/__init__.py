"""Files out: one format per module, each `write(mesh, file, metadata)`, found by the ending of the name."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import BinaryIO

from fracslice.errors import ExportError
from fracslice.export import glb, obj, ply, stl, threemf
from fracslice.export.files import check_target, replacing
from fracslice.mesh.model import Mesh

__all__ = ["FORMATS", "application", "check_format", "check_target", "replacing", "write"]

FORMATS: dict[str, Callable[[Mesh, BinaryIO, Mapping[str, str]], None]] = {
    ".stl": stl.write,
    ".3mf": threemf.write,
    ".ply": ply.write,
    ".obj": obj.write,
    ".glb": glb.write,
}


def application() -> str:
    """Name and version of this program, as files carry it."""
    try:
        return f"fracslice {version('fracslice')}"
    except PackageNotFoundError:
        return "fracslice"


def check_format(path: str | Path) -> str:
    """The ending that names the format of `path`; raises ExportError, naming those known, for any other."""
    ending = Path(path).suffix.lower()
    if ending not in FORMATS:
        raise ExportError(f"{path}: unknown kind of file; known are {', '.join(FORMATS)}")
    return ending


def write(mesh: Mesh, path: str | Path, metadata: Mapping[str, str] | None = None) -> Path:
    """Write a mesh in mm to a file of the kind its name ends in, whole or not at all; same mesh, same bytes.

    metadata: names and values that the format has room for, such as Title, Description or scene_hash;
    Application is added. Coordinates are written as float32: pass a mesh through
    `fracslice.mesh.quantisation.quantised` first, and check that. Returns the path. Raises ExportError in
    one line for an empty mesh, an unknown ending, or what the file system refuses.
    """
    format_write = FORMATS[check_format(path)]
    if not len(mesh.triangles):
        raise ExportError(f"{path}: the mesh has no triangles")
    with replacing(path) as file:
        format_write(mesh, file, {"Application": application()} | dict(metadata or {}))
    return Path(path)
