"""Pixels on the GPU, one thread a ray."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..kernel.cpu import Precision
from ..kernel.cuda import launched, load_loops, parameters, require
from ..work import Work
from .cpu import BLOCK
from .cuda_loops import loops
from .linking import Frame
from .sobol import point

AHEAD = 64
"""Sobol points that are sent to the GPU at once."""


class CudaTracer:
    """Adds samples to pixels, with the face of `CpuTracer`. Raises `KernelError` if there is no GPU."""

    def __init__(self, frame: Frame, dtype: np.dtype, width: int, height: int) -> None:
        self._cuda = require()
        self.dtype, self.width, self.height = dtype, width, height
        self._precision: Precision = "float32" if dtype == np.float32 else "float64"
        self._loops = load_loops(frame.linked, self._precision, loops(frame, BLOCK))
        self.aim(frame)

    def aim(self, frame: Frame) -> None:
        """Takes the numbers of another frame of the same source: another camera, another depth."""
        self.frame, self._first = frame, -1
        self._parameters = parameters(frame.linked, self._precision)
        self.blocks = -(-self.width // BLOCK)
        self._starts = self._cuda.to_device(np.zeros(self.blocks * -(-self.height // BLOCK), self.dtype))

    def look_ahead(self, limit: int, work: Work) -> None:
        """Finds, for every block of pixels, up to where all its rays are free."""
        if self.frame.sharp:
            given = (self._parameters, self._starts, self.blocks, self.dtype.type(limit))
            launched(self._loops.cones, self._starts.size, *given)

    def add(self, sums: np.ndarray, pixels: np.ndarray, index: int, limit: int, work: Work) -> None:
        """Adds sample `index` to each of the pixels.

        sums: [height * width, 6], changed in place. pixels: int32 ``y << 16 | x``, each once.
        """
        work.check()
        placed = self._cuda.to_device(sums)
        self.add_on_device(placed, self._cuda.to_device(pixels), index, limit)
        placed.copy_to_host(sums)

    def add_on_device(self, sums: Any, pixels: Any, index: int, limit: int) -> None:
        """`add` on arrays of the GPU. Copies neither and does not wait for the GPU."""
        first = index - index % AHEAD
        if first != self._first:
            points = np.array([point(i, self.frame.samples) for i in range(first, first + AHEAD)])
            self._first, self._points = first, self._cuda.to_device(points)
        film = (pixels, sums, self.width, self.dtype.type(limit), self.blocks)
        sample = (self._points, index - first, self._starts)
        launched(self._loops.tile, pixels.size, self._parameters, *sample, *film)
