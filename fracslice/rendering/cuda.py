"""CUDA tracer: one thread per ray, and the accumulator in GPU memory.

A holds the sums of the picture, CHANNELS per pixel. T holds partial sums, three per thread; thread b handles
every pixel whose index is b modulo the number of threads, so that the sums are deterministic. `n` is the
number of pixels, `width` that of the picture, pixels.
"""

from __future__ import annotations

import math
from copy import copy
from typing import Any

import numpy as np

from ..expr.cuda_driver import device_array, require, to_device
from ..expr.graph import NOTHING
from ..expr.loops import loop, shares
from ..expr.vocabulary import maximum, minimum
from ..fields.cuda import load_functions, parameters
from ..fields.field import Precision
from ..scene.view import View
from ..work import Work
from .accumulator import (
    CHANNELS,
    COUNT,
    COVER,
    GOAL,
    TRUSTED,
    HostAccumulator,
    PassPlan,
    SampleRange,
    grids,
    least_gain,
    next_choice,
    shows_background,
    tile_order,
)
from .linking import Frame
from .packets import BLOCK, SHIFTS, STEPS, WHOLE, loops
from .units.camera import UNKNOWN, encoded, filmic, linear, reinhard, squared_error


@loop("rn")
def empty(A, n):
    """Set n sums to zero."""
    for k in shares(n, 1):
        A[k] = 0.0


@loop("rrnnnn")
def grid(A, T, n, threads, width, step):
    """Set the goals of a grid of pixels, `step` apart, to one sample."""
    for b in shares(threads, 1):
        left = 0.0
        last = 0.0
        for k in range(b, n, threads):
            a = k * CHANNELS
            if k // width % step == 0 and k % width % step == 0:
                A[a + GOAL] = maximum(A[a + GOAL], 1.0)
            left += A[a + GOAL] - A[a + COUNT]
            last = maximum(last, A[a + GOAL])
        T[3 * b] = left
        T[3 * b + 1] = last


@loop("rrrnn")
def measure(A, E, T, n, threads):
    """Compute the squared standard error of each pixel.

    `E`: [n]; `T`: written: pixels with a known error.
    """
    for b in shares(threads, 1):
        total = 0.0
        known = 0.0
        samples = 0.0
        for k in range(b, n, threads):
            a = k * CHANNELS
            count = A[a + COUNT]
            E[k] = squared_error(A[a + 3], A[a + 4], count)
            samples += count
            if count >= 2.0:
                total += E[k]
                known += 1.0
        T[3 * b] = total
        T[3 * b + 1] = known
        T[3 * b + 2] = samples


@loop("rrrrnnnxxx")
def judge(A, E, G, T, n, threads, width, trusted, most, tolerance):
    """Compute the gain of one more sample in each pixel.

    `E`: [n]; `G`: [n], written: -1 for a finished pixel; `T`: written: largest gain of an unfinished pixel;
    `most`: maximum samples per pixel; `tolerance`: squared error at which a pixel has converged.
    """
    for b in shares(threads, 1):
        largest = 0.0
        height = n // width
        for k in range(b, n, threads):
            row = k // width
            column = k % width
            worst = 0.0
            gain = 0.0
            for y in range(max(row - 1, 0), min(row + 2, height)):
                for x in range(max(column - 1, 0), min(column + 2, width)):
                    near = y * width + x
                    count = A[near * CHANNELS + COUNT]
                    square = E[near] if count >= trusted else UNKNOWN
                    worst = maximum(worst, square)
                    gain = maximum(gain, square / count)
            G[k] = -1.0
            if A[k * CHANNELS + COUNT] < most and worst > tolerance:
                largest = maximum(largest, gain)
                G[k] = gain
        T[3 * b] = largest


@loop("rrrnnxx")
def choose(A, G, T, n, threads, most, least):
    """Set the goals of the pixels whose gain is at least `least`.

    `G`: [n]; `most`: maximum samples per pixel.
    """
    for b in shares(threads, 1):
        left = 0.0
        last = 0.0
        for k in range(b, n, threads):
            a = k * CHANNELS
            count = A[a + COUNT]
            goal = count
            if G[k] >= least:
                goal = 1.0
                while goal <= count:
                    goal = goal + goal
                goal = minimum(goal, most)
            A[a + GOAL] = goal
            left += goal - count
            last = maximum(last, goal)
        T[3 * b] = left
        T[3 * b + 1] = last


