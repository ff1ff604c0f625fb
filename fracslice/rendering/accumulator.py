"""Accumulators: per-pixel sums over samples of equal weight, and the goals of the pass under way."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any, Protocol

import numpy as np

from ..scene.view import Film
from ..work import Work, chunks
from .film import BAND, develop, levels
from .units.pixel import UNKNOWN, squared_error

CHANNELS = 7
"""Numbers per pixel: sums of red, green, blue, displayed brightness and its square, sample count, goal."""
COUNT, GOAL = 5, 6
"""Channels of the sample count and of the count at the end of the pass under way."""

TRUSTED = 8
"""Samples below which a pixel's variance estimate is not used."""
COARSE = 4
"""Default grid spacing of the first pass, pixels."""
NEARLY = 0.999
"""Safety factor: a mean times this does not exceed the largest value, despite rounding."""
FEW = 1 / 256
"""Fraction of unfinished pixels up to which all of them are sampled: a pass has a fixed cost even for one
pixel."""


@dataclass(frozen=True)
class Plan:
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
    coarse : int
        Grid spacing of the first pass, pixels.
    """

    sums: Any
    passes: int
    coarse: int

    def plan(self, most: int, tolerance: float) -> Plan:
        """Set the goals of the next pass, or return the rest of an interrupted one.

        The first pass takes one sample on a grid of pixels, the second one of all other pixels. Later passes
        double the samples of all pixels with fewer than TRUSTED. A pixel then gets as many samples again, up
        to `most`, if two conditions hold:

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

    def anew(self, coarse: int) -> Accumulator:
        """Return an empty accumulator of the same size; this one becomes invalid.

        Parameters
        ----------
        coarse : int
            Grid spacing of the first pass, pixels.

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

    def shown(self, film: Film, mode: str) -> np.ndarray:
        """Develop the picture.

        Parameters
        ----------
        film : Film
            Exposure, bloom and tone curve.
        mode : str
            `Shading.mode`.

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


@dataclass(eq=False)
class HostAccumulator:
    """Picture in progress in host memory.

    Attributes
    ----------
    width, height : int
        Picture size, pixels.
    sums : ndarray, shape (height * width * CHANNELS,)
        Sums in the kernel's float type.
    passes : int
        Completed passes.
    coarse : int
        Grid spacing of the first pass, pixels.
    work : Work
        Threads.
    """

    width: int
    height: int
    sums: np.ndarray
    passes: int = 0
    coarse: int = COARSE
    work: Work = field(default_factory=lambda: Work(1))

    @classmethod
    def empty(
        cls, width: int, height: int, dtype: np.dtype, coarse: int = COARSE, work: Work | None = None
    ) -> HostAccumulator:
        """Create an accumulator without samples.

        Parameters
        ----------
        width, height : int
            Picture size, pixels.
        dtype : dtype
            Kernel float type.
        coarse : int
            Grid spacing of the first pass, pixels.
        work : Work, optional
            Threads; one by default.

        Returns
        -------
        HostAccumulator
            The empty accumulator.
        """
        sums = np.zeros(width * height * CHANNELS, dtype)
        return cls(width, height, sums, coarse=coarse, work=work or Work(1))

    def anew(self, coarse: int) -> HostAccumulator:
        """Return an empty accumulator of the same size; see `Accumulator.anew`."""
        return self.empty(self.width, self.height, self.sums.dtype, coarse, self.work)

    def host(self) -> HostAccumulator:
        """Return the accumulator itself."""
        return self

    @property
    def channels(self) -> np.ndarray:
        """View of the sums, shape (height, width, CHANNELS)."""
        return self.sums.reshape(self.height, self.width, CHANNELS)

    @property
    def counts(self) -> np.ndarray:
        """Samples of each pixel, shape (height, width)."""
        return self.channels[..., COUNT]

    def mean(self) -> np.ndarray:
        """Return the mean of the samples.

        Returns
        -------
        ndarray of float32, shape (height, width, 3)
            Linear light; pixels without samples have that of the first pass's grid, if any.
        """
        return self._spread(self._known())

    def shown(self, film: Film, mode: str) -> np.ndarray:
        """Develop the picture; see `Accumulator.shown`."""
        return self._spread(levels(develop(self._known(), film, mode, self.work)))

    def developed(self, film: Film, mode: str) -> np.ndarray:
        """Develop the picture to floats.

        Parameters
        ----------
        film : Film
            Exposure, bloom and tone curve.
        mode : str
            `Shading.mode`.

        Returns
        -------
        ndarray of float32, shape (height, width, 3)
            sRGB in [0, 1].
        """
        return self._spread(develop(self._known(), film, mode, self.work))

    def _known(self) -> np.ndarray:
        """Mean of the sampled pixels, float32: after the first pass its grid, later the whole picture."""
        if self.passes != 1:
            return self._means(1)
        grid = self._means(self.coarse)
        if not self.channels.reshape(-1, CHANNELS)[1:2, GOAL].any():
            return grid
        sampled = self.counts[..., None] > 0  # the second pass was interrupted
        return np.where(sampled, self._means(1), self._spread(grid))

    def _means(self, step: int) -> np.ndarray:
        sums = self.channels[::step, ::step]
        means = np.empty((*sums.shape[:2], 3), np.float32)

        def divided(rows: slice) -> None:
            means[rows] = sums[rows, :, :3] / np.maximum(sums[rows, :, COUNT, None], 1)

        self.work.map(divided, chunks(len(sums), BAND))
        return means

    def _spread(self, known: np.ndarray) -> np.ndarray:
        """Expand the grid of the first pass to the whole picture."""
        if known.shape[:2] == (self.height, self.width):
            return known
        wide = known.repeat(self.coarse, 0).repeat(self.coarse, 1)
        return np.ascontiguousarray(wide[: self.height, : self.width])

    def _bands(self) -> list[slice]:
        return chunks(self.height, BAND)

    def _errors(self, rows: slice) -> tuple[np.ndarray, np.ndarray]:
        """Samples and squared errors of some rows, float64."""
        bright, squares, n = np.moveaxis(self.channels[rows, :, 3 : COUNT + 1], -1, 0).astype(np.float64)
        return n, squared_error(bright, squares, n)

    def statistics(self) -> tuple[float, float]:
        """Return the statistics of the picture; see `Accumulator.statistics`."""

        def measured(rows: slice) -> tuple[float, float, int]:
            n, squares = self._errors(rows)
            known = squares[squares < UNKNOWN]
            return float(n.sum()), float(known.sum()), known.size

        samples, total, known = map(sum, zip(*self.work.collect(measured, self._bands()), strict=True))
        return samples / (self.width * self.height), float(np.sqrt(total / known)) if known else float("inf")

    def plan(self, most: int, tolerance: float) -> Plan:
        """Set the goals of the next pass; see `Accumulator.plan`."""
        plan = self._wanted()
        if not plan.samples and self.passes < 2:
            step = self.coarse if self.passes == 0 else 1
            self.channels[::step, ::step, GOAL] = 1
            plan = self._wanted()
        if not plan.samples:
            self._judge(most, tolerance)
            plan = self._wanted()
        return plan

    def _judge(self, most: int, tolerance: float) -> None:
        """Set the goals of the unfinished pixels with the largest gain."""
        gains = np.empty((self.height, self.width))

        def judged(rows: slice) -> tuple[float, int]:
            seen = slice(max(rows.start - 1, 0), rows.stop + 1)
            own = slice(rows.start - seen.start, rows.stop - seen.start)
            n, squares = self._errors(seen)
            trusted = np.where(n < TRUSTED, UNKNOWN, squares)
            unfinished = (n < most) & (around(trusted) > tolerance * tolerance)
            gains[rows] = np.where(unfinished, around(trusted / n), -1.0)[own]
            known = gains[rows][unfinished[own]]
            return float(known.sum()), known.size

        def aimed(rows: slice) -> None:
            n = self.counts[rows]
            goals = np.minimum(np.ldexp(1.0, np.frexp(n)[1]), most)  # the next power of two
            self.channels[rows, :, GOAL] = np.where(gains[rows] >= least, goals, n)

        total, count = map(sum, zip(*self.work.collect(judged, self._bands()), strict=True))
        least = NEARLY * total / count if count > FEW * gains.size else 0.0
        self.work.map(aimed, self._bands())

    def _wanted(self) -> Plan:
        """Pixels that have not reached their goals."""
        order, places = band_order(self.width)

        def chosen(rows: slice) -> tuple[np.ndarray, float, float]:
            size = (rows.stop - rows.start) * self.width
            left = (self.channels[rows, :, GOAL] - self.channels[rows, :, COUNT]).ravel()
            inside = places if size == len(places) else places[places < size]
            pixels = order if size == len(places) else order[places < size]
            pixels = pixels[left[inside] > 0] + np.int32(rows.start << 16)
            return pixels, float(left.sum(dtype=np.float64)), float(self.channels[rows, :, GOAL].max())

        pixels, samples, goals = zip(*self.work.collect(chosen, self._bands()), strict=True)
        return Plan(np.concatenate(pixels), int(sum(samples)), int(max(goals)))


