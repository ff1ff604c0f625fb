"""Binary STL: unindexed triangles in float32. The format has no unit; the header states mm."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import partial
from typing import BinaryIO

import numpy as np

from fracslice.errors import ExportError
from fracslice.mesh.model import Mesh

BLOCK, TRIANGLE = 1 << 18, 50
"""Triangles of a block, and bytes of a triangle."""


def write(mesh: Mesh, file: BinaryIO, metadata: Mapping[str, str]) -> None:
    """Write a mesh.

    Parameters
    ----------
    mesh : Mesh
        The mesh, mm.
    file : file
        Binary file, open for writing and able to seek.
    metadata : mapping of str to str
        Names and values; the header holds Application.

    Raises
    ------
    ExportError
        For more than 4294967295 triangles.
    """
    write_pieces([mesh], file, metadata)


def write_pieces(meshes: Iterable[Mesh], file: BinaryIO, metadata: Mapping[str, str]) -> None:
    """Write a mesh piece by piece, with one piece in memory at a time.

    Parameters
    ----------
    meshes : iterable of Mesh
        The pieces, mm.
    file : file
        Binary file, open for writing and able to seek.
    metadata : mapping of str to str
        Names and values; the header holds Application.

    Raises
    ------
    ExportError
        For more than 4294967295 triangles.
    """
    write_blocks((block for mesh in meshes for block in _blocks(mesh)), file, metadata)


def write_blocks(blocks: Iterable[bytes | memoryview], file: BinaryIO, metadata: Mapping[str, str]) -> None:
    """Write a mesh from blocks of encoded triangles.

    Parameters
    ----------
    blocks : iterable of bytes-like
        Triangles of 50 bytes.
    file : file
        Binary file, open for writing and able to seek.
    metadata : mapping of str to str
        Names and values; the header holds Application.

    Raises
    ------
    ExportError
        For more than 4294967295 triangles.
    """

    def written(block: bytes | memoryview, file: BinaryIO) -> int:
        file.write(block)
        return memoryview(block).nbytes

    concatenate((partial(written, block) for block in blocks), file, metadata)


def concatenate(
    blocks: Iterable[Callable[[BinaryIO], int]], file: BinaryIO, metadata: Mapping[str, str]
) -> None:
    """Write a mesh from functions that append encoded triangles.

    Parameters
    ----------
    blocks : iterable of callable
        Appends triangles of 50 bytes to the file; returns the number of bytes.
    file : file
        Binary file, open for writing and able to seek.
    metadata : mapping of str to str
        Names and values; the header holds Application.

    Raises
    ------
    ExportError
        For more than 4294967295 triangles.
    """
    start, count = file.tell(), 0
    header = f"binary STL, units: mm, {metadata['Application']}".encode("ascii", "replace")
    file.write(header[:80].ljust(80) + bytes(4))
    for block in blocks:
        count += block(file) // TRIANGLE
        if count >= 2**32:
            raise ExportError("STL cannot hold more than 4294967295 triangles")
    file.seek(start + 80)
    file.write(np.uint32(count).astype("<u4").tobytes())
    file.seek(0, os.SEEK_END)


def _blocks(mesh: Mesh) -> Iterator[memoryview]:
    """Encoded triangles of a mesh."""
    from fracslice._native import stl

    for begin in range(0, len(mesh.triangles), BLOCK):
        yield stl(mesh.vertices, mesh.triangles[begin : begin + BLOCK]).data
