"""CUDA tracer: one thread per ray."""

from __future__ import annotations

import math
from copy import copy
from typing import Any

import numpy as np

from ..expr.cuda_driver import device_array, require, to_device
from ..expr.graph import NOTHING
from ..fields.cuda import load_functions, parameters
from ..fields.field import Precision
from ..scene.view import View
from ..work import Work
from .accumulator import TRUSTED, PassPlan, grids, least_gain, next_choice, tile_order
from .cpu import BLOCK, SHIFTS, STEPS, WHOLE
from .cuda_loops import LOOPS
from .film import shows_background
from .host_accumulator import HostAccumulator
from .linking import Frame
from .packets import loops
from .sequence import SampleRange
from .units.pixel import linear


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
