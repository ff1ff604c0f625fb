"""Binary STL: loose triangles in float32, no unit in the format; the header says mm."""

from __future__ import annotations

from collections.abc import Mapping
from typing import BinaryIO

import numpy as np

from fracslice.errors import ExportError
from fracslice.mesh.model import Mesh

TRIANGLE = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
BLOCK = 1 << 18


def write(mesh: Mesh, file: BinaryIO, metadata: Mapping[str, str]) -> None:
    """Write a mesh in mm."""
    count = len(mesh.triangles)
    if count >= 2**32:
        raise ExportError(f"STL cannot hold {count} triangles")
    header = f"binary STL, units: mm, {metadata['Application']}".encode("ascii", "replace")
    file.write(header[:80].ljust(80))
    file.write(np.uint32(count).astype("<u4").tobytes())
    vertices = mesh.vertices.astype(np.float32)
    for begin in range(0, count, BLOCK):
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
