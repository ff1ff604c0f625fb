"""Pixels on the GPU, one thread a ray."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..kernel.cuda import launched, load_loops, parameters, require
from ..work import Work
from .cpu import BLOCK
from .cuda_loops import loops
from .linking import Frame
from .sobol import point


class CudaTracer:
    """Adds samples to pixels, with the face of `CpuTracer`. Raises `KernelError` if there is no GPU."""

    def __init__(self, frame: Frame, dtype: np.dtype, width: int, height: int) -> None:
        self._cuda = require()
        self.dtype, self.width, self.height = dtype, width, height
        self._precision: Any = dtype.name
        self._loops = load_loops(frame.linked, self._precision, loops(frame, BLOCK))
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
        q = self._cuda.to_device(np.asarray(point(index, self.frame.samples), np.int32))
        given = (
            self._parameters,
            q,
            self._starts,
            pixels,
            sums,
            self.width,
            self.dtype.type(limit),
            self.blocks,
        )
        launched(self._loops.tile, pixels.size, *given)
