"""STL: unindexed triangles in float32; binary, and read as text, too. No unit; a written header states mm."""

from __future__ import annotations

import io
import os
import re
import struct
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from ..common.arrays import Triangles
from ..common.files import read_bytes
from ..common.messages import format_count
from ..errors import ExportError, MeshError
from ..work import Work, ahead
from . import MeshFormat

HEADER, TRIANGLE = 84, 50
"""Bytes before the first triangle, and of a triangle."""

BLOCK = 1 << 16
"""Triangles that are encoded together: so few that their memory is used again, see `keep_freed_memory`."""


def _write(mesh: Triangles, file: BinaryIO, metadata: Mapping[str, str], work: Work) -> None:
    """Write a mesh, with Application in the header; see `MeshFormat`.

    Raises
    ------
    ExportError
        For more than 4294967295 triangles.
    """
    write_pieces([mesh], file, metadata, work)


def write_pieces(
    meshes: Iterable[Triangles], file: BinaryIO, metadata: Mapping[str, str], work: Work
) -> None:
    """Write a mesh, mm, piece by piece, with one piece in memory at a time; see `MeshFormat`."""
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


def _append(mesh: Triangles, file: BinaryIO, work: Work) -> None:
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


def blocks(mesh: Triangles, threads: int = 0) -> Iterator[memoryview]:
    """Encode the triangles of a mesh.

    `mesh` in mm. Yields triangles of 50 bytes.
    """
    for begin in range(0, len(mesh.triangles), BLOCK):
        yield _encode_block(mesh, begin, threads)


def _encode_block(mesh: Triangles, begin: int, threads: int) -> memoryview:
    """Encode the block of triangles from number `begin` on."""
    from .._native import stl

    encoded: memoryview = stl(mesh.vertices, mesh.triangles[begin : begin + BLOCK], threads).data
    return encoded.cast("B")


TEXT = re.compile(rb"\s*solid[^\n]*\n\s*(facet|endsolid)", re.IGNORECASE)
TRIANGLE_ROW = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def _read(path: Path) -> Triangles:
    """Binary or ASCII STL."""
    data = read_bytes(path)
    count = struct.unpack_from("<I", data, 80)[0] if len(data) >= 84 else 0
    if len(data) >= 84 and len(data) == 84 + TRIANGLE_ROW.itemsize * count:
        corners = np.frombuffer(data, TRIANGLE_ROW, offset=84)["corners"].reshape(-1, 3)
    elif TEXT.match(data):
        corners = _ascii_corners(data)
    elif len(data) < 84:
        raise MeshError("not an STL file: shorter than its header")
    else:
        raise MeshError(_wrong_length(count, len(data) - 84))
    return Triangles(corners.astype(np.float64), np.arange(len(corners), dtype=np.int32).reshape(-1, 3))


def _wrong_length(count: int, size: int) -> str:
    """Message for a binary STL whose size does not match its count of triangles."""
    there = size // TRIANGLE_ROW.itemsize
    if there >= count:
        extra = size - count * TRIANGLE_ROW.itemsize
        return f"not an STL file: {format_count(extra, 'byte')} after the {count} triangles that it announces"
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


FORMAT = MeshFormat(_read, _write, most=1 << 27)  # where 50 bytes hold a triangle, there are more of them
