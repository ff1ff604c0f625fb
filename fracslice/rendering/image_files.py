"""Pictures that a scene names: skies and textures, as linear light."""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from ..common.srgb import to_linear
from ..errors import SceneError

_SIZE = re.compile(rb"-Y (\d{1,6}) \+X (\d{1,6})")
FORMATS = "a .hdr, .exr, .png, .jpg or .webp file"


@dataclass(frozen=True, eq=False)
class LinearImage:
    """Picture of a file, in linear light.

    Attributes
    ----------
    light : ndarray of float32, shape (height, width, 3)
        Linear red, green and blue, not negative.
    """

    light: np.ndarray

    @property
    def size(self) -> tuple[float, float]:
        """Width and height, pixels."""
        height, width, _ = self.light.shape
        return float(width), float(height)

    def within(self, most: int) -> np.ndarray:
        """Return the light of at most `most` pixels; larger pictures are halved by averaging.

        Parameters
        ----------
        most : int
            Maximum number of pixels.

        Returns
        -------
        ndarray of float32, shape (height, width, 3)
            Linear light.
        """
        light = self.light
        while light.shape[0] * light.shape[1] > most:
            light = _halved(light)
        return light


def load_picture(path: str, most: int, fail: Callable[[str], SceneError]) -> LinearImage:
    """Read a picture; one that is too large is averaged to half its size, as often as necessary.

    Parameters
    ----------
    path : str
        The file.
    most : int
        Maximum number of pixels.
    fail : callable
        Makes the error to raise from a message.

    Returns
    -------
    LinearImage
        The picture; the same object while the file does not change.

    Raises
    ------
    SceneError
        If the file cannot be read.
    """
    try:
        stat = os.stat(path)
        return _loaded(path, most, (stat.st_mtime_ns, stat.st_size))
    except OSError as error:
        reason = error.strerror or "not a picture"
    except IndexError:
        reason = "it ends too early"
    except (ValueError, RuntimeError, SyntaxError) as error:
        reason = " ".join(str(error).split()) or "not a picture"
    raise fail(f'"{path}": {reason}; expected {FORMATS}') from None


@lru_cache(maxsize=4)
def _loaded(path: str, most: int, _: tuple[int, int]) -> LinearImage:
    kinds = {".hdr": radiance, ".exr": _openexr}
    light = np.asarray(kinds.get(Path(path).suffix.lower(), _displayed)(path), np.float32)
    if not np.isfinite(light).all():
        raise ValueError("it holds values that are not finite")
    light = LinearImage(np.maximum(light, 0)).within(most)
    light.flags.writeable = False
    return LinearImage(light)


def _halved(light: np.ndarray) -> np.ndarray:
    """Mean of each 2 x 2 pixels; an odd last row or column is repeated."""
    padded = np.pad(light, ((0, light.shape[0] % 2), (0, light.shape[1] % 2), (0, 0)), "edge")
    rows = (padded[::2] + padded[1::2]) * np.float32(0.5)
    return np.asarray((rows[:, ::2] + rows[:, 1::2]) * np.float32(0.5))


def _displayed(path: str) -> np.ndarray:
    """Picture for screens, by Pillow."""
    from PIL import Image

    try:
        with Image.open(path) as image:
            shown = np.asarray(image.convert("RGB"), np.float32) / np.float32(255)
    except Image.DecompressionBombError as error:
        raise ValueError(str(error)) from None
    return to_linear(shown)


def _openexr(path: str) -> np.ndarray:
    """OpenEXR file: its red, green and blue, or its only channel for all three."""
    import OpenEXR

    with OpenEXR.File(path, separate_channels=True) as file:
        channels = file.channels()
        names = ("R", "G", "B") if "R" in channels else ("Y",) * 3
        if names[0] not in channels or names[2] not in channels:
            raise ValueError(f"its channels are {', '.join(channels)}: expected R, G and B")
        return np.stack([np.asarray(channels[name].pixels, np.float32) for name in names], -1)


def radiance(path: str) -> np.ndarray:
    """Read a Radiance picture (Ward 1991, "Real Pixels"): mantissas of 8 bits with a common exponent.

    Returns
    -------
    ndarray of float32, shape (height, width, 3)
        Linear red, green and blue.

    Raises
    ------
    ValueError
        If it is no such picture.
    """
    data = Path(path).read_bytes()
    header, end, rest = data.partition(b"\n\n")
    size, _, pixels = rest.partition(b"\n")
    match = _SIZE.fullmatch(size.strip())
    if not (data.startswith(b"#?") and end and b"32-bit_rle_rgbe" in header and match):
        raise ValueError("no Radiance picture of red, green and blue, from the upper left")
    height, width = map(int, match.groups())
    levels = np.empty((height, width, 4), np.uint8)
    place = 0
    for row in levels:
        place = _scanline(pixels, place, row)
    scale = np.ldexp(np.float32(1), levels[..., 3:].astype(np.int32) - 136)
    return np.asarray(levels[..., :3] * np.where(levels[..., 3:] > 0, scale, 0), np.float32)


def _scanline(data: bytes, place: int, row: np.ndarray) -> int:
    """Decode one row; return the index of the byte after it."""
    width = len(row)
    if data[place : place + 2] != b"\2\2" or not 8 <= width < 1 << 15:
        flat = _levels(data, place, 4 * width).reshape(width, 4)
        if (flat[:, :3] == 1).all(1).any():
            raise ValueError("run lengths of the first Radiance format are not supported")
        row[:] = flat
        return place + 4 * width
    place += 4
    for channel in range(4):
        k = 0
        while k < width:
            count = data[place]
            if count > 128:
                count -= 128
                row[k : k + count, channel] = data[place + 1]
                place += 2
            else:
                row[k : k + count, channel] = _levels(data, place + 1, count)[: width - k]
                place += 1 + count
            if not 0 < count <= width - k:
                raise ValueError("damaged run lengths")
            k += count
    return place


def _levels(data: bytes, place: int, count: int) -> np.ndarray:
    """Some bytes as numbers."""
    if place + count > len(data):
        raise IndexError
    return np.frombuffer(data, np.uint8, count, place)
