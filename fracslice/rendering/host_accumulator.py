"""Accumulator in host memory."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np

from ..kernel.cpu import load_functions
from ..kernel.host import lane_count
from ..kernel.linker import Linked
from ..kernel.machine import Function
from ..scene.view import View
from ..work import Work, chunks
from .accumulator import (
    CHANNELS,
    COARSE,
    COUNT,
    COVER,
    GOAL,
    PassPlan,
    band_order,
    grids,
    least_gain,
    next_choice,
)
from .accumulator_loops import LOOPS
from .film import BAND, develop, levels


@lru_cache
def _loops(dtype: np.dtype) -> dict[str, Function]:
    """Compiled loops of a float type."""
    bits = dtype.itemsize * 8
    return load_functions(Linked("", np.zeros(1)), bits, lane_count(bits), LOOPS)


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
            the mean of the smallest block around them that has some.
        """
        return self._spread(self._known())

    def shown(self, view: View) -> np.ndarray:
        """Develop the picture; see `Accumulator.shown`."""
        return self._spread(levels(develop(self._known(), view, self.work)))

    def developed(self, view: View) -> np.ndarray:
        """Develop the picture to floats; see `film.develop`."""
        return self._spread(develop(self._known(), view, self.work))

    def _known(self) -> np.ndarray:
        """Mean of the pixels, float32: between passes over grids that of the finer grid's pixels."""
        spacings = grids(self.width, self.height)
        if 0 < self.passes < len(spacings):
            step, finer = spacings[self.passes - 1 : self.passes + 1]
            if not self.channels[: finer + 1 : finer, : finer + 1 : finer, GOAL].all():
                return self._means(step)
        return fill_gaps(self._means(1), self.counts > 0, self.work)

    def _means(self, step: int) -> np.ndarray:
        sums = self.channels[::step, ::step]
        means = np.empty((*sums.shape[:2], 4), np.float32)

        def divided(rows: slice) -> None:
            means[rows] = sums[rows][..., (0, 1, 2, COVER)] / np.maximum(sums[rows, :, COUNT, None], 1)

        self.work.map(divided, chunks(len(sums), BAND))
        return means

    def _spread(self, known: np.ndarray) -> np.ndarray:
        """Expand the pixels of a grid to the whole picture."""
        if known.shape[:2] == (self.height, self.width):
            return known
        step = grids(self.width, self.height)[self.passes - 1]
        wide = known.repeat(step, 0).repeat(step, 1)
        return np.ascontiguousarray(wide[: self.height, : self.width])

    def _banded(self, task: Callable[[int, int, np.ndarray], None]) -> np.ndarray:
        """Run a task on every band, given its first row and rows, and return the sums of each."""
        bands = chunks(self.height, BAND)
        sums = np.zeros((len(bands), 4), self.sums.dtype)

        def run(band: int) -> None:
            task(bands[band].start, bands[band].stop - bands[band].start, sums[band])

        self.work.map(run, range(len(bands)))
        return sums.astype(np.float64)

    def _measure(self, first: int, rows: int, result: np.ndarray) -> tuple[np.ndarray, int]:
        """Planes of `accumulator_loops.measure` of a band, and numbers per row; its sums go to `result`."""
        real = self.sums.dtype
        lanes, none = lane_count(8 * real.itemsize), np.zeros(1, real)
        stride = -(-self.width // lanes) * lanes + max(lanes, 2)
        planes = np.zeros((3, (rows + 2) * stride + lanes), real)
        numbers = first, rows, self.width, self.height, stride
        _loops(real)["measure"](none, self.sums, *planes, result, *numbers)
        return planes, stride

    def _totals(self) -> np.ndarray:
        """The sums of `accumulator_loops.measure` over the picture."""

        def measured(first: int, rows: int, result: np.ndarray) -> None:
            self._measure(first, rows, result)

        return np.asarray(self._banded(measured).sum(0))

    def statistics(self) -> tuple[float, float]:
        """Return the statistics of the picture; see `Accumulator.statistics`."""
        total, known, samples, _ = self._totals()
        return float(samples) / (self.width * self.height), float(np.sqrt(total / known)) if known else np.inf

    def plan(self, most: int, tolerance: float) -> PassPlan:
        """Set the goals of the next pass; see `Accumulator.plan`."""
        *_, left = self._totals()
        if left:
            return self._unfinished()
        if self.passes < len(spacings := grids(self.width, self.height)):
            step = spacings[self.passes]
            goals = self.channels[::step, ::step, GOAL]
            np.maximum(goals, 1, out=goals)
            if (plan := self._unfinished()).samples:
                return plan
        self._judge(most, tolerance)
        return self._unfinished()

    def _judge(self, most: int, tolerance: float) -> None:
        """Set the goals of the unfinished pixels with the largest gain."""
        loops, real, pixels = _loops(self.sums.dtype), self.sums.dtype, self.width * self.height
        limit, gains = np.array([tolerance * tolerance], real), np.empty(pixels, real)

        def judged(first: int, rows: int, result: np.ndarray) -> None:
            planes, stride = self._measure(first, rows, result)
            loops["judge"](limit, *planes, gains, result, first, rows, self.width, stride, most)

        def chosen(first: int, rows: int, _: np.ndarray) -> None:
            loops["choose"](least, self.sums, gains, first, rows, self.width, most)

        largest = float(self._banded(judged)[:, 0].max())
        if largest <= 0:
            return
        grid_passes = len(grids(self.width, self.height))
        self.passes = grid_passes + next_choice(self.passes - grid_passes, largest)
        least = np.array([least_gain(self.passes - grid_passes)], real)
        self._banded(chosen)

    def _unfinished(self) -> PassPlan:
        """Pixels that have not reached their goals."""
        unfinished, none = _loops(self.sums.dtype)["unfinished"], np.zeros(1, self.sums.dtype)
        order, _ = band_order(self.width)
        pixels = np.empty((-(-self.height // BAND), len(order)), np.int32)

        def listed(first: int, rows: int, result: np.ndarray) -> None:
            numbers = first, rows, self.width, len(order)
            left = np.empty((rows + 1) * self.width, self.sums.dtype)
            unfinished(none, self.sums, order, pixels[first // BAND], left, result, *numbers)

        sums = self._banded(listed)
        rows = [row[: int(n)] for row, n in zip(pixels, sums[:, 2], strict=True)]
        return PassPlan(np.concatenate(rows), int(sums[:, 0].sum()), int(sums[:, 1].max()))


def fill_gaps(mean: np.ndarray, known: np.ndarray, work: Work) -> np.ndarray:
    """Give each pixel without samples the mean of the smallest block around it that has some.

    `mean`: float32 (height, width, 4), mean of the samples of a pixel; `known`: bool (height, width), true
    for a pixel with samples. Returns float32 (height, width, 4).
    """
    if known.all() or not known.any():
        return mean
    count = _blocks(known.astype(np.float32))
    means = fill_gaps(_blocks(mean) / np.maximum(count, 1)[..., None], count > 0, work)

    def spread(rows: slice) -> None:
        part = means[rows.start // COARSE : -(-rows.stop // COARSE)].repeat(COARSE, 0).repeat(COARSE, 1)
        near = part[: rows.stop - rows.start, : mean.shape[1]]
        np.copyto(mean[rows], near, where=~known[rows, :, None])

    work.map(spread, chunks(len(mean), BAND))
    return mean


def _blocks(values: np.ndarray) -> np.ndarray:
    """Sums over blocks."""
    rows, columns = (np.arange(0, n, COARSE) for n in values.shape[:2])
    return np.asarray(np.add.reduceat(np.add.reduceat(values, columns, 1), rows, 0))
