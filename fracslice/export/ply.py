"""Binary PLY: shared vertices in float32, triangles as lists."""

from __future__ import annotations

from collections.abc import Mapping
from typing import BinaryIO

import numpy as np

from fracslice.mesh.model import Mesh

FACE = np.dtype([("count", "u1"), ("indices", "<i4", 3)])


def write(mesh: Mesh, file: BinaryIO, metadata: Mapping[str, str]) -> None:
    """Write a mesh.

    Parameters
    ----------
    mesh : Mesh
        The mesh, mm.
    file : file
        Binary file, open for writing.
    metadata : mapping of str to str
        Names and values, written as comments.
    """
    comments = [f"comment {key}: {' '.join(value.split())}" for key, value in metadata.items()]
    header = [
        "ply",
        "format binary_little_endian 1.0",
        *comments,
        "comment units: mm",
        f"element vertex {len(mesh.vertices)}",
        *(f"property float {axis}" for axis in "xyz"),
        f"element face {len(mesh.triangles)}",
        "property list uchar int vertex_indices",
        "end_header\n",
    ]
    file.write("\n".join(header).encode("ascii", "replace"))
    file.write(mesh.vertices.astype("<f4").tobytes())
    faces = np.empty(len(mesh.triangles), FACE)
    faces["count"] = 3
    faces["indices"] = mesh.triangles
    file.write(faces.tobytes())
