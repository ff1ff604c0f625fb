"""Binary STL: unindexed triangles in float32. The format has no unit; the header states mm."""

from __future__ import annotations

import io
import os
from collections.abc import Iterable, Iterator, Mapping
from typing import BinaryIO

from ..errors import ExportError
from ..mesh.model import Mesh
from ..work import Work, ahead

HEADER, TRIANGLE = 84, 50
"""Bytes before the first triangle, and of a triangle."""

BLOCK = 1 << 16
"""Triangles that are encoded together: so few that their memory is used again, see `keep_freed_memory`."""


def write(mesh: Mesh, file: BinaryIO, metadata: Mapping[str, str], work: Work) -> None:
    """Write a mesh, with Application in the header; see `Write`.

    Raises
    ------
    ExportError
        For more than 4294967295 triangles.
    """
    write_pieces([mesh], file, metadata, work)


def write_pieces(meshes: Iterable[Mesh], file: BinaryIO, metadata: Mapping[str, str], work: Work) -> None:
    """Write a mesh, mm, piece by piece, with one piece in memory at a time; see `write`."""
    start, count = file.tell(), 0
    head = header(0, metadata)
    file.write(head)
    for mesh in meshes:
        count += len(mesh.triangles)
        head = header(count, metadata)
        _append(mesh, file, work)
    file.seek(start)
    file.write(head)
    file.seek(0, os.SEEK_END)


def _append(mesh: Mesh, file: BinaryIO, work: Work) -> None:
    """Write triangles; each thread puts the blocks that it encodes in their places, if the system can."""
    if not (isinstance(file, io.BufferedWriter) and hasattr(os, "pwrite")):
        for block in ahead(blocks(mesh, work.threads)):
            file.write(block)
        return
    file.flush()
    start = file.tell()

    def put(begin: int) -> None:
        block, place = _encode_block(mesh, begin, 1), start + TRIANGLE * begin
        while block:
            written = os.pwrite(file.fileno(), block, place)
            block, place = block[written:], place + written

    work.map(put, range(0, len(mesh.triangles), BLOCK))
    file.seek(start + TRIANGLE * len(mesh.triangles))


def header(count: int, metadata: Mapping[str, str]) -> bytes:
    """Begin of a file.

    Returns `HEADER` bytes.
    """
    if count >= 2**32:
        raise ExportError("STL cannot hold more than 4294967295 triangles")
    about = f"binary STL, units: mm, {metadata['Application']}".encode("ascii", "replace")
    return about[:80].ljust(80) + count.to_bytes(4, "little")


def blocks(mesh: Mesh, threads: int = 0) -> Iterator[memoryview]:
    """Encode the triangles of a mesh.

    `mesh` in mm. Yields triangles of 50 bytes.
    """
    for begin in range(0, len(mesh.triangles), BLOCK):
        yield _encode_block(mesh, begin, threads)


def _encode_block(mesh: Mesh, begin: int, threads: int) -> memoryview:
    """Encode the block of triangles from number `begin` on."""
    from .._native import stl

    encoded: memoryview = stl(mesh.vertices, mesh.triangles[begin : begin + BLOCK], threads).data
    return encoded.cast("B")
