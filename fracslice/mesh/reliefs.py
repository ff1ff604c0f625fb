"""Pictures as heights above a plane, a cylinder or a sphere."""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from .. import _native
from ..common.cache import key
from ..common.files import open_picture, open_regular
from ..errors import MeshError
from ..expr.language import InMemory
from .models import require_unchanged

MOST = 1 << 22
"""Most pixels of a picture that are kept."""


@dataclass(frozen=True, eq=False)
class Relief(InMemory):
    """Heights that machine code asks for, divided by `slope`; see `native/mesh/relief.h`."""

    slope: float  # bound of their gradient
    highest: float
    half: tuple[float, float]  # half of the grid's width and height

    @classmethod
    def of(
        cls,
        heights: NDArray[np.float64],
        step: tuple[float, float],
        wraps: bool,
        crowded: NDArray[np.float64],
    ) -> Relief:
        """Relief of heights [rows, columns].

        `crowded`: by how much steps across are shorter than stated, between each row and the next, at most.
        """
        along = np.append(heights, heights[:, :1], 1) if wraps else heights
        across, up = (np.abs(np.diff(along, axis=axis)) / step[1 - axis] for axis in (1, 0))
        across = np.maximum(across[:-1], across[1:]) * crowded
        up = np.maximum(up[:, :-1], up[:, 1:])
        slope = float(np.hypot(across, up).max()) or 1.0
        native = _native.Relief(np.ascontiguousarray(heights / slope), *step, wraps)
        rows, columns = heights.shape
        half = step[0] * (columns - (not wraps)) / 2, step[1] * (rows - 1) / 2
        digest = int(key("relief", heights, *step, wraps)[:16], 16)
        return cls(digest, native, slope, float(heights.max()), half)


@lru_cache(maxsize=8)
def flat(file: str, sha256: str, size: float, black: float, white: float) -> Relief:
    """Heights of a picture whose longest side is `size`, from the middles of its first pixels to the last."""
    heights = _heights(file, sha256, black, white)
    step = size / (max(heights.shape) - 1)
    return Relief.of(heights, (step, step), False, np.ones((len(heights) - 1, 1)))


@dataclass(frozen=True)
class Round:
    """Heights of a picture on a cylinder around z, or on a sphere."""

    relief: Relief  # by the lengths of arcs, and of a cylinder by z
    radius: float
    shift: float  # of the relief's middle from that of the picture
    half: tuple[float, float]  # half of the angle that the picture takes, radians, and of its height along z


@lru_cache(maxsize=8)
def around(file: str, sha256: str, size: float, degrees: float, black: float, white: float) -> Round:
    """Wall of a height `size` with a picture that goes around it by `degrees`, to a whole column.

    Behind an open wall, its edges are joined by slopes.
    """
    heights = _heights(file, sha256, black, white)
    rows, columns = heights.shape
    steps = columns if degrees == 360 else columns - 1
    whole = max(round(steps * 360 / degrees), steps + (degrees < 360))
    behind = np.linspace(heights[:, -1], heights[:, 0], whole - steps + 1, axis=1)[:, 1:-1]
    joined = heights if degrees == 360 else np.append(heights, behind, 1)
    step = size / (rows - 1)
    relief = Relief.of(joined, (step, step), True, np.ones((rows - 1, 1)))
    half = math.pi * steps / whole, size / 2
    return Round(relief, whole * step / (2 * math.pi), step * (columns - 1 - whole) / 2, half)


@lru_cache(maxsize=8)
def globe(file: str, sha256: str, size: float, black: float, white: float) -> Round:
    """Heights of a map of longitudes and latitudes on a sphere of a diameter, along its equator and meridian.

    At each pole is the mean of a row.
    """
    heights = _heights(file, sha256, black, white)
    rows, columns = heights.shape
    heights[[0, -1]] = heights[[0, -1]].mean(1, keepdims=True)
    step = math.pi * size / columns, math.pi * size / 2 / (rows - 1)
    from_pole = math.pi * np.arange(rows) / (rows - 1)
    nearest = np.minimum(from_pole[:-1], from_pole[::-1][1:])  # to a pole, of the points between two rows
    # Beside a pole differences across grow from 0 with the angle, of which a sine is at least 2/pi.
    least = np.where(nearest > 0, np.sin(nearest), 2 / math.pi * from_pole[1])
    relief = Relief.of(heights, step, True, 1 / least[:, None])
    return Round(relief, size / 2, -step[0] / 2, (math.pi, size / 2))


def _heights(file: str, sha256: str, black: float, white: float) -> NDArray[np.float64]:
    """Heights of a picture's pixels, [rows, columns], the lowest row first."""
    levels = grey(file)
    require_unchanged(file, sha256)
    if min(levels.shape) < 2:
        raise MeshError(f"{levels.shape[1]} x {len(levels)} pixels: expected at least 2 x 2")
    return black + (white - black) * levels[::-1]


def grey(file: str) -> NDArray[np.float64]:
    """Levels of a picture of 8 or 16 bits, 0 of black to 1 of white; pixels of a large one are averaged."""
    try:
        with open_regular(file) as opened, warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of Pillow: what is wrong is an error here
            picture = open_picture(opened, ("PNG", "JPEG", "WEBP", "TIFF"))
            deep = picture.mode.startswith("I")
            image = picture.convert("F" if deep else "L")
            if (times := math.ceil(math.sqrt(math.prod(picture.size) / MOST))) > 1:
                image = image.reduce(times)
            return np.asarray(image, np.float64) / (65535 if deep else 255)
    except OSError as error:
        reason = error.strerror or "not a picture that can be read"
    except (ValueError, SyntaxError) as error:
        reason = " ".join(str(error).split()) or "not a picture that can be read"
    raise MeshError(f"{reason}; expected a .png, .jpg, .webp or .tif file") from None
