"""Accumulators: per-pixel sums over samples of equal weight, and the goals of the pass under way, in tile
order.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from ..scene.view import View
from ..work import chunks
from .film import BAND

if TYPE_CHECKING:
    from .host_accumulator import HostAccumulator

CHANNELS = 8
"""Numbers per pixel: sums of red, green, blue, displayed brightness and its square, sample count, goal,
samples whose camera ray hit.
"""
COUNT, GOAL, COVER = 5, 6, 7
"""Channels of the sample count, of the count at the end of the pass under way, and of the hits."""

TRUSTED = 8
"""Samples below which a pixel's variance estimate is not used."""
COARSE = 4
"""Ratio of the grid spacings of the first passes."""
SOON = 1 << 16
"""Maximum samples of the first pass, so that a large picture shows something soon."""
FIRST, DECAY = 2.0**-10, 4.0
"""Least gain of the first pass that chooses pixels, and the ratio of the least gains of consecutive passes: a
net of twice as many samples has a quarter of the gain."""
UNIFORM = 3
"""Passes before it, after those over grids: nets of 2, 4 and `TRUSTED` samples."""


def grids(width: int, height: int) -> tuple[int, ...]:
    """Return the grid spacings of the first passes, which take one sample in each pixel of their grids.

    All in pixels; the last spacing is 1.
    """
    spacings = [1, COARSE]
    while width * height > SOON * spacings[-1] ** 2:
        spacings.append(spacings[-1] * COARSE)
    return tuple(reversed(spacings))


@dataclass(frozen=True)
class PassPlan:
    """Pixels of a pass."""

    pixels: Any  # pixels for the tracer, ``y << 16 | x``, in tile order
    samples: int  # samples to take; 0 when the picture is complete
    last: int  # largest goal of a pixel


def least_gain(passes: int) -> float:
    """Return the least reduction of the squared error for which a pass takes a sample."""
    return FIRST / DECAY ** (passes - UNIFORM)


def next_choice(passes: int, largest: float) -> int:
    """Return the number of passes after which the next one chooses a pixel.

    `largest`: largest gain of an unfinished pixel.
    """
    while least_gain(passes) > largest:
        passes += 1
    return passes


class Accumulator(Protocol):
    """Picture in progress, in host or device memory.

    Samples are added tile by tile, so that the sums are valid at any time. A pass that was interrupted
    continues where it stopped, since its goals are kept.

    Attributes
    ----------
    width, height : int
        Picture size, pixels.
    sums : array of real, shape (height * width * CHANNELS,)
        Sums of the picture.
    passes : int
        Completed passes.
    """

    width: int
    height: int
    sums: Any
    passes: int

    def plan(self, most: int, tolerance: float) -> PassPlan:
        """Set the goals of the next pass, or return the rest of an interrupted one.

        The first passes take one sample on finer and finer grids of pixels, see `grids`. Later passes double
        the samples of all pixels with fewer than TRUSTED. A pixel then gets as many samples again, up to
        `most`, if two conditions hold:

        - its error or a neighbour's is above the tolerance;
        - a sample reduces the squared error of the picture by at least `least_gain` of the pass.

        Samples thus go where the gain is largest (after Mitchell 1987, "Generating Antialiased Images at Low
        Sampling Densities"), and every pixel has a complete net of them. A pass depends on a pixel and its
        neighbours only, so that a part of a picture has the samples of the whole one. Passes that choose no
        pixel are counted and skipped.

        Parameters
        ----------
        most : int
            Maximum samples per pixel.
        tolerance : float
            Standard error of displayed brightness at which a pixel has converged.

        Returns
        -------
        Plan
            Pixels to sample.
        """

    def anew(self) -> Accumulator:
        """Return an empty accumulator of the same size; this one becomes invalid.

        Returns
        -------
        Accumulator
            The empty accumulator.
        """

    def statistics(self) -> tuple[float, float]:
        """Return the statistics of the picture.

        Returns
        -------
        samples : float
            Mean samples per pixel.
        error : float
            Root mean square of the pixels' standard errors, in displayed brightness; infinite below 2
            samples.
        """

    def shown(self, view: View) -> np.ndarray:
        """Develop the picture.

        Parameters
        ----------
        view : View
            View of the picture.

        Returns
        -------
        ndarray of uint8, shape (height, width, 3)
            sRGB.
        """

    def host(self) -> HostAccumulator:
        """Return the picture in host memory.

        Returns
        -------
        HostAccumulator
            The same samples.
        """


@lru_cache(maxsize=4)
def band_order(width: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the pixels of a band in tile order, so that the pixels of a packet are neighbours.

    Pixels are ordered by blocks of 64 x 32 pixels; within a block, by tiles of 8 x 4.

    `width` in pixels. Returns pixels int32 (BAND * width,); places intp (BAND * width,).
    """
    y, x = np.divmod(np.arange(BAND * width, dtype=np.int32), np.int32(width))
    places = np.lexsort((x, y, x // 8, y // 4, x // 64))
    pixels = (y << 16 | x)[places]
    for array in (pixels, places):
        array.setflags(write=False)
    return pixels, places


def tile_order(width: int, height: int) -> np.ndarray:
    """Return all pixels of a picture in tile order.

    `width`, `height` in pixels. Returns int32 (width * height,).
    """
    order, _ = band_order(width)
    bands = [order + np.int32(rows.start << 16) for rows in chunks(height, BAND)]
    pixels = np.concatenate(bands)
    return pixels[pixels >> 16 < height]
