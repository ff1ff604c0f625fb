"""Binary STL: loose triangles in float32, no unit in the format; the header says mm."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from typing import BinaryIO

import numpy as np

from fracslice.errors import ExportError
from fracslice.mesh.model import Mesh

TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
BLOCK = 1 << 18


def write(mesh: Mesh, file: BinaryIO, metadata: Mapping[str, str]) -> None:
    """Write a mesh in mm."""
    write_pieces([mesh], file, metadata)


def write_pieces(meshes: Iterable[Mesh], file: BinaryIO, metadata: Mapping[str, str]) -> None:
    """Write a mesh in mm that comes in pieces, one in memory at a time; `file` must be able to seek."""
    start, count = file.tell(), 0
    header = f"binary STL, units: mm, {metadata['Application']}".encode("ascii", "replace")
    file.write(header[:80].ljust(80) + bytes(4))
    for mesh in meshes:
        _write_triangles(mesh, file)
        count += len(mesh.triangles)
        if count >= 2**32:
            raise ExportError("STL cannot hold more than 4294967295 triangles")
    file.seek(start + 80)
    file.write(np.uint32(count).astype("<u4").tobytes())
    file.seek(0, os.SEEK_END)


def _write_triangles(mesh: Mesh, file: BinaryIO) -> None:
    vertices = mesh.vertices.astype(np.float32)
    for begin in range(0, len(mesh.triangles), BLOCK):
        corners = vertices[mesh.triangles[begin : begin + BLOCK]]
        records = np.zeros(len(corners), TRIANGLE)
        records["corners"] = corners
        records["normal"] = _unit_normals(corners.astype(np.float64))
        file.write(records.tobytes())


def _unit_normals(corners: np.ndarray) -> np.ndarray:
    """Normals of length one, zero for a triangle without area; float64 [m, 3]."""
    u, v = (corners[:, 1] - corners[:, 0]).T, (corners[:, 2] - corners[:, 0]).T
    normals = np.stack(
        [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]], axis=1
    )
    length = np.sqrt(np.einsum("ij,ij->i", normals, normals))
    length[length == 0] = 1
    normals /= length[:, None]
    return normals