@loop("rbnnnxxxxn")
def show(A, out, n, width, coarse, exposure, red, green, blue, tone):
    """Develop the picture as `film.develop` does, without bloom.

    `out`: sRGB, [3 n]; `coarse`: grid spacing of the sampled pixels, each of which is repeated over its cell;
    `exposure`: factor on the light; `red`, `green`, `blue`: colour behind the picture, linear; `tone`: 0
    none, 1 filmic, 2 Reinhard.
    """
    for k in shares(n, 1):
        row = k // width
        column = k % width
        a = CHANNELS * ((row - row % coarse) * width + column - column % coarse)
        count = maximum(A[a + COUNT], 1.0)
        clear = 1.0 - A[a + COVER] / count
        r = exposure * maximum(A[a] / count - clear * red, 0.0)
        g = exposure * maximum(A[a + 1] / count - clear * green, 0.0)
        b = exposure * maximum(A[a + 2] / count - clear * blue, 0.0)
        if tone == 2:
            dim = reinhard(r, g, b)
            r, g, b = r * dim, g * dim, b * dim
        if tone == 1:
            r, g, b = filmic(r), filmic(g), filmic(b)
        out[3 * k] = level(encoded(r + clear * red))
        out[3 * k + 1] = level(encoded(g + clear * green))
        out[3 * k + 2] = level(encoded(b + clear * blue))


def level(c):
    """Quantise to 8 bits.

    `c`: clipped to [0, 1].
    """
    return int(minimum(maximum(c, 0.0), 1.0) * 255.0 + 0.5)


LOOPS = empty, grid, measure, judge, choose, show


