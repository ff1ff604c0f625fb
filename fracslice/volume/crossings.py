"""Where exactly the surface crosses the grid's edges, and its normals there.

A vertex moves along its own grid edge only, strictly between the edge's ends, so refining cannot fold or
pierce a mesh whose triangles stay in their cells.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np

from .._native import Cells, RootLoops
from ..formulas.registry import Node
from ..kernel import Compilable, Kernel, compile_scene
from ..kernel.cpu import CpuKernel
from ..work import Work
from .roots import MOST, QUICK, Roots

SURE = 1e-4
"""A root is exact where Newton's last step was shorter, as a share of a voxel: the error is of the order of
its square."""


BATCHES = 1 << 10, 1 << 14
"""Crossings that are looked for together by a compiled field: they stay in the fastest memory; and by
another."""


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
        root: Node | Compilable,
        cells: Cells,
        origin: tuple[float, float, float],
        voxel: float,
        work: Work | None = None,
    ) -> None:
        fast, exact = Roots(root, "float32", voxel), Roots(root, "float64", voxel)
        kernel = compile_scene(root, "float64")
        field = kernel.entry if isinstance(kernel, CpuKernel) else partial(_evaluated, kernel)
        loops = fast.native("find"), exact.native("find"), exact.native("polish"), field, (QUICK, MOST), SURE
        self._loops = RootLoops(fast.width, BATCHES[not isinstance(root, Node)], *loops)
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


def _evaluated(kernel: Kernel, points: np.ndarray, out: np.ndarray) -> None:
    out[0] = kernel.points(*points)
