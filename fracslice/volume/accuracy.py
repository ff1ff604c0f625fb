"""How far a mesh is from the surface it stands for."""

from __future__ import annotations

from itertools import product

import numpy as np

from ..formulas.algebra import length
from ..formulas.box import Box
from ..kernel import Field
from ..work import Work, chunks

REACH = 1e-4
"""The step of the differences, in voxels."""

FLAT = 1e-5
"""Voxels: what seems to be farther off is looked at along diagonals too."""

DIAGONALS = np.array([way for way in product((-1.0, 0.0, 1.0), repeat=3) if np.count_nonzero(way) > 1])


STARTS, STEPS = 1024, 24
"""Random points from which the surface is looked for, and how often each is moved towards it."""

NEAR = 1e-3
"""Voxels: a point that is moved no farther is on the surface."""


def surface_points(root: Field, box: Box, voxel: float, count: int, work: Work | None = None) -> np.ndarray:
    """Points on the zero set, found without samples or a mesh: float64 [n, 3], scene units, at most `count`.

    Newton's method from random points of a box, always the same. Where a field is no distance inside, they
    come from outside. A part of the surface is found as often as it is the nearest one: a thin wire, too.
    """
    kernel, work = root.kernel("cpu", "float64"), work or Work()
    rng = np.random.default_rng(0)
    p = rng.uniform(np.array(box.lo)[:, None], np.array(box.hi)[:, None], (3, STARTS))
    h = REACH * voxel
    if root.bounds.exterior_only:
        p = p[:, ~(kernel.points(*p) < 0)]
    for _ in range(STEPS):
        work.check()
        f = kernel.points(*p)
        gradient = np.stack([kernel.points(*(p + step[:, None])) - f for step in h * np.eye(3)]) / h
        square = (gradient**2).sum(0)
        step = -f * gradient / np.where(square > 0, square, np.inf)
        move = np.where(square > 0, np.linalg.norm(step, axis=0), np.inf)
        p = p + step
    found: np.ndarray = p[:, move < NEAR * voxel][:, :count].T
    return found


def surface_error(root: Field, points: np.ndarray, voxel: float, work: Work | None = None) -> np.ndarray:
    """Distances of points from the zero set to first order, ``|f| / |grad f|``.

    points: float [n, 3], scene units; voxel: scene units. Returns float64 [n], scene units, at most a voxel
    each (where the gradient vanishes it says nothing more). By the float64 kernel; along each axis the
    steeper of the two one-sided differences, because at an edge or a corner they cancel. Where two solids
    touch in an edge the axes lie in the surface: where they are flat, the steepest of all ways counts.
    """
    kernel, h = root.kernel("cpu", "float64"), REACH * voxel
    error = np.empty(len(points))

    def task(part: slice) -> None:
        p = np.ascontiguousarray(points[part].T, np.float64)
        f, square = kernel.points(*p), np.zeros(p.shape[1])
        for step in h * np.eye(3):
            up, down = kernel.points(*(p + step[:, None])) - f, f - kernel.points(*(p - step[:, None]))
            square += (np.maximum(np.abs(up), np.abs(down)) / h) ** 2
        steep = np.sqrt(square)
        flat = np.flatnonzero(np.abs(f) > FLAT * voxel * steep)
        if len(flat):
            for way in DIAGONALS:
                step = h / length(way) * way
                there = kernel.points(*(p[:, flat] + step[:, None]))
                steep[flat] = np.maximum(steep[flat], np.abs(there - f[flat]) / h)
        error[part] = np.minimum(np.abs(f) / np.maximum(steep, 1e-30), voxel)

    (work or Work()).map(task, chunks(len(points), 1 << 14))
    return error
