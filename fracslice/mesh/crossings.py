"""Exact intersections of the surface with the grid's edges, and normals there.

A vertex moves only along its own grid edge, strictly between the edge's ends. Refinement therefore cannot
fold a mesh or make it self-intersect if its triangles stay in their cells.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .._native import Cells, RootLoops
from ..kernel import Field
from ..work import Work
from .roots import MOST, QUICK, Roots

SURE = 1e-4
"""Length of Newton's last step, as a fraction of a voxel, below which a root is exact: the error is of the
order of its square.
"""


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
        origin: tuple[float, float, float],
        voxel: float,
        work: Work | None = None,
    ) -> None:
        work = work or Work()
        fast, exact = (Roots(root, precision, voxel, work.device) for precision in ("float32", "float64"))
        loops = fast.native("find"), exact.native("find"), exact.native("polish")
        entry = root.kernel(work.device, "float64").entry
        self._loops = RootLoops(fast.width, fast.batch, *loops, entry, (QUICK, MOST), SURE)
        self._placement = origin, voxel
        self._cells, self._work = cells, work
        self._memory: tuple[np.ndarray, np.ndarray] = np.empty(0), np.empty((3, 0), np.float32)
        self._first, self._end = 0, 0  # computed intersections: first in memory, one past the last

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
            Views that the next call overwrites.

        Raises
        ------
        Cancelled
            If the job was cancelled.
        """
        self._work.check()
        known, end = max(self._end - begin, 0), max(self._end, end)
        t, normals = self._space(begin, end - begin, known)
        if end > self._end:
            new = t[known:], normals[:, known:]
            self._cells.find_crossings(begin + known, end, *self._placement, self._loops, *new)
            self._end = end
        return Crossings(begin, t, normals)

    def _space(self, begin: int, size: int, known: int) -> tuple[np.ndarray, np.ndarray]:
        """Memory for `size` intersections, the first `known` of which are computed. They are moved only if no
        space is left behind them.
        """
        memory, here = self._memory, begin - self._first
        if here + size > len(memory[0]):
            if 2 * size > len(memory[0]):
                self._memory = np.empty(2 * size), np.empty((3, 2 * size), np.float32)
            for old, new in zip(memory, self._memory, strict=True):
                new[..., :known] = old[..., here : here + known]
            self._first, here = begin, 0
        t, normals = self._memory
        return t[here : here + size], normals[:, here : here + size]
