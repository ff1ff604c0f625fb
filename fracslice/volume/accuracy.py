"""Distance of a mesh from the exact surface."""

from __future__ import annotations

from itertools import product

import numpy as np

from .._native import surface_error as measured
from ..formulas.algebra import length
from ..formulas.box import Box
from ..kernel import Field
from ..work import Work, chunks

REACH = 1e-4
"""Step of the finite differences, in voxels."""

AT_ONCE = 1 << 16
"""Points per thread between two checks for cancellation."""

_AXES = np.eye(3)
_DIAGONALS = [way for way in product((-1.0, 0.0, 1.0), repeat=3) if np.count_nonzero(way) > 1]
DIRECTIONS = np.array([way / length(way) for way in np.array([*_AXES, *-_AXES, *_DIAGONALS])])
"""Directions of the differences: along the axes, against them, and along diagonals, [26, 3]."""

STARTS, STEPS = 1024, 24
"""Random starting points of the search for the surface, and Newton steps per point."""

NEAR = 1e-3
"""Length of the last step, in voxels, below which a point is on the surface."""


def surface_points(root: Field, box: Box, voxel: float, count: int, work: Work | None = None) -> np.ndarray:
    """Find points on the zero set without samples or a mesh.

    Newton's method from random points of a box, with a fixed seed. If the field is no distance inside, the
    starting points are outside. A part of the surface is reached from the starting points closest to it, so
    thin wires are found too.

    `box`, `voxel` in scene units. Returns float64 [n, 3], scene units.
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
    result: np.ndarray = p[:, move < NEAR * voxel][:, :count].T
    return result


def surface_error(
    root: Field,
    points: np.ndarray,
    voxel: float,
    work: Work | None = None,
    scale: float = 1.0,
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> np.ndarray:
    """Estimate distances from the zero set to first order, ``|f| / |grad f|``.

    The float64 kernel is used. Along each axis the steeper of the two one-sided differences counts, because
    they cancel at an edge or corner; the backward one is taken only where the forward one does not suffice.
    Where two solids touch in an edge the axes lie in the surface: where they are flat, the steepest of all
    directions counts, diagonals included.

    `points`: float [n, 3]; `voxel` in scene units; `scale`, `offset`: placement of the points: scale * p +
    offset for a point p in scene units. Returns float64 [n], scene units, limited to one voxel.
    """
    work, step = work or Work(), REACH * voxel
    points, error = np.asarray(points, np.float64), np.empty(len(points))
    rest = scale, offset, step * DIRECTIONS, step, voxel, work.threads
    entry = root.kernel("cpu", "float64").entry
    for part in chunks(len(points), AT_ONCE * work.threads):
        work.check()
        error[part] = measured(entry, points[part], *rest)
    return error
