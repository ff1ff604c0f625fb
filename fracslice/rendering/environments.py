"""Pictures that a scene names, as linear light, and their tables for `units.environment`."""

from __future__ import annotations

import math
import os
import re
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path
from typing import BinaryIO

import numpy as np

from ..common.arrays import to_linear
from ..common.files import open_picture, open_regular, require_pixels
from ..errors import SceneError

_SIZE = re.compile(rb"-Y (\d{1,6}) \+X (\d{1,6})")
FORMATS = "a .hdr, .exr, .png, .jpg or .webp file"
BAND = 1 << 20
"""Pixels that are in memory as light at once."""

Rows = tuple[int, int, Callable[[int, int], np.ndarray]]
"""Height and width of a picture, and a function of its rows from one to another, called in their order:
float32 (rows, width, 3), linear light.
"""


@dataclass(frozen=True, eq=False)
class LinearImage:
    """Picture of a file, in linear light."""

    light: np.ndarray  # linear red, green and blue, not negative

    @property
    def size(self) -> tuple[float, float]:
        """Width and height, pixels."""
        height, width, _ = self.light.shape
        return float(width), float(height)

    def within(self, most: int) -> np.ndarray:
        """Return the light of at most `most` pixels; larger pictures are halved by averaging.

        `most`: maximum number of pixels. Returns float32 (height, width, 3).
        """
        height, width, _ = self.light.shape
        return _shrunk(self.light, _halvings(height, width, most))


def load_picture(path: str, most: int, fail: Callable[[str], SceneError]) -> LinearImage:
    """Read a picture; one that is too large is averaged to half its size, as often as necessary.

    `most`: maximum number of pixels.
    """
    try:
        stat = os.stat(path)
        return _load_image(path, most, (stat.st_mtime_ns, stat.st_size))
    except OSError as error:
        reason = error.strerror or "not a picture"
    except IndexError:
        reason = "it ends too early"
    except (ValueError, RuntimeError, SyntaxError) as error:
        reason = " ".join(str(error).split()) or "not a picture"
    raise fail(f'"{path}": {reason}; expected {FORMATS}') from None


