"""Binary PLY by trimesh, with comments: shared vertices in float32, triangles as lists."""

from __future__ import annotations

from collections.abc import Mapping
from typing import BinaryIO

from ..mesh.model import Mesh
from ..work import Work


def write(mesh: Mesh, file: BinaryIO, metadata: Mapping[str, str], _: Work) -> None:
    """Write a mesh, with metadata as comments; see `Write`."""
    from trimesh.exchange.ply import export_ply

    data = export_ply(mesh.to_trimesh(), vertex_normal=False)
    begin = data.index(b"\ncomment") + 1
    comments = [f"comment {key}: {' '.join(value.split())}\n" for key, value in metadata.items()]
    file.write(data[:begin])
    file.write("".join([*comments, "comment units: mm\n"]).encode("ascii", "replace"))
    file.write(memoryview(data)[begin:])
