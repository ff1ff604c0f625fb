"""PNG in colour, with 8 or 16 bits per channel, written while the rows of the picture are made."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterable, Mapping
from typing import BinaryIO

import numpy as np

from .._slices import filtered
from ..work import Work, chunks

STRIP, LEVEL = 32, 6
"""Rows that are stored as one, and the level of compression of a picture."""
ZLIB = b"\x78\x9c"
"""Header of a zlib stream (RFC 1950)."""


def levels(shown: np.ndarray, bits: int) -> np.ndarray:
    """Quantise display values.

    Parameters
    ----------
    shown : ndarray of float, or of uint8
        Values in [0, 1]; or levels, which are returned.
    bits : {8, 16}
        Bits of a level.

    Returns
    -------
    ndarray of uint8, or of uint16, big-endian
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

    Parameters
    ----------
    file : BinaryIO
        Writable binary file.
    shape : tuple of int
        Height, width, and 3 or 4 channels of the picture.
    bands : iterable of ndarray, float or uint8 [rows, width, channels]
        sRGB in [0, 1] or as levels of 8 bits, and unassociated alpha, from the top; all but the last have a
        multiple of `STRIP` rows.
    bits : {8, 16}
        Bits per channel.
    text : mapping of str to str
        Keywords and texts of the metadata.
    work : Work, optional
        Threads; one by default.
    level : int
        Level of compression, 1 to 9.
    """
    height, width, channels = shape
    header = struct.pack(">IIBBBBB", width, height, bits, 6 if channels == 4 else 2, 0, 0, 0)
    file.write(b"\x89PNG\r\n\x1a\n" + _chunk(b"IHDR", header) + _chunk(b"sRGB", b"\0"))
    for keyword, value in text.items():
        file.write(_chunk(b"iTXt", f"{keyword}\0\0\0\0\0{value}".encode()))
    start, checksum, above = ZLIB, 1, np.zeros((1, width, channels), np.uint8)
    done, how = 0, (bits, level, work or Work(1))
    for band in bands:
        done += len(band)
        for data, blocks in _compressed(np.concatenate([above, band]), done == height, *how):
            checksum = zlib.adler32(data, checksum)
            file.write(_chunk(b"IDAT", start + blocks))
            start = b""
        above = band[-1:]
    file.write(_chunk(b"IDAT", struct.pack(">I", checksum)) + _chunk(b"IEND", b""))


def _compressed(
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


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
