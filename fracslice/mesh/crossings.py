"""Exact intersections of the surface with the grid's edges, and normals there.

A vertex moves only along its own grid edge, strictly between the edge's ends. Refinement therefore cannot
fold a mesh or make it self-intersect if its triangles stay in their cells.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from .._native import Cells, RootLoops
from ..background import ahead
from ..kernel import Field
from ..work import Work
from .roots import SURE, Roots

Point = tuple[float, float, float]
Memory = tuple[np.ndarray, np.ndarray]
"""Positions along the edges, float64 [n], and normals, float32 [3, n]."""


@dataclass(frozen=True, eq=False)
class Crossings:
    """Intersections of the surface with consecutive grid edges.

    Attributes
    ----------
    first
        Number of the first intersection.
    t
        Position along each grid edge, float64 [n].
    normals
        Outward unit normals, float32 [3, n].
    """

    first: int
    t: np.ndarray
    normals: np.ndarray


class Search(Protocol):
    """Search for intersections on numbered grid edges."""

    def memory(self, size: int) -> Memory:
        """Return memory for at least `size` intersections, which may be that of an earlier call."""

    def find(self, begin: int, end: int, t: np.ndarray, normals: np.ndarray) -> None:
        """Find intersections `begin` to `end` - 1.

        Parameters
        ----------
        begin, end
            Numbers between bricks.
        t, normals
            Receive the positions and the normals; rows are contiguous.
        """


class LaneSearch:
    """Search by native code.

    Parameters
    ----------
    root
        Field.
    fast, exact
        Its loops in float32 and float64.
    cells
        Grid cells with sign changes.
    origin, voxel
        First grid point and spacing, scene units.
    """

    def __init__(
        self, root: Field, fast: Roots, exact: Roots, cells: Cells, origin: Point, voxel: float
    ) -> None:
        loops = fast.native("find"), exact.native("find"), exact.native("polish")
        entry = root.kernel("cpu", "float64").entry
        self._loops = RootLoops(fast.width, fast.batch, *loops, entry, SURE)
        self._cells, self._placement = cells, (origin, voxel)
        self._memory: Memory = np.empty(0), np.empty((3, 0), np.float32)

    def memory(self, size: int) -> Memory:
        """See `Search.memory`."""
        if size > len(self._memory[0]):
            self._memory = np.empty(size), np.empty((3, size), np.float32)
        return self._memory

    def find(self, begin: int, end: int, t: np.ndarray, normals: np.ndarray) -> None:
        """See `Search.find`."""
        self._cells.find_crossings(begin, end, *self._placement, self._loops, t, normals)


class Refiner:
    """Root finder on grid edges whose ends have opposite signs, for the float64 field.

    The float32 kernel brackets each root and the float64 kernel refines it; the float64 kernel starts from
    its own signs where the float32 kernel was wrong. If the float64 field has no sign change (at one end it
    is smaller than float32 resolves) t is that end.

    Parameters
    ----------
    root
        Field.
    cells
        Grid cells with sign changes.
    origin, voxel
        First grid point and spacing, scene units.
    work
        Execution settings.
    """

    def __init__(
        self,
        root: Field,
        cells: Cells,
        origin: Point,
        voxel: float,
        work: Work | None = None,
    ) -> None:
        self._cells, self._work = cells, work or Work()
        fast, exact = (Roots(root, p, voxel, self._work.device) for p in ("float32", "float64"))
        if fast.on_gpu:
            from .cuda_crossings import CudaSearch

            self._search: Search = CudaSearch(fast, exact, cells, origin, voxel)
            self._in_order: Callable[[Iterator[Crossings]], Iterator[Crossings]] = ahead
        else:
            self._search, self._in_order = LaneSearch(root, fast, exact, cells, origin, voxel), iter
        self._memory = self._search.memory(0)
        self._first, self._end = 0, 0  # computed intersections: first in memory, one past the last

    def each(self, ranges: Iterable[tuple[int, int]]) -> Iterator[Crossings]:
        """Yield the intersections of ranges, as `between` returns them.

        A GPU finds those of the next range while the caller uses the ones before.

        Parameters
        ----------
        ranges
            First intersections, ascending, and ends.

        Yields
        ------
        Crossings
            Views that are valid until the next ones are asked for.

        Raises
        ------
        Cancelled
            If the job was cancelled.
        """
        return self._in_order(self.between(begin, end) for begin, end in ranges)

    def between(self, begin: int, end: int) -> Crossings:
        """Return the intersections from number `begin` to at least `end` - 1.

        Both numbers lie between bricks. Intersections beyond `end` are included if already computed.

        Parameters
        ----------
        begin
            First intersection; must not decrease from call to call.
        end
            One past the last intersection.

        Returns
        -------
        Crossings
            Views that the next call overwrites; on a GPU, the call after that.

        Raises
        ------
        Cancelled
            If the job was cancelled.
        """
        self._work.check()
        known, end = max(self._end - begin, 0), max(self._end, end)
        t, normals = self._space(begin, end - begin, known)
        if end > self._end:
            self._search.find(begin + known, end, t[known:], normals[:, known:])
            self._end = end
        return Crossings(begin, t, normals)

    def _space(self, begin: int, size: int, known: int) -> Memory:
        """Memory for `size` intersections, the first `known` of which are computed. They are moved only if no
        space is left behind them.
        """
        memory, here = self._memory, begin - self._first
        if here + size > len(memory[0]):
            self._memory = self._search.memory(2 * size)
            for old, new in zip(memory, self._memory, strict=True):
                new[..., :known] = old[..., here : here + known]
            self._first, here = begin, 0
        t, normals = self._memory
        return t[here : here + size], normals[:, here : here + size]
