"""Where exactly the surface crosses the grid's edges, and its normals there.

A vertex moves along its own grid edge only, strictly between the edge's ends, so refining cannot fold or
pierce a mesh whose triangles stay in their cells.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..formulas.registry import Node
from ..kernel import Compilable
from ..work import Work, chunks
from .roots import Roots

PRECISION = 1e-8
"""A root is exact where |f| is this part of a voxel."""


@dataclass(frozen=True, eq=False)
class Crossings:
    """t: float64 [n], where along each grid edge the surface crosses it. normals: float64 [3, n], outward,
    unit.
    """

    t: np.ndarray
    normals: np.ndarray

    def after(self, count: int) -> Crossings:
        """Those left without the first ones."""
        return Crossings(self.t[count:], self.normals[:, count:])

    def joined(self, more: Crossings) -> Crossings:
        """These, then others."""
        if not len(self.t):
            return more
        return Crossings(np.append(self.t, more.t), np.append(self.normals, more.normals, axis=1))


def refine_crossings(
    root: Node | Compilable,
    origin: tuple[float, float, float],
    voxel: float,
    lower: np.ndarray,
    axis: np.ndarray,
    work: Work | None = None,
) -> Crossings:
    """The exact crossings of grid edges whose ends have opposite signs, in the float64 field.

    lower: int32 [3, n], the lower grid point of each edge; axis: uint8 [n]. Roots are looked for by the
    float32 kernel and made exact by the float64 one, from its own signs where that one's misled. Where the
    float64 field does not change its sign (it is smaller than float32 can tell at one end) t is that end.
    """
    fast, exact = Roots(root, "float32", voxel), Roots(root, "float64", voxel)
    n = len(axis)
    t, normals = np.empty(n), np.empty((3, n))

    def task(part: slice) -> None:
        count = part.stop - part.start
        edges = np.empty((6, -(-count // fast.width) * fast.width))
        for k in range(3):
            edges[k, :count] = origin[k] + voxel * lower[k, part]
            edges[k + 3, :count] = voxel * (axis[part] == k)
        edges[:, count:] = edges[:, count - 1 : count]
        found, facing, miss = exact.polished(edges, fast.found(edges.astype(np.float32)))
        left = np.flatnonzero(miss > PRECISION)
        if len(left):
            left = exact.padded(left)
            slow = edges.take(left, 1)
            found[left], facing[:, left], _ = exact.polished(slow, exact.found(slow))
        t[part], normals[:, part] = found[:count], facing[:, :count]

    (work or Work()).map(task, chunks(n, 1 << 14))
    return Crossings(t, normals)
