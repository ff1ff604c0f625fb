"""Accumulators: per-pixel sums over samples of equal weight, and the goals of the pass under way."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from ..scene.view import View

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
FIRST = 1 << 16
"""Maximum samples of the first pass, so that a large picture shows something soon."""
NEARLY = 0.999
"""Safety factor: a mean times this does not exceed the largest value, despite rounding."""
FEW = 1 / 16
"""Fraction of unfinished pixels up to which all of them are sampled: a pass has a fixed cost even for one
pixel."""


def grids(width: int, height: int) -> tuple[int, ...]:
    """Return the grid spacings of the first passes, which take one sample in each pixel of their grids.

    Parameters
    ----------
    width, height : int
        Picture size, pixels.

    Returns
    -------
    tuple of int
        Spacings, pixels; the last one is 1.
    """
    spacings = [1, COARSE]
    while width * height > FIRST * spacings[-1] ** 2:
        spacings.append(spacings[-1] * COARSE)
    return tuple(reversed(spacings))


@dataclass(frozen=True)
class PassPlan:
    """Pixels of a pass.

    Attributes
    ----------
    pixels : array of int32
        Pixels for the tracer, ``y << 16 | x``, in tile order.
    samples : int
        Samples to take; 0 when the picture is complete.
    last : int
        Largest goal of a pixel.
    """

    pixels: Any
    samples: int
    last: int


class Accumulator(Protocol):
    """Picture in progress, in host or device memory.

    Samples are added tile by tile, so that the sums are valid at any time. A pass that was interrupted
    continues where it stopped, since its goals are kept.

    Attributes
    ----------
    sums : array of real, shape (height * width * CHANNELS,)
        Sums of the picture.
    passes : int
        Completed passes.
    """

    sums: Any
    passes: int

    def plan(self, most: int, tolerance: float) -> PassPlan:
        """Set the goals of the next pass, or return the rest of an interrupted one.

        The first passes take one sample on finer and finer grids of pixels, see `grids`. Later passes double
        the samples of all pixels with fewer than TRUSTED. A pixel then gets as many samples again, up to
        `most`, if two conditions hold:

        - its error or a neighbour's is above the tolerance;
        - the samples reduce the error of the picture by at least the mean over all unfinished pixels.

        Samples thus go where the gain is largest (after Mitchell 1987, "Generating Antialiased Images at Low
        Sampling Densities"), and every pixel has a complete net of them.

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
