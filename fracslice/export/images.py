"""Image files with text metadata, written atomically: PNG, JPEG, WebP, OpenEXR and TIFF of floats."""

from __future__ import annotations

from collections.abc import Mapping
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from fracslice.errors import ExportError
from fracslice.files import replacing
from fracslice.work import Work

from .colour_png import levels, png

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
    image, file = Image.fromarray(levels(pixels, 8)), BytesIO()
    exif = image.getexif()
    exif[0x010E] = "\n".join(f"{k}: {v}" for k, v in text.items())  # ImageDescription
    try:
        image.save(file, kind, quality=QUALITY, subsampling=0, exif=exif)
    except (OSError, ValueError) as error:
        raise ExportError(f"{kind}: {error}") from None
    return file.getvalue()


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
