"""Image files with text metadata, written atomically: PNG, JPEG, WebP, OpenEXR and TIFF of floats."""

from __future__ import annotations

import shutil
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import BinaryIO

import numpy as np

from ..common.files import replacing, temporary_folder
from ..errors import ExportError
from ..work import Work, chunks
from .png import STRIP, levels, write_png


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
