"""PNG: grey pictures of layers, and colour with 8 or 16 bits per channel, written while rows are made."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterable, Mapping
from typing import BinaryIO

import numpy as np
from isal.isal_zlib import crc32

from .._slices import Encoding, encoded, filtered
from ..slicing import Layer
from ..work import Work, chunks
from .slice_run import SliceRun

SIGNATURE = b"\x89PNG\r\n\x1a\n"


def encode(image: np.ndarray) -> bytes:
    """Encode a grey picture as a PNG file.

    Parameters
    ----------
    image : ndarray, uint8 [rows, columns]
        The picture.
    """
    return _file((image.shape[0], image.shape[1]), encoded(image, Encoding.PNG))


def encode_layer(run: SliceRun, layer: Layer) -> bytes:
    """Encode the picture of a layer as a PNG file."""
    return _file(run.screen.shape, run.screen.encoded(layer, Encoding.PNG))


def _file(shape: tuple[int, int], rows: bytes) -> bytes:
    head = struct.pack(">IIBBBBB", shape[1], shape[0], 8, 0, 0, 0, 0)
    return b"".join((SIGNATURE, *_chunk(b"IHDR", head), *_chunk(b"IDAT", rows), *_chunk(b"IEND", b"")))


def _chunk(kind: bytes, data: bytes) -> tuple[bytes, bytes, bytes, bytes]:
    return struct.pack(">I", len(data)), kind, data, struct.pack(">I", crc32(data, crc32(kind)))


STRIP, LEVEL = 32, 6
"""Rows that are stored as one, and the level of compression of a picture."""
ZLIB = b"\x78\x9c"
"""Header of a zlib stream (RFC 1950)."""


def levels(shown: np.ndarray, bits: int) -> np.ndarray:
    """Quantise display values.

    `shown`: values in [0, 1].
    """
    if shown.dtype == np.uint8:
        return shown
    quantised = np.round(np.clip(shown, 0, 1) * np.float64(2**bits - 1))
    return np.asarray(quantised, ">u2" if bits == 16 else np.uint8)


def write_png(
    file: BinaryIO,
    shape: tuple[int, ...],
    bands: Iterable[np.ndarray],
    bits: int,
    text: Mapping[str, str],
    work: Work | None = None,
    level: int = LEVEL,
) -> None:
    """Write a PNG file (ISO/IEC 15948) with filtered rows, sRGB and text chunks.

    The bytes do not depend on the bands.

    `bands`: sRGB in [0, 1] or as levels of 8 bits.
    """
    height, width, channels = shape
    header = struct.pack(">IIBBBBB", width, height, bits, 6 if channels == 4 else 2, 0, 0, 0)
    file.write(b"\x89PNG\r\n\x1a\n" + _chunk_bytes(b"IHDR", header) + _chunk_bytes(b"sRGB", b"\0"))
    for keyword, value in text.items():
        file.write(_chunk_bytes(b"iTXt", f"{keyword}\0\0\0\0\0{value}".encode()))
    start, checksum, above = ZLIB, 1, np.zeros((1, width, channels), np.uint8)
    done, how = 0, (bits, level, work or Work(1))
    for band in bands:
        done += len(band)
        for data, blocks in _compress_rows(np.concatenate([above, band]), done == height, *how):
            checksum = zlib.adler32(data, checksum)
            file.write(_chunk_bytes(b"IDAT", start + blocks))
            start = b""
        above = band[-1:]
    file.write(_chunk_bytes(b"IDAT", struct.pack(">I", checksum)) + _chunk_bytes(b"IEND", b""))


def _compress_rows(
    shown: np.ndarray, last: bool, bits: int, level: int, work: Work
) -> list[tuple[bytes, bytes]]:
    """Filtered rows of the strips of a band after its first row, which is that above it; and the same as
    blocks of a deflate stream that end at a byte."""
    height, pixel = len(shown) - 1, shown.shape[2] * bits // 8

    def compressed(rows: slice) -> tuple[bytes, bytes]:
        part = levels(shown[rows.start : rows.stop + 1], bits)
        data = filtered(np.ascontiguousarray(part).reshape(len(part), -1).view(np.uint8), pixel)
        packer = zlib.compressobj(level, zlib.DEFLATED, -zlib.MAX_WBITS)
        end = zlib.Z_FINISH if last and rows.stop == height else zlib.Z_FULL_FLUSH
        return data, packer.compress(data) + packer.flush(end)

    return work.collect(compressed, chunks(height, STRIP))


def _chunk_bytes(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