class CudaTracer:
    """Tracer on the GPU, with the interface of `CpuTracer`.

    `dtype`: float32 or float64; `width`, `height` in pixels.
    """

    prepasses = 1
    """Cone prepasses."""

    def __init__(self, frame: Frame, dtype: np.dtype, width: int, height: int) -> None:
        self.dtype, self.width, self.height = dtype, width, height
        self._precision: Precision = "float32" if dtype == np.float32 else "float64"
        functions = load_functions(frame.linked.program, self._precision, loops(frame))
        self._tile, self._cones = functions["tile"], functions.get("cones")
        self._start = to_device(np.zeros(1, dtype))
        self.samples = SampleRange()
        self._points = device_array((0, frame.samples), np.int32)
        self.aim(frame)

    def aim(self, frame: Frame) -> None:
        """Load the parameters of another frame; see `CpuTracer.aim`."""
        self.frame = frame
        self._parameters = parameters(frame.linked, self._precision)
        self.blocks = -(-self.width // BLOCK)
        self._starts = to_device(np.zeros(self.blocks * -(-self.height // BLOCK), self.dtype))

    def look_ahead(self, work: Work) -> None:
        """Run the cone prepass; see `CpuTracer.look_ahead`."""
        if self._cones is not None:
            n, coarser = self._starts.size, (WHOLE, 1)
            given = (0, n, SHIFTS[0], self.blocks, *coarser, STEPS[self.dtype.name])
            self._cones.launch(n, self._parameters, self._starts, self._start, *given)

    def add(self, sums: Any, plan: PassPlan, work: Work) -> None:
        """Add samples without waiting for the GPU; see `CpuTracer.add`."""
        if len(self._points) < plan.last:
            drawn = self.samples.points(2 * plan.last, self.frame.samples)
            self._points = to_device(drawn)
        n, limit = plan.pixels.size, STEPS[self.dtype.name]
        arrays = self._parameters, self._points, self._starts, plan.pixels, sums
        for _ in range((plan.last + 1) // 2):  # a goal is at most twice a count
            work.check()
            self._tile.launch(n, *arrays, n, self.width, limit, SHIFTS[0], self.blocks)


PARTS = 8192
"""Threads that sum over a picture, each over every 8192nd pixel, so that sums are deterministic."""
GONE = -1
"""Pass count of an accumulator whose memory has been handed over."""
TONES = {"none": 0, "filmic": 1, "reinhard": 2}


class CudaAccumulator:
    """Picture in progress in GPU memory, with the interface of `HostAccumulator`."""

    def __init__(self, start: HostAccumulator) -> None:
        require()
        self.width, self.height = start.width, start.height
        self.passes = start.passes
        self.dtype, pixels = start.sums.dtype, start.width * start.height
        precision: Precision = "float32" if self.dtype == np.float32 else "float64"
        self._loops = load_functions(NOTHING, precision, LOOPS)
        self.sums = to_device(start.sums)
        self._order = to_device(tile_order(self.width, self.height))
        self._squares, self._gains = (device_array(pixels, self.dtype) for _ in range(2))
        self._parts = device_array((min(PARTS, pixels), 3), self.dtype)
        self._shown = device_array((pixels, 3), np.uint8)

    def anew(self) -> CudaAccumulator:
        """Return an empty accumulator in the same memory; this one becomes invalid."""
        fresh = copy(self)
        fresh.passes, self.passes = 0, GONE
        self._loops["empty"].launch(self.sums.size, self.sums, self.sums.size)
        return fresh

    def host(self) -> HostAccumulator:
        """Return a copy in host memory; see `Accumulator.host`."""
        return HostAccumulator(self.width, self.height, self.sums.copy_to_host(), self.passes)

    def _summed(self, name: str, *arrays: Any, numbers: tuple[float, ...] = ()) -> np.ndarray:
        """Run a loop over the picture and return its partial sums, float64 [threads, 3]."""
        pixels, threads = self.width * self.height, len(self._parts)
        self._loops[name].launch(threads, self.sums, *arrays, self._parts, pixels, threads, *numbers)
        return np.asarray(self._parts.copy_to_host(), np.float64)

    def statistics(self) -> tuple[float, float]:
        """Return the statistics of the picture; see `Accumulator.statistics`."""
        total, known, samples = self._summed("measure", self._squares).sum(0)
        return samples / (self.width * self.height), math.sqrt(total / known) if known else math.inf

    def plan(self, most: int, tolerance: float) -> PassPlan:
        """Set the goals of the next pass; see `Accumulator.plan`."""
        spacings = grids(self.width, self.height)
        if self.passes < len(spacings):
            plan = self._plan("grid", numbers=(self.width, spacings[self.passes]))
            if plan.samples:
                return plan
        self.statistics()
        limits = (self.width, TRUSTED, most, tolerance * tolerance)
        largest = self._summed("judge", self._squares, self._gains, numbers=limits)[:, 0].max()
        if largest > 0:
            self.passes = len(spacings) + next_choice(self.passes - len(spacings), largest)
        least = least_gain(self.passes - len(spacings))
        return self._plan("choose", self._gains, numbers=(most, least))

    def _plan(self, name: str, *arrays: Any, numbers: tuple[float, ...]) -> PassPlan:
        """Run a loop that sets goals. All pixels are passed on: a thread skips those at their goals."""
        left, last, _ = self._summed(name, *arrays, numbers=numbers).T
        return PassPlan(self._order, int(left.sum()), int(last.max()))

    def shown(self, view: View) -> np.ndarray:
        """Develop the picture, on the host if it has bloom or no light; see `Accumulator.shown`."""
        film = view.film
        if film.bloom or film.transparent or view.shading.mode != "light":
            return self.host().shown(view)
        spacings = grids(self.width, self.height)
        coarse = spacings[self.passes - 1] if 0 < self.passes < len(spacings) else 1
        behind = linear(film.background) if shows_background(view) else (0, 0, 0)
        pixels, given = len(self._shown), (2.0**film.exposure, *behind, TONES[film.tone])
        self._loops["show"].launch(pixels, self.sums, self._shown, pixels, self.width, coarse, *given)
        return self._shown.copy_to_host().reshape(self.height, self.width, 3)