@lru_cache(maxsize=4)
def band_order(width: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the pixels of a band in tile order, so that the pixels of a packet are neighbours.

    Pixels are ordered by blocks of 64 x 32 pixels; within a block, by tiles of 8 x 4.

    Parameters
    ----------
    width : int
        Picture width, pixels.

    Returns
    -------
    pixels : ndarray of int32, shape (BAND * width,)
        Pixels, ``y << 16 | x``. Read-only.
    places : ndarray of intp, shape (BAND * width,)
        Their row-major indices. Read-only.
    """
    y, x = np.divmod(np.arange(BAND * width, dtype=np.int32), np.int32(width))
    places = np.lexsort((x, y, x // 8, y // 4, x // 64))
    pixels = (y << 16 | x)[places]
    for array in (pixels, places):
        array.setflags(write=False)
    return pixels, places


def ordered(width: int, height: int) -> np.ndarray:
    """Return all pixels of a picture in tile order.

    Parameters
    ----------
    width, height : int
        Picture size, pixels.

    Returns
    -------
    ndarray of int32, shape (width * height,)
        Pixels, ``y << 16 | x``.
    """
    order, _ = band_order(width)
    bands = [order + np.int32(rows.start << 16) for rows in chunks(height, BAND)]
    pixels = np.concatenate(bands)
    return pixels[pixels >> 16 < height]


def around(values: np.ndarray) -> np.ndarray:
    """Return the maximum over each pixel and its eight neighbours.

    Parameters
    ----------
    values : ndarray, shape (height, width)
        One value per pixel.

    Returns
    -------
    ndarray, shape (height, width)
        The maxima.
    """
    rows = values.copy()
    np.maximum(rows[1:], values[:-1], out=rows[1:])
    np.maximum(rows[:-1], values[1:], out=rows[:-1])
    found = rows.copy()
    np.maximum(found[:, 1:], rows[:, :-1], out=found[:, 1:])
    np.maximum(found[:, :-1], rows[:, 1:], out=found[:, :-1])
    return found
