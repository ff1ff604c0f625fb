"""Pictures: PNG of 8 or 16 bits, OpenEXR and TIFF of floats, text in all. Written whole or not at all."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Mapping
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from fracslice.errors import ExportError
from fracslice.export.files import replacing

IMAGES = (".png", ".exr", ".tif", ".tiff")


def check_image(path: str | Path) -> str:
    """The ending that names the format of `path`; raises ExportError, with those that are known, for any
    other."""
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
) -> Path:
    """Writes a picture to a file of the kind its name ends in.

    shown: float32 [height, width, 3], sRGB in [0, 1], for PNG of `bits` 8 or 16; text: keywords and what they
    say, in the file. light: float32 of the same shape, linear, for OpenEXR and TIFF. Raises ExportError.
    """
    if bits not in (8, 16):
        raise ExportError(f"{path}: {bits} bits: expected 8 or 16")
    metadata, ending = text or {}, check_image(path)
    data = (
        png(shown, bits, metadata)
        if ending == ".png"
        else (exr if ending == ".exr" else tiff)(light, metadata)
    )
    with replacing(path) as file:
        file.write(data)
    return Path(path)


def png(shown: np.ndarray, bits: int, text: Mapping[str, str]) -> bytes:
    """A PNG file (ISO/IEC 15948): filtered rows, sRGB and text chunks."""
    height, width, _ = shown.shape
    most = 2**bits - 1
    levels = np.round(np.clip(shown, 0, 1) * np.float64(most)).astype(">u2" if bits == 16 else np.uint8)
    filtered = _filtered(levels.reshape(height, -1).view(np.uint8), 3 * bits // 8)
    chunks = [(b"IHDR", struct.pack(">IIBBBBB", width, height, bits, 2, 0, 0, 0)), (b"sRGB", b"\0")]
    chunks += [(b"iTXt", f"{k}\0\0\0\0\0{v}".encode()) for k, v in text.items()]
    chunks += [(b"IDAT", zlib.compress(filtered.tobytes(), 9)), (b"IEND", b"")]
    return b"\x89PNG\r\n\x1a\n" + b"".join(_chunk(kind, data) for kind, data in chunks)


def _filtered(rows: np.ndarray, pixel: int) -> np.ndarray:
    """Rows of bytes as differences to what is left of and above them, each row by the filter that leaves
    least."""
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
    """An OpenEXR file (Academy Software Foundation): 32-bit floats of red, green and blue, compressed without
    loss."""
    import OpenEXR

    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage, **text}
    with TemporaryDirectory() as folder:  # the library writes to names only
        path = Path(folder) / "picture.exr"
        with OpenEXR.File(header, {"RGB": np.ascontiguousarray(light, np.float32)}) as file:
            file.write(str(path))
        return path.read_bytes()


def tiff(light: np.ndarray, text: Mapping[str, str]) -> bytes:
    """A TIFF file (Adobe 1992, revision 6.0): one strip of interleaved 32-bit floats, little-endian."""
    height, width, _ = light.shape
    pixels = np.ascontiguousarray(light, "<f4").tobytes()
    note = "\n".join(f"{k}: {v}" for k, v in text.items()).encode() + b"\0"
    heads = 8 + len(pixels)
    depths, formats, metadata = heads, heads + 6, heads + 12
    entries = [
        (256, 4, 1, width),
        (257, 4, 1, height),
        (258, 3, 3, depths),
        (259, 3, 1, 1),
        (262, 3, 1, 2),
        (270, 2, len(note), metadata),
        (273, 4, 1, 8),
        (277, 3, 1, 3),
        (278, 4, 1, height),
        (279, 4, 1, len(pixels)),
        (284, 3, 1, 1),
        (339, 3, 3, formats),
    ]
    start = metadata + len(note) + len(note) % 2
    table = struct.pack("<H", len(entries)) + b"".join(struct.pack("<HHII", *e) for e in entries) + bytes(4)
    tail = struct.pack("<6H", 32, 32, 32, 3, 3, 3) + note + bytes(len(note) % 2) + table
    return struct.pack("<2sHI", b"II", 42, start) + pixels + tail
