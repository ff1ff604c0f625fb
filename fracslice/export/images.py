"""Image files with text metadata, written atomically: PNG, JPEG, WebP, OpenEXR and TIFF of floats."""

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

IMAGES = (".png", ".jpg", ".jpeg", ".webp", ".exr", ".tif", ".tiff")
LINEAR = (".exr", ".tif", ".tiff")
"""Extensions of linear light."""
LOSSY = {".jpg": "JPEG", ".jpeg": "JPEG", ".webp": "WEBP"}
QUALITY = 95
"""Quality of JPEG and WebP."""
LAYERS = {
    "depth": ("Z",),
    "normal": ("Normal.X", "Normal.Y", "Normal.Z"),
    "position": ("Position.X", "Position.Y", "Position.Z"),
    "albedo": ("Albedo.R", "Albedo.G", "Albedo.B"),
    "trap": ("Trap.V",),
    "samples": ("Samples.V",),
}
"""Channels of the layers of an OpenEXR file, by the names that Blender and Nuke know."""
STRIP, LEVEL = 32, 6
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
    layers: Mapping[str, np.ndarray] | None = None,
) -> Path:
    """Write an image to a file, in the format of its extension.

    Parameters
    ----------
    path : str or path
        The file to write.
    shown : ndarray, float32 [height, width, 3 or 4]
        sRGB in [0, 1], and unassociated alpha, for PNG, JPEG (without alpha) and WebP.
    light : ndarray, float32 [height, width, 3 or 4]
        Linear light, and alpha that it is multiplied by, for OpenEXR and TIFF.
    bits : {8, 16}
        Bits per channel of a PNG.
    text : mapping of str to str, optional
        Keywords and texts of the metadata.
    work : Work, optional
        Threads that compress a PNG; one by default.
    layers : mapping of str to ndarray, float32 [height, width] or [height, width, 3], optional
        Further layers of an OpenEXR file; see `LAYERS`.

    Returns
    -------
    Path

    Raises
    ------
    ExportError
        For an unknown extension, another number of bits, layers of another format, or an error of the file
        system.
    """
    if bits not in (8, 16):
        raise ExportError(f"{path}: {bits} bits: expected 8 or 16")
    if layers and check_image(path) != ".exr":
        raise ExportError(f"{path}: expected an .exr file, which holds layers")
    data = encoded_image(check_image(path), shown, light, bits, text, work, layers)
    with replacing(path) as file:
        file.write(data)
    return Path(path)


def encoded_image(
    ending: str,
    shown: np.ndarray,
    light: np.ndarray,
    bits: int = 8,
    text: Mapping[str, str] | None = None,
    work: Work | None = None,
    layers: Mapping[str, np.ndarray] | None = None,
) -> bytes:
    """Encode an image, in the format of an extension.

    Parameters
    ----------
    ending : str
        Extension, one of `IMAGES`.
    shown, light, bits, text, work, layers
        As for `write_image`.

    Returns
    -------
    bytes
    """
    metadata = text or {}
    if ending == ".png":
        return png(shown, bits, metadata, work)
    if ending in LOSSY:
        return lossy(shown, LOSSY[ending], metadata)
    return exr(light, metadata, layers or {}) if ending == ".exr" else tiff(light, metadata)


def lossy(shown: np.ndarray, kind: str, text: Mapping[str, str]) -> bytes:
    """Encode a JPEG or WebP file by Pillow, with sRGB of 8 bits and a description.

    Parameters
    ----------
    shown : ndarray, float [height, width, 3 or 4]
        sRGB in [0, 1], and alpha, which JPEG leaves out.
    kind : {"JPEG", "WEBP"}
        The format.
    text : mapping of str to str
        Keywords and texts of the metadata.

    Returns
    -------
    bytes

    Raises
    ------
    ExportError
        If the format cannot hold the size.
    """
    from PIL import Image

    pixels = shown[..., :3] if kind == "JPEG" else shown
    image, file = Image.fromarray(_levels(pixels, 8)), BytesIO()
    exif = image.getexif()
    exif[0x010E] = "\n".join(f"{k}: {v}" for k, v in text.items())  # ImageDescription
    try:
        image.save(file, kind, quality=QUALITY, subsampling=0, exif=exif)
    except (OSError, ValueError) as error:
        raise ExportError(f"{kind}: {error}") from None
    return file.getvalue()


def _levels(shown: np.ndarray, bits: int) -> np.ndarray:
    """Levels of 8 or 16 bits, big-endian."""
    levels = np.round(np.clip(shown, 0, 1) * np.float64(2**bits - 1))
    return np.asarray(levels, ">u2" if bits == 16 else np.uint8)


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
        levels = _levels(part, bits)
        filtered = _filtered(levels.reshape(len(part), -1).view(np.uint8), channels * bits // 8)
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


def exr(light: np.ndarray, text: Mapping[str, str], layers: Mapping[str, np.ndarray]) -> bytes:
    """Encode an OpenEXR file (Academy Software Foundation): 32-bit floats, losslessly compressed.

    Parameters
    ----------
    light : ndarray, float32 [height, width, 3 or 4]
        Linear red, green and blue, and alpha that they are multiplied by.
    text : mapping of str to str
        Keywords and texts of the metadata.
    layers : mapping of str to ndarray, float32 [height, width] or [height, width, 3]
        Layers of `LAYERS`.

    Returns
    -------
    bytes
    """
    import OpenEXR

    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage, **text}
    channels = {name: light[..., k] for k, name in enumerate("RGBA"[: light.shape[2]])}
    for layer, values in layers.items():
        parts = np.atleast_3d(values)
        channels |= {name: parts[..., k] for k, name in enumerate(LAYERS[layer])}
    with TemporaryDirectory() as folder:  # the library only writes to named files
        path = Path(folder) / "picture.exr"
        arrays = {name: np.ascontiguousarray(part, np.float32) for name, part in channels.items()}
        with OpenEXR.File(header, arrays) as file:
            file.write(str(path))
        return path.read_bytes()


def tiff(light: np.ndarray, text: Mapping[str, str]) -> bytes:
    """Encode a TIFF file by tifffile: 32-bit floats, uncompressed.

    Parameters
    ----------
    light : ndarray, float32 [height, width, 3 or 4]
        Linear red, green and blue, and alpha that they are multiplied by.
    text : mapping of str to str
        Keywords and texts of the metadata, in the description.

    Returns
    -------
    bytes
    """
    from tifffile import imwrite

    file, note = BytesIO(), "\n".join(f"{k}: {v}" for k, v in text.items())
    pixels = np.ascontiguousarray(light, np.float32)
    alpha = ["assocalpha"] if light.shape[2] == 4 else None
    imwrite(
        file,
        pixels,
        photometric="rgb",
        extrasamples=alpha,
        description=note.encode(),
        metadata=None,
        software=False,
    )
    return file.getvalue()
