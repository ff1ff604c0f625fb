"""Image files with text metadata, written atomically: PNG, JPEG, WebP, OpenEXR and TIFF of floats."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from io import BytesIO
from pathlib import Path

import numpy as np

from ..common.files import replacing
from ..errors import ExportError
from ..work import Work
from .colour_png import levels, write_png
from .scanlines import write_exr, write_tiff

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
    """
    metadata = text or {}
    if ending in LOSSY:
        return lossy(shown, LOSSY[ending], metadata)
    file = BytesIO()
    if ending == ".png":
        write_png(file, shown.shape, [shown], bits, metadata, work)
    elif ending == ".exr":
        channels, names = _layered(light, layers or {})
        write_exr(file, channels.shape, [channels], names, metadata)
    else:
        write_tiff(file, light.shape, [light], metadata)
    return file.getvalue()


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

    Raises
    ------
    ExportError
        If the format cannot hold the size.
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


def _layered(light: np.ndarray, layers: Mapping[str, np.ndarray]) -> tuple[np.ndarray, list[str]]:
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

    Parameters
    ----------
    path : str or path
        The file to write, of a kind of `BANDED`.
    size : tuple of int
        Width and height, pixels.
    bands : iterable of tuple of ndarray
        Consecutive rows: sRGB and light, as for `write_image`.
    channels : {3, 4}
        Channels of the image.
    bits, text, work
        As for `write_image`.
    """
    shape, ending, folder = (size[1], size[0], channels), check_image(path), Path(path).parent
    with replacing(path) as file:
        if ending == ".png":
            write_png(file, shape, (shown for shown, _ in bands), bits, text, work)
        elif ending == ".exr":
            write_exr(file, shape, (light for _, light in bands), "RGBA"[:channels], text, folder)
        else:
            write_tiff(file, shape, (light for _, light in bands), text, folder)
