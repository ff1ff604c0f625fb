"""Where exactly the surface crosses the grid's edges, and its normals there.

A vertex moves along its own grid edge only, strictly between the edge's ends, so refining cannot fold or
pierce a mesh whose triangles stay in their cells.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .._native import Cells
from ..formulas.registry import Node
from ..kernel import Compilable
from ..work import Work, chunks
from .roots import Roots

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

    @property
    def end(self) -> int:
        """The number after the last one."""
        return self.first + len(self.t)

    def without(self, number: int) -> Crossings:
        """Those from that number on."""
        gone = number - self.first
        return Crossings(number, self.t[gone:], self.normals[:, gone:])

    def joined(self, more: Crossings) -> Crossings:
        """These, then the next ones."""
        return Crossings(self.first, np.append(self.t, more.t), np.append(self.normals, more.normals, axis=1))


NONE = Crossings(0, np.empty(0), np.empty((3, 0), np.float32))


def refine_crossings(
    root: Node | Compilable,
    cells: Cells,
    numbers: tuple[int, int],
    origin: tuple[float, float, float],
    voxel: float,
    work: Work | None = None,
) -> Crossings:
    """The exact crossings of grid edges whose ends have opposite signs, in the float64 field.

    numbers: the first crossing's, and the one after the last. Roots are looked for by the float32 kernel and
    made exact by the float64 one, from its own signs where that one's misled. Where the float64 field does
    not change its sign (it is smaller than float32 can tell at one end) t is that end.
    """
    fast, exact = Roots(root, "float32", voxel), Roots(root, "float64", voxel)
    first, last = numbers
    t, normals = np.empty(last - first), np.empty((3, last - first), np.float32)
    x, y, z = origin
    placement = (float(x), float(y), float(z)), float(voxel), fast.width

    def task(part: slice) -> None:
        edges = cells.segments(first + part.start, first + part.stop, *placement)
        found, facing, miss = exact.polished(edges, fast.found(edges.astype(np.float32)))
        left = np.flatnonzero(~(miss <= SURE))
        if len(left):
            left = exact.padded(left)
            slow = edges.take(left, 1)
            roots = exact.found(slow)
            moved, facing[:, left], miss = exact.polished(slow, roots)
            found[left] = np.where(miss <= SURE, moved, roots)
        count = part.stop - part.start
        t[part], normals[:, part] = found[:count], facing[:, :count]

    (work or Work()).map(task, chunks(last - first, 1 << 14))
    return Crossings(first, t, normals)