@lru_cache(maxsize=4)
def _load_image(path: str, most: int, _: tuple[int, int]) -> LinearImage:
    kinds = {".hdr": radiance, ".exr": _openexr}
    with open_regular(path) as file, warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of Pillow: what is wrong is an error here
        height, width, rows = kinds.get(Path(path).suffix.lower(), _display_picture)(file)
        require_pixels(width, height)
        times = _halvings(height, width, most)
        step = max(BAND // width >> times, 1) << times
        bands = [_shrunk(rows(y, min(y + step, height)), times) for y in range(0, height, step)]
    light = np.concatenate(bands)
    light.flags.writeable = False
    return LinearImage(light)


def _halvings(height: int, width: int, most: int) -> int:
    """How often a picture is halved until it has at most so many pixels."""
    times = 0
    while -(-height >> times) * -(-width >> times) > most:
        times += 1
    return times


def _shrunk(light: np.ndarray, times: int) -> np.ndarray:
    """Rows of a picture, halved."""
    if not np.isfinite(light).all():
        raise ValueError("it holds values that are not finite")
    light = np.maximum(light, 0)
    for _ in range(times):
        light = _halve(light)
    return light


def _halve(light: np.ndarray) -> np.ndarray:
    """Mean of each 2 x 2 pixels; an odd last row or column is repeated."""
    padded = np.pad(light, ((0, light.shape[0] % 2), (0, light.shape[1] % 2), (0, 0)), "edge")
    rows = (padded[::2] + padded[1::2]) * np.float32(0.5)
    return np.asarray((rows[:, ::2] + rows[:, 1::2]) * np.float32(0.5))


def _display_picture(file: BinaryIO) -> Rows:
    """Picture for screens, by Pillow."""
    levels = to_linear(np.arange(256, dtype=np.float32) / np.float32(255))
    image = open_picture(file, ("PNG", "JPEG", "WEBP"))
    width, height = image.size
    return height, width, lambda y, end: levels[np.asarray(image.crop((0, y, width, end)).convert("RGB"))]


def _openexr(file: BinaryIO) -> Rows:
    """OpenEXR file: its red, green and blue, or its only channel for all three."""
    import Imath
    import OpenEXR

    with _silent_stderr():
        picture = OpenEXR.InputFile(file.name)
    header, kind = picture.header(), Imath.PixelType(Imath.PixelType.FLOAT)
    channels, window = header["channels"], header["dataWindow"]
    names = ["R", "G", "B"] if "R" in channels else ["Y"]
    if not channels.keys() >= set(names):
        raise ValueError(f"its channels are {', '.join(channels)}: expected R, G and B")
    first, width = window.min.y, window.max.x - window.min.x + 1

    def rows(y: int, end: int) -> np.ndarray:
        with _silent_stderr():
            values = picture.channels(names, kind, first + y, first + end - 1)
        levels = [np.frombuffer(value, np.float32).reshape(end - y, width) for value in values]
        return np.stack(levels * (3 // len(levels)), -1)

    return window.max.y - first + 1, width, rows


@contextmanager
def _silent_stderr() -> Iterator[None]:
    """Keep off stderr what OpenEXR prints besides its exceptions."""
    kept = os.dup(2)
    try:
        with open(os.devnull, "wb") as nowhere:
            os.dup2(nowhere.fileno(), 2)
        yield
    finally:
        os.dup2(kept, 2)
        os.close(kept)


def radiance(file: BinaryIO) -> Rows:
    """Read a Radiance picture (Ward 1991, "Real Pixels"): mantissas of 8 bits with a common exponent."""
    data = file.read()
    header, end, rest = data.partition(b"\n\n")
    size, _, pixels = rest.partition(b"\n")
    match = _SIZE.fullmatch(size.strip())
    if not (data.startswith(b"#?") and end and b"32-bit_rle_rgbe" in header and match):
        raise ValueError("no Radiance picture of red, green and blue, from the upper left")
    height, width = map(int, match.groups())
    place = 0

    def rows(y: int, end: int) -> np.ndarray:
        nonlocal place
        levels = np.empty((end - y, width, 4), np.uint8)
        for row in levels:
            place = _scanline(pixels, place, row)
        scale = np.ldexp(np.float32(1), levels[..., 3:].astype(np.int32) - 136)
        return np.asarray(levels[..., :3] * np.where(levels[..., 3:] > 0, scale, 0), np.float32)

    return height, width, rows


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


PIXELS = 2048 * 1024
"""Maximum number of pixels of a sky."""
SMOOTH = 1 << 13
"""Number of pixels that determine its light without shadows."""
_FACTORS = (
    (0.282095, math.pi),
    *(((0.488603, 2 * math.pi / 3),) * 3),
    *(((1.092548, math.pi / 4),) * 2),
    (0.315392, math.pi / 4),
    (1.092548, math.pi / 4),
    (0.546274, math.pi / 4),
)
"""Norm of each spherical harmonic and its factor in a convolution with a cosine, in the order of
`units.environment.irradiance`."""


@lru_cache(maxsize=2)
def environment(picture: LinearImage) -> Environment:
    """Return the environment of a picture."""
    return Environment(picture)


@dataclass(frozen=True, eq=False)
class Environment:
    """Picture of the surroundings."""

    picture: LinearImage  # linear light

    @property
    def steps(self) -> tuple[int, ...]:
        """Binary logarithms of width and height, rounded up."""
        return tuple(math.ceil(math.log2(n)) for n in self.picture.size)

    @property
    def halves(self) -> tuple[float, ...]:
        """Largest powers of two below width and height."""
        return tuple(2.0 ** (n - 1) for n in self.steps)

    @cached_property
    def distribution(self) -> tuple[np.ndarray, np.ndarray]:
        """Distribution functions of the rows, and of the columns of each row.

        The density of a pixel is the mean of the interpolated light in it: none is zero where there is light.
        """
        grey = self.picture.light.mean(2, dtype=np.float64)
        rows = np.pad(grey, ((1, 1), (0, 0)), "edge")
        grey = 0.125 * (rows[:-2] + rows[2:]) + 0.75 * grey
        grey = 0.125 * (np.roll(grey, 1, 1) + np.roll(grey, -1, 1)) + 0.75 * grey
        grey *= _solid_angles(*grey.shape)[:, None]
        return _cumulate(grey.sum(1)), _cumulate(grey)

    def harmonics(self, turn: float) -> tuple[tuple[float, ...], ...]:
        """Factors of `units.environment.irradiance`."""
        light = self.picture.within(SMOOTH)
        height, width, _ = light.shape
        theta = (np.arange(height) + 0.5) * np.pi / height
        phi = ((np.arange(width) + 0.5) / width - 0.5 - turn) * 2 * np.pi
        z, sine = np.cos(theta)[:, None], np.sin(theta)[:, None]
        x, y = sine * np.sin(phi), sine * np.cos(phi)
        bases = (1 + 0 * x, y, z + 0 * x, x, x * y, y * z, 3 * z * z - 1 + 0 * x, x * z, x * x - y * y)
        light = light * _solid_angles(height, width)[:, None, None]
        sums = [
            np.tensordot(base, light, 2) * norm * norm * factor / np.pi
            for base, (norm, factor) in zip(bases, _FACTORS, strict=True)
        ]
        return tuple(tuple(map(float, channel)) for channel in np.transpose(sums))


def _solid_angles(height: int, width: int) -> np.ndarray:
    """Solid angle of a pixel of each row."""
    z = np.cos(np.linspace(0, np.pi, height + 1))
    return np.asarray((z[:-1] - z[1:]) * 2 * np.pi / width)


def _cumulate(weights: np.ndarray) -> np.ndarray:
    """Distribution functions along the last axis; uniform where all weights are zero."""
    total = weights.sum(-1, keepdims=True)
    share = np.where(total > 0, weights, 1) / np.where(total > 0, total, weights.shape[-1])
    sums = np.cumsum(share, -1)
    sums[..., -1] = 1
    return np.concatenate([np.zeros_like(total), np.minimum(sums, 1)], -1)
