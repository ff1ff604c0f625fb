"""Image files with text metadata, written atomically: PNG, row by row too, JPEG, WebP, OpenEXR and TIFF."""

from __future__ import annotations

import shutil
import struct
import zlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import BinaryIO

import numpy as np
from isal.isal_zlib import crc32

from .._slices import Encoding, encoded, filtered
from ..common.files import replacing, temporary_folder
from ..errors import ExportError
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


@contextmanager
def _named_temporary(file: BinaryIO, folder: Path | None) -> Iterator[Path]:
    """Temporary file, for libraries that only write to named ones; its contents are copied to the file."""
    with temporary_folder(folder) as temporary:
        yield (path := temporary / "picture")
        with open(path, "rb") as written:
            shutil.copyfileobj(written, file)


def write_tiff(
    file: BinaryIO,
    shape: tuple[int, ...],
    bands: Iterable[np.ndarray],
    text: Mapping[str, str],
    folder: Path | None = None,
) -> None:
    """Write a TIFF file by tifffile: 32-bit floats, uncompressed.

    The bytes do not depend on the bands.
    """
    from tifffile import imwrite

    def strips() -> Iterator[bytes]:
        for band in bands:
            for rows in chunks(len(band), STRIP):
                yield np.ascontiguousarray(band[rows], "<f4").tobytes()

    with _named_temporary(file, folder) as path:
        imwrite(
            path,
            strips(),
            shape=shape,
            dtype="<f4",
            rowsperstrip=STRIP,
            photometric="rgb",
            extrasamples=["assocalpha"] if shape[2] == 4 else None,
            description="\n".join(f"{k}: {v}" for k, v in text.items()).encode(),
            metadata=None,
            software=False,
        )


def write_exr(
    file: BinaryIO,
    shape: tuple[int, ...],
    bands: Iterable[np.ndarray],
    names: Sequence[str],
    text: Mapping[str, str],
    folder: Path | None = None,
) -> None:
    """Write an OpenEXR file (Academy Software Foundation): 32-bit floats, losslessly compressed.

    The bytes do not depend on the bands.
    """
    import Imath
    import OpenEXR

    header = OpenEXR.Header(shape[1], shape[0])
    header["compression"] = Imath.Compression(Imath.Compression.ZIP_COMPRESSION)
    header["channels"] = {name: Imath.Channel(Imath.PixelType(Imath.PixelType.FLOAT)) for name in names}
    header |= {keyword: value.encode() for keyword, value in text.items()}
    with _named_temporary(file, folder) as path:
        output = OpenEXR.OutputFile(str(path), header)
        for band in bands:
            rows = {name: np.ascontiguousarray(band[..., k], "<f4") for k, name in enumerate(names)}
            output.writePixels({name: values.tobytes() for name, values in rows.items()}, len(band))
        output.close()


IMAGES = (".png", ".jpg", ".jpeg", ".webp", ".exr", ".tif", ".tiff")
LINEAR = (".exr", ".tif", ".tiff")
"""Extensions of linear light."""
LOSSY = {".jpg": "JPEG", ".jpeg": "JPEG", ".webp": "WEBP"}
BANDED = (".png", ".exr", ".tif", ".tiff")
"""Kinds of pictures that are written while they are made."""
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


def check_image(path: str | Path) -> str:
    """Extension of an image file."""
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

    `shown`: sRGB in [0, 1].
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
    """Encode an image, in the format of an extension."""
    metadata = text or {}
    if ending in LOSSY:
        return lossy(shown, LOSSY[ending], metadata)
    file = BytesIO()
    if ending == ".png":
        write_png(file, shown.shape, [shown], bits, metadata, work)
    elif ending == ".exr":
        channels, names = _layer_channels(light, layers or {})
        write_exr(file, channels.shape, [channels], names, metadata)
    else:
        write_tiff(file, light.shape, [light], metadata)
    return file.getvalue()


def lossy(shown: np.ndarray, kind: str, text: Mapping[str, str]) -> bytes:
    """Encode a JPEG or WebP file by Pillow, with sRGB of 8 bits and a description.

    `shown`: sRGB in [0, 1].
    """
    from PIL import Image

    pixels = shown[..., :3] if kind == "JPEG" else shown
    image, file = Image.fromarray(levels(pixels, 8)), BytesIO()
    exif = image.getexif()
    exif[0x010E] = "\n".join(f"{k}: {v}" for k, v in text.items())  # ImageDescription
    try:
        image.save(file, kind, quality=QUALITY, subsampling=0, exif=exif)
    except (OSError, ValueError) as error:
        raise ExportError(f"{kind}: {error}") from None
    return file.getvalue()


def _layer_channels(light: np.ndarray, layers: Mapping[str, np.ndarray]) -> tuple[np.ndarray, list[str]]:
    """Linear light and the layers of `LAYERS` as channels, and their names."""
    names = [*"RGBA"[: light.shape[2]], *(name for layer in layers for name in LAYERS[layer])]
    return np.concatenate([light, *map(np.atleast_3d, layers.values())], 2), names


def write_bands(
    path: str | Path,
    size: tuple[int, int],
    bands: Iterable[tuple[np.ndarray, np.ndarray]],
    channels: int,
    bits: int,
    text: Mapping[str, str],
    work: Work,
) -> None:
    """Write an image to a file while it is made; the file is the same as that of `write_image`.

    `size` in pixels.
    """
    shape, ending, folder = (size[1], size[0], channels), check_image(path), Path(path).parent
    with replacing(path) as file:
        if ending == ".png":
            write_png(file, shape, (shown for shown, _ in bands), bits, text, work)
        elif ending == ".exr":
            write_exr(file, shape, (light for _, light in bands), "RGBA"[:channels], text, folder)
        else:
            write_tiff(file, shape, (light for _, light in bands), text, folder)
