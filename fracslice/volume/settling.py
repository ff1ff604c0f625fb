"""Vertices that lie on no grid edge are brought to the surface, each within a box of its own."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..formulas.registry import Node
from ..kernel import Compilable, Kernel, compile_scene
from ..work import Work, chunks
from .values import values_at

STEPS = 4
NEAR = 1e-6
"""A point with |f| below this share of a voxel is where it should be: a corner has no gradient to follow."""

FLAT = 0.1
"""Slopes below this are taken for it, so that no step is longer than ten times |f|."""

REACH = 1e-4
"""The differences' step, in voxels."""


def settle(
    root: Node | Compilable,
    points: np.ndarray,
    room: Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]],
    voxel: float,
    work: Work | None = None,
) -> np.ndarray:
    """Points moved towards the zero set by Newton's steps along the gradient, never out of their boxes.

    points: float64 [n, 3], scene units. room: the low and high corners of the boxes of some of them, [k, 3];
    a box may be flat. A step that does not bring a point nearer is not taken, and what lies on the surface
    already, such as an exact corner, stays. Returns float64 [n, 3].
    """
    kernel, settled, work = compile_scene(root, "float64"), points.copy(), work or Work()
    values = values_at(kernel, points.T, work)
    away = np.flatnonzero(np.abs(values) > NEAR * voxel)
    low, high = room(points[away])

    def task(part: slice) -> None:
        p, f = points[away[part]].T, values[away[part]]
        free = np.where(low[part] < high[part], 1.0, 0.0).T
        for _ in range(STEPS):
            slope = free * _gradient(kernel, p, REACH * voxel)
            step = f * slope / np.maximum((slope * slope).sum(0), FLAT**2)
            moved = np.clip(p - step, low[part].T, high[part].T)
            there = kernel.points(*moved)
            nearer = (np.abs(there) < np.abs(f)) & (np.abs(f) > NEAR * voxel)
            p, f = np.where(nearer, moved, p), np.where(nearer, there, f)
        settled[away[part]] = p.T

    work.map(task, chunks(len(away), 1 << 13))
    return settled


def anywhere(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Boxes without borders."""
    return np.full(points.shape, -np.inf), np.full(points.shape, np.inf)


def _gradient(kernel: Kernel, p: np.ndarray, h: float) -> np.ndarray:
    """Central differences, [3, n]."""
    steps = h * np.eye(3)
    ends = [(kernel.points(*(p + s[:, None])), kernel.points(*(p - s[:, None]))) for s in steps]
    return np.stack([(up - down) / (2 * h) for up, down in ends])
