"""Image files with text metadata, written atomically: PNG of 8 or 16 bits, OpenEXR and TIFF of floats."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Mapping
from functools import reduce
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from fracslice.errors import ExportError
from fracslice.files import replacing
from fracslice.work import Work, chunks

IMAGES = (".png", ".exr", ".tif", ".tiff")
STRIP, LEVEL = 64, 6
"""Rows of a PNG that are compressed as one, and the level of compression."""
ZLIB = b"\x78\x9c"
"""Header of a zlib stream (RFC 1950)."""


def check_image(path: str | Path) -> str:
    """Extension of an image file.

    Parameters
    ----------
    path : str or path
        The file to write.

    Returns
    -------
    str
        Extension in lower case, one of `IMAGES`.

    Raises
    ------
    ExportError
        For an unknown extension; the message lists the known ones.
    """
    ending = Path(path).suffix.lower()
    if ending not in IMAGES:
        raise ExportError(f"{path}: unknown kind of picture; known are {', '.join(IMAGES)}")
    return ending


def write_image(
    path: str | Path,
    shown: np.ndarray,
    light: np.ndarray,
    bits: int = 8,
    text: Mapping[str, str] | None = None,
    work: Work | None = None,
) -> Path:
    """Write an image to a file, in the format of its extension.

    Parameters
    ----------
    path : str or path
        The file to write.
    shown : ndarray, float32 [height, width, 3]
        sRGB in [0, 1], for PNG.
    light : ndarray, float32 [height, width, 3]
        Linear light, for OpenEXR and TIFF.
    bits : {8, 16}
        Bits per channel of a PNG.
    text : mapping of str to str, optional
        Keywords and texts of the metadata.
    work : Work, optional
        Threads that compress a PNG; one by default.

    Returns
    -------
    Path

    Raises
    ------
    ExportError
        For an unknown extension, another number of bits, or an error of the file system.
    """
    if bits not in (8, 16):
        raise ExportError(f"{path}: {bits} bits: expected 8 or 16")
    metadata, ending = text or {}, check_image(path)
    data = (
        png(shown, bits, metadata, work)
        if ending == ".png"
        else (exr if ending == ".exr" else tiff)(light, metadata)
    )
    with replacing(path) as file:
        file.write(data)
    return Path(path)


def png(shown: np.ndarray, bits: int, text: Mapping[str, str], work: Work | None = None) -> bytes:
    """Encode a PNG file (ISO/IEC 15948) with filtered rows, sRGB and text chunks.

    Parameters
    ----------
    shown : ndarray, float [height, width, 3]
        sRGB in [0, 1].
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
    height, width, _ = shown.shape
    most = 2**bits - 1

    def compressed(rows: slice) -> tuple[bytes, bytes]:
        """Filtered rows, and the same as blocks of a deflate stream that end at a byte."""
        part = shown[max(rows.start - 1, 0) : rows.stop]
        levels = np.round(np.clip(part, 0, 1) * np.float64(most)).astype(">u2" if bits == 16 else np.uint8)
        filtered = _filtered(levels.reshape(len(part), -1).view(np.uint8), 3 * bits // 8)
        data = filtered[rows.start > 0 :].tobytes()
        packer = zlib.compressobj(LEVEL, zlib.DEFLATED, -zlib.MAX_WBITS)
        return data, packer.compress(data) + packer.flush(
            zlib.Z_FINISH if rows.stop == height else zlib.Z_FULL_FLUSH
        )

    strips = (work or Work(1)).collect(compressed, chunks(height, STRIP))
    checksum = reduce(lambda sum_, strip: zlib.adler32(strip[0], sum_), strips, 1)
    stream = ZLIB + b"".join(blocks for _, blocks in strips) + struct.pack(">I", checksum)
    parts = [(b"IHDR", struct.pack(">IIBBBBB", width, height, bits, 2, 0, 0, 0)), (b"sRGB", b"\0")]
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


def exr(light: np.ndarray, text: Mapping[str, str]) -> bytes:
    """Encode an OpenEXR file (Academy Software Foundation): 32-bit floats, losslessly compressed.

    Parameters
    ----------
    light : ndarray, float32 [height, width, 3]
        Linear red, green and blue.
    text : mapping of str to str
        Keywords and texts of the metadata.

    Returns
    -------
    bytes
    """
    import OpenEXR

    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage, **text}
    with TemporaryDirectory() as folder:  # the library only writes to named files
        path = Path(folder) / "picture.exr"
        with OpenEXR.File(header, {"RGB": np.ascontiguousarray(light, np.float32)}) as file:
            file.write(str(path))
        return path.read_bytes()


def tiff(light: np.ndarray, text: Mapping[str, str]) -> bytes:
    """Encode a TIFF file by tifffile: 32-bit floats, uncompressed.

    Parameters
    ----------
    light : ndarray, float32 [height, width, 3]
        Linear red, green and blue.
    text : mapping of str to str
        Keywords and texts of the metadata, in the description.

    Returns
    -------
    bytes
    """
    from tifffile import imwrite

    file, note = BytesIO(), "\n".join(f"{k}: {v}" for k, v in text.items())
    pixels = np.ascontiguousarray(light, np.float32)
    imwrite(file, pixels, photometric="rgb", description=note.encode(), metadata=None, software=False)
    return file.getvalue()
