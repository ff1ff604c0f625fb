"""CPU tracer: tiles of pixels on SIMD lanes and threads."""

from __future__ import annotations

import threading

import numpy as np

from ..errors import Cancelled
from ..expr.host import lane_count
from ..expr.machine import constant
from ..fields.cpu import load_functions
from ..work import Work, chunks
from .accumulator import PassPlan
from .linking import Frame
from .packets import Lane, loops, workspace
from .sequence import SampleRange

TILE = 2048
"""Maximum rays per tile; their workspace stays in the cache."""
LEAST, TILES, RAYS = 128, 8, 1 << 14
"""Minimum pixels or cones per tile, tiles per thread for few of them, and maximum rays per tile."""
STEPS = {"float32": 1600, "float64": 10_000}
"""Maximum steps of a ray, which then hits. At the magnification that needs float64, one in ten takes more
than 1600; in float32 those that do creep along a surface, and a packet waits for them.
"""
BLOCK = 4
"""Side of a block of the first cone prepass, pixels. A frame takes 7 % less time with 4 than with 8."""
SHIFTS = (BLOCK.bit_length() - 1, 0)
"""Binary logarithms of the sides of the blocks of each prepass: of one pixel in the second one, which pays
where pixels get several samples.
"""
WHOLE = 16
"""Binary logarithm of the side of a block that contains any picture."""


class CpuTracer:
    """Tracer that adds samples to pixels, tile by tile, on all threads of the work.

    `dtype`: float32 or float64; `width`, `height` in pixels.
    """

    prepasses = len(SHIFTS)
    """Cone prepasses, coarse to fine."""

    def __init__(self, frame: Frame, dtype: np.dtype, width: int, height: int) -> None:
        self.dtype, self.width, self.height = dtype, width, height
        self.steps = STEPS[dtype.name]
        bits = dtype.itemsize * 8
        self.lanes = lane_count(bits)
        functions = load_functions(frame.linked.program, bits, self.lanes, loops(frame))
        self._tile, self._cones = functions["tile"], functions.get("cones")
        self._own = threading.local()
        self.samples, self._points = SampleRange(), np.empty((0, frame.samples), np.int32)
        self.aim(frame)

    def aim(self, frame: Frame) -> None:
        """Load the parameters of another frame of the same source, such as another camera or depth."""
        self.frame = frame
        self._parameters = constant(frame.linked.parameters, self.dtype, frame.linked.held)
        self._shift, self._blocks, self._starts = WHOLE, 1, np.zeros(1, self.dtype)

    def look_ahead(self, work: Work) -> None:
        """Cone prepass: compute the distance up to which all rays of each block are free.

        The first prepass after `aim` is that of the coarsest blocks. Each later one starts where the one
        before ended.
        """
        cones = self._cones
        if cones is None:
            return
        shift = next(s for s in SHIFTS if s < self._shift)
        blocks, rows = (-(-pixels // (1 << shift)) for pixels in (self.width, self.height))
        starts, coarser = np.zeros(blocks * rows, self.dtype), (self._shift - shift, self._blocks)

        def task(part: slice) -> None:
            arrays = self._parameters, starts, self._starts, *self._workspace
            cones(*arrays, part.start, part.stop - part.start, shift, blocks, *coarser, self.steps)

        work.map(task, chunks(len(starts), _tile(len(starts), work.threads)))
        self._shift, self._blocks, self._starts = shift, blocks, starts

    def add(self, sums: np.ndarray, plan: PassPlan, work: Work) -> None:
        """Add samples to pixels up to their goals; a pixel with k samples takes point k of the sequence.

        Sums are valid at any time: those of a tile are added at once.

        `sums`: ndarray (height * width * CHANNELS,).
        """
        if len(self._points) < plan.last:
            self._points = self.samples.points(2 * plan.last, self.frame.samples)

        def task(part: slice) -> None:
            pixels = plan.pixels[part].copy()
            arrays = self._parameters, self._points, self._starts, *self._workspace, pixels, sums
            self._tile(*arrays, len(pixels), self.width, self.steps, self._shift, self._blocks)
            done.append(part)

        tile = min(_tile(len(plan.pixels), work.threads), max(RAYS // plan.last, LEAST))
        parts, done = chunks(len(plan.pixels), tile), list[slice]()
        try:
            work.map(task, parts)
        except Cancelled:
            if len(done) < len(parts):  # a whole pass counts, or the next one would choose other pixels
                raise

    @property
    def _workspace(self) -> tuple[np.ndarray, ...]:
        """This thread's arrays W, L and rays (see `packets`)."""
        if not hasattr(self._own, "space"):
            sizes = workspace(self.frame, TILE), len(Lane) * self.lanes
            rows, lanes = (np.zeros(size, self.dtype) for size in sizes)
            self._own.space = rows, lanes, np.zeros(self.lanes, np.int32)
        space: tuple[np.ndarray, ...] = self._own.space
        return space


def _tile(count: int, threads: int) -> int:
    """Pixels or cones per tile, of `count`."""
    share = -(-count // (TILES * threads)) if threads > 1 else TILE
    return min(max(share, LEAST), TILE)
