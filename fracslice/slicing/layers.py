"""Layers one after the other: computed in parallel, slab by slab, handed out in order, and let go."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import cached_property
from itertools import groupby
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from .._slices import Slab
from ..kernel import Kernel
from ..work import Work
from .contours import Contours, contours
from .slab import Sampler
from .stack import Stack

if TYPE_CHECKING:
    from .runs import Runs

SLAB = 8
"""Layers that are computed together."""


T = TypeVar("T")


@dataclass(frozen=True)
class ScreenView:
    """How a screen shows a layer, its back up.

    shape: rows and columns of the picture. transposed: its rows run along the layer's y; backwards: its
    columns from right to left. at: row and column of the layer's first pixel on the screen as seen from
    above, the first row in front. levels: of the screen by coverage, 256 bytes, the first 0, the last 255.
    """

    shape: tuple[int, int]
    transposed: bool
    backwards: bool
    at: tuple[int, int]
    levels: bytes


@dataclass(eq=False)
class Layer:
    """One layer of a stack, before it is given a form: to be read before the next one is sampled.

    evaluations: of the field for this layer, about.
    """

    stack: Stack
    index: int
    evaluations: float
    slab: Slab
    place: int
    exact: Kernel

    @property
    def top(self) -> float:
        """The layer's upper face, mm above the object's lowest point."""
        return float(self.stack.tops[self.index])

    @property
    def height(self) -> float:
        """mm."""
        return float(self.stack.heights[self.index])

    def deflated(self, view: ScreenView) -> bytes:
        """What a PNG file holds of the layer as a screen shows it: rows, each after a byte 0, as a zlib
        stream.
        """
        data, area, cut = self.slab.picture(
            self.place, view.shape, view.transposed, view.backwards, view.at, self.stack.shape, view.levels
        )
        self._painted = area, cut
        return data

    @cached_property
    def coverage(self) -> np.ndarray:
        """How much of each pixel is inside, uint8 [ny, nx], 255 for wholly; row 0 is the front (lowest y).

        The area that the outline cuts from it: straight between where it crosses the pixel's sides, with a
        corner where it turns.
        """
        image = np.zeros(self.stack.shape, np.uint8)
        self._painted = self.slab.paint(self.place, image)
        return image

    @cached_property
    def runs(self) -> Runs:
        """Its solid pixels: those of which at least half is inside."""
        from .runs import Runs  # it needs Numba, and a job does not

        rows, runs, area, cut = self.slab.runs(self.place, self.stack.shape)
        self._painted = area, cut
        begin, end = np.ascontiguousarray(runs.T)
        return Runs(rows, begin, end, self.stack.shape[1])

    @cached_property
    def _painted(self) -> tuple[float, int]:
        return self.slab.paint(self.place, np.zeros(self.stack.shape, np.uint8))

    @property
    def area(self) -> float:
        """mm^2, of the coverage before it is rounded."""
        return self._painted[0] * self.stack.pixel[0] * self.stack.pixel[1]

    @property
    def boundary(self) -> int:
        """The number of pixels that the contour cuts."""
        return self._painted[1]

    @cached_property
    def contours(self) -> Contours:
        """Polygons, each crossing within 0.001 pixels of the zero set."""
        return contours(self.slab, self.place, float(self.stack.z[self.index]), self.stack, self.exact)


@dataclass(frozen=True, eq=False)
class Slicer:
    """Cuts a planned stack."""

    stack: Stack
    work: Work = field(default_factory=Work)

    def map(self, make: Callable[[Layer], T], layers: Sequence[int] | None = None) -> Iterator[T]:
        """``make(layer)`` of every layer, or of the chosen ones, which ascend.

        `make` runs in worker threads, and reads a layer while it is there; results do not depend on their
        number. At most a few slabs are held at a time. Raises `SliceError`, `Cancelled`, or what `make`
        raises.
        """
        root, shape = self.stack.root, self.stack.shape
        exact = root.kernel("cpu", "float64")
        lattice = shape[0] + 1, shape[1] + 1
        sampler = Sampler(root.kernel(), root, root.bounds, self.stack.frame, lattice)
        chosen = range(len(self.stack.z)) if layers is None else layers

        def slab(group: list[int]) -> list[T]:
            self.work.check()
            first = group[0] // SLAB * SLAB
            found, made = sampler.slab(self.stack.z[first : first + SLAB]), []
            for index in group:
                self.work.check()
                before = found.evaluations
                sampler.sample(found, index - first)
                spent = found.evaluations - before
                made.append(make(Layer(self.stack, index, spent, found, index - first, exact)))
            return made

        groups = [list(g) for _, g in groupby(chosen, lambda index: index // SLAB)]
        return self._in_order(slab, groups)

    def _in_order(self, slab: Callable[[list[int]], list[T]], groups: list[list[int]]) -> Iterator[T]:
        ahead: deque[Future[list[T]]] = deque()
        waiting = iter(groups)
        with ThreadPoolExecutor(self.work.threads) as pool:
            try:
                for done in range(len(groups)):
                    while len(ahead) <= self.work.threads and (group := next(waiting, None)):
                        ahead.append(pool.submit(slab, group))
                    made = ahead.popleft().result()
                    self.work.check()
                    yield from made
                    self.work.progress("slicing", (done + 1) / len(groups))
            except BaseException:
                for future in ahead:
                    future.cancel()
                raise
