"""Readers of mesh files: STL, 3MF, PLY, OBJ and GLB, welded like in a slicer, nothing repaired."""

from __future__ import annotations

import re
import struct
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..common.digits import counted
from ..errors import MeshError
from .model import Mesh
from .quantisation import quantised
from .reading_3mf import read_3mf
from .reading_ply import read_ply

ASCII_STL = re.compile(rb"\s*solid[^\n]*\n\s*(facet|endsolid)", re.IGNORECASE)
STL_TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def read_mesh(path: str | Path) -> Mesh:
    """Read a mesh file, in mm.

    STL, PLY and OBJ have no unit: mm are assumed. 3MF and GLB have one. Coordinates are rounded to float32,
    equal positions welded, and every triangle is kept.

    Parameters
    ----------
    path : str or Path
        File; the extension selects the format.

    Returns
    -------
    Mesh
        Quantised mesh, mm.

    Raises
    ------
    MeshError
        For a missing, unknown, truncated or otherwise invalid file.
    """
    path = Path(path)
    reader = READERS.get(path.suffix.lower())
    if reader is None:
        raise MeshError(f"{path}: not a model file that can be read; known are {', '.join(sorted(READERS))}")
    try:
        if path.is_file() and not path.stat().st_size:
            raise MeshError("the file is empty")
        with np.errstate(invalid="ignore"):  # of coordinates that are not finite, which are refused
            mesh = quantised(reader(path))
    except FileNotFoundError:
        raise MeshError(f"{path}: no such file") from None
    except (OSError, MeshError) as error:
        raise MeshError(f"{path}: {getattr(error, 'strerror', None) or error}") from error
    if not len(mesh.triangles):
        raise MeshError(f"{path}: the file has no triangles")
    return mesh


def _read_stl(path: Path) -> Mesh:
    """Binary or ASCII STL."""
    data = path.read_bytes()
    count = struct.unpack_from("<I", data, 80)[0] if len(data) >= 84 else 0
    if len(data) >= 84 and len(data) == 84 + STL_TRIANGLE.itemsize * count:
        corners = np.frombuffer(data, STL_TRIANGLE, offset=84)["corners"].reshape(-1, 3)
    elif ASCII_STL.match(data):
        corners = _ascii_corners(data)
    elif len(data) < 84:
        raise MeshError("not an STL file: shorter than its header")
    else:
        raise MeshError(_wrong_length(count, len(data) - 84))
    return Mesh(corners.astype(np.float64), np.arange(len(corners), dtype=np.int32).reshape(-1, 3))


def _wrong_length(count: int, size: int) -> str:
    """Message for a binary STL whose size does not match its count of triangles."""
    there = size // STL_TRIANGLE.itemsize
    if there >= count:
        extra = size - count * STL_TRIANGLE.itemsize
        return f"not an STL file: {counted(extra, 'byte')} after the {count} triangles that it announces"
    return f"not a whole STL file: {there} of {count} triangles; the file is cut short, or of another kind"


def _ascii_corners(data: bytes) -> NDArray[np.float64]:
    """Corners of an ASCII STL."""
    text = data.lower().rstrip()
    words = re.findall(rb"vertex\s+(\S+)\s+(\S+)\s+(\S+)", text)
    last = text.rpartition(b"\n")[2].lstrip()
    if not last.startswith(b"endsolid") or len(words) != 3 * text.count(b"endfacet"):
        raise MeshError("not a whole STL file: the text has no end; the file is cut short")
    try:
        return np.array(words, dtype=np.bytes_).astype(np.float64).reshape(-1, 3)
    except ValueError:
        raise MeshError("not an STL file: a coordinate is not a number") from None


def _read_by_trimesh(path: Path) -> Mesh:
    """OBJ and GLB, by trimesh. Any exception of its parsers means an invalid file."""
    import trimesh

    with path.open("rb") as file:
        try:
            scene = trimesh.load_scene(
                file, file_type=path.suffix.lower()[1:], process=False, skip_materials=True
            )
            mesh = scene.to_mesh()
            triangles = np.asarray(mesh.faces, dtype=np.int32).reshape(-1, 3)
            model = Mesh(np.asarray(mesh.vertices, dtype=np.float64).reshape(-1, 3), triangles)
        except Exception as error:
            kind = path.suffix[1:].upper()
            raise MeshError(f"not a whole {kind} file: it is cut short, broken or of another kind") from error
    return model


def _read_glb(path: Path) -> Mesh:
    """GLB, converted from metres to mm and from y up to z up."""
    model = _read_by_trimesh(path)
    x, y, z = model.vertices.T * 1000
    return Mesh(np.stack([x, -z, y], axis=1), model.triangles)


READERS = {
    ".stl": _read_stl,
    ".3mf": read_3mf,
    ".ply": read_ply,
    ".obj": _read_by_trimesh,
    ".glb": _read_glb,
}
