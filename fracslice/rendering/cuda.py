"""CUDA tracer: one thread per ray."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..formulas.field import Precision
from ..kernel.cuda_driver import require
from ..kernel.cuda_launching import launch, load_loops, parameters
from ..work import Work
from .accumulator import PassPlan
from .cpu import BLOCK, STEPS
from .cuda_loops import loops
from .linking import Frame
from .sequence import SampleRange


class CudaTracer:
    """Tracer on the GPU, with the interface of `CpuTracer`.

    `dtype`: float32 or float64; `width`, `height` in pixels.
    """

    prepasses = 1
    """Cone prepasses."""

    def __init__(self, frame: Frame, dtype: np.dtype, width: int, height: int) -> None:
        self._cuda = require()
        self.dtype, self.width, self.height = dtype, width, height
        self._precision: Precision = "float32" if dtype == np.float32 else "float64"
        self._loops = load_loops(frame.linked, self._precision, loops(frame))
        self.samples, self._points = SampleRange(), np.empty((0, frame.samples), np.int32)
        self.aim(frame)

    def aim(self, frame: Frame) -> None:
        """Load the parameters of another frame; see `CpuTracer.aim`."""
        self.frame = frame
        self._parameters = parameters(frame.linked, self._precision)
        self.blocks = -(-self.width // BLOCK)
        self._starts = self._cuda.to_device(np.zeros(self.blocks * -(-self.height // BLOCK), self.dtype))

    def look_ahead(self, work: Work) -> None:
        """Run the cone prepass; see `CpuTracer.look_ahead`."""
        if self.frame.sharp:
            given = (self._parameters, self._starts, self.blocks, self.dtype.type(STEPS[self.dtype.name]))
            launch(self._loops.cones, self._starts.size, *given)

    def add(self, sums: Any, plan: PassPlan, work: Work) -> None:
        """Add samples without waiting for the GPU; see `CpuTracer.add`."""
        if len(self._points) < plan.last:
            drawn = self.samples.points(2 * plan.last, self.frame.samples)
            self._points = self._cuda.to_device(drawn)
        film = (plan.pixels, sums, self.width, self.dtype.type(STEPS[self.dtype.name]), self.blocks)
        for _ in range((plan.last + 1) // 2):  # a goal is at most twice a count
            work.check()
            launch(self._loops.tile, plan.pixels.size, self._parameters, self._points, self._starts, *film)
