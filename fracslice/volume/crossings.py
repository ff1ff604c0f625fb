"""Where exactly the surface crosses the grid's edges, and its normals there.

A vertex moves along its own grid edge only, strictly between the edge's ends, so refining cannot fold or
pierce a mesh whose triangles stay in their cells.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .._native import Cells, RootLoops
from ..kernel import Field
from ..work import Work
from .roots import MOST, QUICK, Roots

SURE = 1e-4
"""A root is exact where Newton's last step was shorter, as a share of a voxel: the error is of the order of
its square."""


@dataclass(frozen=True, eq=False)
class Crossings:
    """first: the number of the first one. t: float64 [n], where along each grid edge the surface crosses it.
    normals: float32 [3, n], outward, unit.
    """

    first: int
    t: np.ndarray
    normals: np.ndarray


class Refiner:
    """Finds the exact crossings of grid edges whose ends have opposite signs, in the float64 field.

    origin, voxel: of the grid, scene units. Roots are looked for by the float32 kernel and made exact by the
    float64 one, from its own signs where that one's misled. Where the float64 field does not change its sign
    (it is smaller than float32 can tell at one end) t is that end.
    """

    def __init__(
        self,
        root: Field,
        cells: Cells,
        origin: tuple[float, float, float],
        voxel: float,
        work: Work | None = None,
    ) -> None:
        fast, exact = Roots(root, "float32", voxel), Roots(root, "float64", voxel)
        loops = fast.native("find"), exact.native("find"), exact.native("polish")
        entry = root.kernel("cpu", "float64").entry
        self._loops = RootLoops(fast.width, fast.batch, *loops, entry, (QUICK, MOST), SURE)
        self._placement = origin, voxel
        self._cells, self._work = cells, work or Work()
        self._memory: tuple[np.ndarray, np.ndarray] = np.empty(0), np.empty((3, 0), np.float32)
        self._first, self._end = 0, 0  # what is known: where this memory starts, and behind the last one

    def between(self, begin: int, end: int) -> Crossings:
        """The crossings from `begin`, which only goes up, to `end` - 1 or what is known already, of whole
        bricks; the next call writes over them. Raises `Cancelled`.
        """
        self._work.check()
        known, end = max(self._end - begin, 0), max(self._end, end)
        t, normals = self._room(begin, end - begin, known)
        if end > self._end:
            new = t[known:], normals[:, known:]
            self._cells.find_crossings(begin + known, end, *self._placement, self._loops, *new)
            self._end = end
        return Crossings(begin, t, normals)

    def _room(self, begin: int, size: int, known: int) -> tuple[np.ndarray, np.ndarray]:
        """Memory for so many crossings, the first of which are known: these move only where there is no room
        behind them."""
        memory, here = self._memory, begin - self._first
        if here + size > len(memory[0]):
            if 2 * size > len(memory[0]):
                self._memory = np.empty(2 * size), np.empty((3, 2 * size), np.float32)
            for old, new in zip(memory, self._memory, strict=True):
                new[..., :known] = old[..., here : here + known]
            self._first, here = begin, 0
        t, normals = self._memory
        return t[here : here + size], normals[:, here : here + size]
