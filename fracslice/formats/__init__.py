"""Formats of meshes: a module reads and writes one, has the name of its extension, and has `FORMAT`.

Modules are loaded when their format is used: a job has one or two.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules
from typing import TYPE_CHECKING, BinaryIO, NamedTuple

from ..errors import ExportError
from ..version import APPLICATION

if TYPE_CHECKING:
    from ..common.arrays import Triangles
    from ..work import Work

__all__ = ["ENDINGS", "SOLIDS", "MeshFormat", "check_format", "mesh_format", "write"]


class MeshFormat(NamedTuple):
    """A format of meshes."""

    read: Callable[[Path], Triangles]  # mm; raises MeshError, without the name of the file, and OSError
    # The mesh, mm; a binary file, open for writing and able to seek; names and values of metadata, with
    # Application among them; threads and cancellation. Equal meshes give equal bytes.
    write: Callable[[Triangles, BinaryIO, Mapping[str, str], Work], None]
    has_unit: bool = False  # True if a file states its unit; otherwise mm are assumed
    has_colours: bool = False  # True if programs read colours of vertices from a file
    most: int = 1 << 26  # most bytes of a file that a scene names
    # reads colours of vertices, too, if `read` does not; vertices with several are as many
    read_coloured: Callable[[Path], Triangles] | None = None


ENDINGS = tuple(f".{module.name.removeprefix('_')}" for module in iter_modules(__path__))
"""Extensions of the formats; the name of a module that begins with a digit has an underscore before."""
SOLIDS = {**dict.fromkeys(ENDINGS, "model"), ".vdb": "volume"}
"""Formulas of files that are solids, by their extensions."""


def mesh_format(ending: str) -> MeshFormat:
    """Format of an extension of `ENDINGS`."""
    name = ending.removeprefix(".")
    module = import_module(f".{'_' * name[0].isdigit()}{name}", __name__)
    form: MeshFormat = module.FORMAT
    return form


def check_format(path: str | Path) -> str:
    """Extension of a mesh file.

    Parameters
    ----------
    path : str or path
        The file to write.

    Returns
    -------
    str
        Extension in lower case, one of `ENDINGS`.

    Raises
    ------
    ExportError
        For an unknown extension; the message lists the known ones.
    """
    ending = Path(path).suffix.lower()
    if ending not in ENDINGS:
        raise ExportError(f"{path}: unknown kind of file; known are {', '.join(ENDINGS)}")
    return ending


def write(
    mesh: Triangles,
    path: str | Path,
    metadata: Mapping[str, str] | None = None,
    work: Work | None = None,
) -> Path:
    """Write a mesh to a file atomically, in the format of its extension. Equal meshes give equal bytes.

    Coordinates are written as float32: quantise the mesh with `fracslice.mesh.cleaning.quantise_mesh` first,
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
    import numpy as np

    from ..common.files import replacing
    from ..work import Work

    form = mesh_format(check_format(path))
    if not len(mesh.triangles):
        raise ExportError(f"{path}: the mesh has no triangles")
    if not 0 <= mesh.triangles.min() <= mesh.triangles.max() < len(mesh.vertices):
        raise ExportError(f"{path}: a triangle of the mesh names a vertex that does not exist")
    if not np.abs(mesh.vertices).max() <= np.finfo(np.float32).max:  # false for NaN, too
        raise ExportError(f"{path}: the mesh has a coordinate that is not a finite number of 32 bits")
    with replacing(path) as file:
        form.write(mesh, file, {"Application": APPLICATION} | dict(metadata or {}), work or Work())
    return Path(path)
