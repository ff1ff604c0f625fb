"""PNG in colour, with 8 or 16 bits per channel; strips of rows are compressed in parallel."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Mapping
from functools import reduce

import numpy as np

from fracslice.work import Work, chunks

STRIP, LEVEL = 32, 6
"""Rows of a PNG that are compressed as one, and the level of compression."""
ZLIB = b"\x78\x9c"
"""Header of a zlib stream (RFC 1950)."""


def levels(shown: np.ndarray, bits: int) -> np.ndarray:
    """Quantise colours to integers, big-endian.

    Parameters
    ----------
    shown : ndarray, float
        Values in [0, 1].
    bits : {8, 16}
        Bits of an integer.

    Returns
    -------
    ndarray of uint8 or uint16
        Integers from 0 to 2^bits - 1.
    """
    scaled = np.round(np.clip(shown, 0, 1) * np.float64(2**bits - 1))
    return np.asarray(scaled, ">u2" if bits == 16 else np.uint8)


def png(shown: np.ndarray, bits: int, text: Mapping[str, str], work: Work | None = None) -> bytes:
    """Encode a PNG file (ISO/IEC 15948) with filtered rows, sRGB and text chunks.

    Parameters
    ----------
    shown : ndarray, float [height, width, 3 or 4]
        sRGB in [0, 1], and unassociated alpha.
    bits : {8, 16}
        Bits per channel.
    text : mapping of str to str
        Keywords and texts of the metadata.
    work : Work, optional
        Threads; one by default.

    Returns
    -------
    bytes
    """
    height, width, channels = shown.shape

    def compressed(rows: slice) -> tuple[bytes, bytes]:
        """Filtered rows, and the same as blocks of a deflate stream that end at a byte."""
        part = shown[max(rows.start - 1, 0) : rows.stop]
        pixels = levels(part, bits).reshape(len(part), -1)
        filtered = _filtered(pixels.view(np.uint8), channels * bits // 8)
        data = filtered[rows.start > 0 :].tobytes()
        packer = zlib.compressobj(LEVEL, zlib.DEFLATED, -zlib.MAX_WBITS)
        return data, packer.compress(data) + packer.flush(
            zlib.Z_FINISH if rows.stop == height else zlib.Z_FULL_FLUSH
        )

    strips = (work or Work(1)).collect(compressed, chunks(height, STRIP))
    checksum = reduce(lambda sum_, strip: zlib.adler32(strip[0], sum_), strips, 1)
    stream = ZLIB + b"".join(blocks for _, blocks in strips) + struct.pack(">I", checksum)
    parts = [
        (b"IHDR", struct.pack(">IIBBBBB", width, height, bits, 6 if channels == 4 else 2, 0, 0, 0)),
        (b"sRGB", b"\0"),
    ]
    parts += [(b"iTXt", f"{k}\0\0\0\0\0{v}".encode()) for k, v in text.items()]
    parts += [(b"IDAT", stream), (b"IEND", b"")]
    return b"\x89PNG\r\n\x1a\n" + b"".join(_chunk(kind, data) for kind, data in parts)


def _filtered(rows: np.ndarray, pixel: int) -> np.ndarray:
    """Filter rows of bytes, each by the PNG filter with the smallest sum of absolute differences."""
    value = rows.astype(np.int16)
    above = np.vstack([np.zeros_like(value[:1]), value[:-1]])
    left = np.pad(value, ((0, 0), (pixel, 0)))[:, : value.shape[1]]
    corner = np.pad(above, ((0, 0), (pixel, 0)))[:, : value.shape[1]]
    guess = left + above - corner
    a, b, c = abs(guess - left), abs(guess - above), abs(guess - corner)
    paeth = np.where((a <= b) & (a <= c), left, np.where(b <= c, above, corner))
    tried = np.stack(
        [value - p for p in (np.zeros_like(value), left, above, (left + above) // 2, paeth)]
    ).astype(np.uint8)
    best = np.abs(tried.view(np.int8).astype(np.int32)).sum(2).argmin(0)
    return np.hstack([best[:, None].astype(np.uint8), tried[best, np.arange(len(rows))]])


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
