"""Tiles of pixels on the CPU's lanes."""

from __future__ import annotations

import threading
from functools import lru_cache

import numpy as np

from ..kernel.cpu import load_functions
from ..kernel.host import lane_count
from ..kernel.machine import constant
from ..work import Work
from .linking import Frame
from .packets import Lane, loops, workspace
from .sequence import points

TILE = 2048
"""Rays that are in the works at once: their rows stay in the cache."""
BLOCK = 4
"""Pixels along the side of a block that the cone prepass looks at as one. A frame takes 7 % less with 4 than
with 8."""


class CpuTracer:
    """Adds samples to pixels, tile by tile, on as many threads as the work has."""

    def __init__(self, frame: Frame, dtype: np.dtype, width: int, height: int) -> None:
        self.dtype, self.width, self.height = dtype, width, height
        bits = dtype.itemsize * 8
        self.lanes = lane_count(bits)
        functions = load_functions(frame.linked, bits, self.lanes, loops(frame))
        self._tile, self._cones = functions["tile"], functions.get("cones")
        self._own = threading.local()
        self._points = np.empty((0, frame.samples), np.int32)
        self.aim(frame)

    def aim(self, frame: Frame) -> None:
        """Takes the numbers of another frame of the same source: another camera, another depth."""
        self.frame = frame
        self._parameters = constant(frame.linked.parameters, self.dtype)
        self.blocks = -(-self.width // BLOCK)
        self._starts = np.zeros(self.blocks * -(-self.height // BLOCK), self.dtype)

    def look_ahead(self, limit: int, work: Work) -> None:
        """Finds, for every block of pixels, up to where all its rays are free."""
        cones = self._cones
        if cones is None:
            return
        ids = np.arange(len(self._starts), dtype=np.int32)

        def task(part: np.ndarray) -> None:
            m, space = self._room(len(part))
            cones(self._parameters, self._starts, part, *space, len(part), m, self.blocks, limit)

        work.map(task, np.array_split(ids, max(1, len(ids) // 512)))

    def add(self, sums: np.ndarray, pixels: np.ndarray, most: int, limit: int, work: Work) -> None:
        """Adds to each of the pixels its next sample: the one whose index is how many it has.

        sums: [height * width, 6], changed in place. pixels: int32 ``y << 16 | x``, each once, in the order of
        `ordered`; none has more than `most` samples.
        """
        if len(self._points) <= most:
            self._points = points(2 * most + 64, self.frame.samples)

        def task(part: np.ndarray) -> None:
            m, space = self._room(len(part))
            arrays = self._parameters, self._points, self._starts, *space, part, sums
            self._tile(*arrays, len(part), m, self.width, limit, self.blocks)

        work.map(task, [pixels[i : i + TILE] for i in range(0, len(pixels), TILE)])

    def _room(self, rays: int) -> tuple[int, tuple[np.ndarray, ...]]:
        """The row length for so many rays, and the thread's own W, L and rays (see `packets`)."""
        if not hasattr(self._own, "space"):
            sizes = workspace(self.frame, TILE), len(Lane) * self.lanes
            rows, lanes = (np.zeros(size, self.dtype) for size in sizes)
            self._own.space = rows, lanes, np.zeros(self.lanes, np.int32)
        return -(-rays // self.lanes) * self.lanes, self._own.space


@lru_cache(maxsize=4)
def ordered(width: int, height: int) -> np.ndarray:
    """All pixels, int32 ``y << 16 | x``, so that a packet's are neighbours: rows of blocks, in a block 8 x 4
    pixels. Read-only."""
    y, x = np.divmod(np.arange(width * height, dtype=np.int32), np.int32(width))
    pixels = (y << 16 | x)[np.lexsort((x, y, x // 8, y // 4, x // 64, y // 32))]
    pixels.setflags(write=False)
    return pixels
