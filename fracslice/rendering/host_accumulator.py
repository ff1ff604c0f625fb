"""Accumulator in host memory."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ..scene.view import View
from ..work import Work, chunks
from .accumulator import CHANNELS, COARSE, COUNT, COVER, GOAL, TRUSTED, PassPlan, least_gain, next_choice
from .film import BAND, develop, levels
from .tiles import band_order
from .units.pixel import UNKNOWN, squared_error


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
    work : Work
        Threads.
    """

    width: int
    height: int
    sums: np.ndarray
    passes: int = 0
    work: Work = field(default_factory=lambda: Work(1))

    @classmethod
    def empty(cls, width: int, height: int, dtype: np.dtype, work: Work | None = None) -> HostAccumulator:
        """Create an accumulator without samples.

        Parameters
        ----------
        width, height : int
            Picture size, pixels.
        dtype : dtype
            Kernel float type.
        work : Work, optional
            Threads; one by default.

        Returns
        -------
        HostAccumulator
            The empty accumulator.
        """
        sums = np.zeros(width * height * CHANNELS, dtype)
        return cls(width, height, sums, work=work or Work(1))

    def anew(self) -> HostAccumulator:
        """Return an empty accumulator of the same size; see `Accumulator.anew`."""
        return self.empty(self.width, self.height, self.sums.dtype, self.work)

    def host(self) -> HostAccumulator:
        """Return the accumulator itself; see `Accumulator.host`."""
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
        ndarray of float32, shape (height, width, 4)
            Linear light, and the fraction of the samples whose camera ray hit; pixels without samples have
            those of the first pass's grid, if any.
        """
        return self._spread(self._known())

    def shown(self, view: View) -> np.ndarray:
        """Develop the picture; see `Accumulator.shown`."""
        return self._spread(levels(develop(self._known(), view, self.work)))

    def developed(self, view: View) -> np.ndarray:
        """Develop the picture to floats; see `film.develop`."""
        return self._spread(develop(self._known(), view, self.work))

    def _known(self) -> np.ndarray:
        """Mean of the sampled pixels, float32: after the first pass its grid, later the whole picture."""
        if self.passes != 1:
            return self._means(1)
        grid = self._means(COARSE)
        if not self.channels.reshape(-1, CHANNELS)[1:2, GOAL].any():
            return grid
        sampled = self.counts[..., None] > 0  # the second pass was interrupted
        return np.where(sampled, self._means(1), self._spread(grid))

    def _means(self, step: int) -> np.ndarray:
        sums = self.channels[::step, ::step]
        means = np.empty((*sums.shape[:2], 4), np.float32)

        def divided(rows: slice) -> None:
            means[rows] = sums[rows][..., (0, 1, 2, COVER)] / np.maximum(sums[rows, :, COUNT, None], 1)

        self.work.map(divided, chunks(len(sums), BAND))
        return means

    def _spread(self, known: np.ndarray) -> np.ndarray:
        """Expand the grid of the first pass to the whole picture."""
        if known.shape[:2] == (self.height, self.width):
            return known
        wide = known.repeat(COARSE, 0).repeat(COARSE, 1)
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

    def plan(self, most: int, tolerance: float) -> PassPlan:
        """Set the goals of the next pass; see `Accumulator.plan`."""
        plan = self._wanted()
        if not plan.samples and self.passes < 2:
            step = COARSE if self.passes == 0 else 1
            self.channels[::step, ::step, GOAL] = 1
            plan = self._wanted()
        if not plan.samples and self.counts.min() < most:
            self._judge(most, tolerance)
            plan = self._wanted()
        return plan

    def _judge(self, most: int, tolerance: float) -> None:
        """Set the goals of the unfinished pixels with the largest gain."""
        gains = np.empty((self.height, self.width))

        def judged(rows: slice) -> float:
            seen = slice(max(rows.start - 1, 0), rows.stop + 1)
            own = slice(rows.start - seen.start, rows.stop - seen.start)
            n, squares = self._errors(seen)
            trusted = np.where(n < TRUSTED, UNKNOWN, squares)
            unfinished = (n < most) & (around(trusted) > tolerance * tolerance)
            gains[rows] = np.where(unfinished, around(trusted / n), -1.0)[own]
            return float(gains[rows].max())

        def aimed(rows: slice) -> None:
            n = self.counts[rows]
            goals = np.minimum(np.ldexp(1.0, np.frexp(n)[1]), most)  # the next power of two
            self.channels[rows, :, GOAL] = np.where(gains[rows] >= least, goals, n)

        largest = max(self.work.collect(judged, self._bands()))
        if largest <= 0:
            return
        self.passes = next_choice(self.passes, largest)
        least = least_gain(self.passes)
        self.work.map(aimed, self._bands())

    def _wanted(self) -> PassPlan:
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
        return PassPlan(np.concatenate(pixels), int(sum(samples)), int(max(goals)))


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
    largest = rows.copy()
    np.maximum(largest[:, 1:], rows[:, :-1], out=largest[:, 1:])
    np.maximum(largest[:, :-1], rows[:, 1:], out=largest[:, :-1])
    return largest
