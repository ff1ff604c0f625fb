"""Pixels on the GPU, one thread a ray."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..formulas.field import Precision
from ..kernel.cuda import launched, load_loops, parameters, require
from ..work import Work
from .cpu import BLOCK
from .cuda_loops import loops
from .linking import Frame
from .sequence import points


class CudaTracer:
    """Adds samples to pixels, with the face of `CpuTracer`. Raises `KernelError` if there is no GPU."""

    def __init__(self, frame: Frame, dtype: np.dtype, width: int, height: int) -> None:
        self._cuda = require()
        self.dtype, self.width, self.height = dtype, width, height
        self._precision: Precision = "float32" if dtype == np.float32 else "float64"
        self._loops = load_loops(frame.linked, self._precision, loops(frame))
        self._points = np.empty((0, frame.samples), np.int32)
        self.aim(frame)

    def aim(self, frame: Frame) -> None:
        """Takes the numbers of another frame of the same source: another camera, another depth."""
        self.frame = frame
        self._parameters = parameters(frame.linked, self._precision)
        self.blocks = -(-self.width // BLOCK)
        self._starts = self._cuda.to_device(np.zeros(self.blocks * -(-self.height // BLOCK), self.dtype))

    def look_ahead(self, limit: int, work: Work) -> None:
        """Finds, for every block of pixels, up to where all its rays are free."""
        if self.frame.sharp:
            given = (self._parameters, self._starts, self.blocks, self.dtype.type(limit))
            launched(self._loops.cones, self._starts.size, *given)

    def add(self, sums: Any, pixels: Any, most: int, limit: int, work: Work) -> None:
        """Adds to each of the pixels its next sample: the one whose index is how many it has.

        sums: [height * width, 6] and pixels: int32 ``y << 16 | x``, each once, those below zero left out;
        on the GPU. No pixel has more than `most` samples. Copies nothing back and does not wait for the
        GPU.
        """
        work.check()
        if len(self._points) <= most:
            self._points = self._cuda.to_device(points(2 * most + 64, self.frame.samples))
        film = (pixels, sums, self.width, self.dtype.type(limit), self.blocks)
        launched(self._loops.tile, pixels.size, self._parameters, self._points, self._starts, *film)
