"""New vertices on sharp edges."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .fit import Fit

STEPS = 6
NEAREST = 4e-3
"""How near its edge a plane is looked for, as a share of the edge's length."""

ANGLE = 0.05
"""Planes that meet at a smaller sine are one."""


SAME = 0.95
"""The cosine between the normals of one side, far from a sharp edge and near, at least."""

REACH = 0.9
"""How far the middle may move, as a share of its edge."""


def on_creases(
    fit: Fit, ends: NDArray[np.float64], starts: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Points of sharp edges beside the middles of edges, [n, 3], and whether they are such, [n].

    ends: float64 [n, 2, 3]. starts: a point on either side of the sharp edge, [n, 2, 3]. The planes that the
    field has there are intersected, again and again, nearer and nearer to where they meet: Newton's method
    for two equations.
    """
    middles = there = ends.mean(axis=1)
    length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    points, apart, first = starts, length / 4, np.empty(0)
    for step in range(STEPS):
        planes = fit.planes(points.reshape(-1, 3)).reshape(-1, 2, 4)
        normals = planes[..., :3]
        first = normals if step == 0 else first
        points = points - planes[..., 3:] * normals
        move = _nearest(normals, ((points - there[:, None]) * normals).sum(axis=2))
        size = np.linalg.norm(move, axis=1)
        there = there + move * np.minimum(1, length / np.maximum(size, 1e-300))[:, None]
        ways = points - there[:, None]
        ways /= np.maximum(np.linalg.norm(ways, axis=2, keepdims=True), 1e-300)
        apart = np.clip(2 * size, NEAREST * length, apart / 2)
        points = there[:, None] + apart[:, None, None] * ways
    found = ((first * normals).sum(axis=2) > SAME).all(axis=1) & (size < NEAREST / 4 * length)
    found &= np.linalg.norm(there - middles, axis=1) < REACH * length
    return there, found


def _nearest(normals: NDArray[np.float64], off: NDArray[np.float64]) -> NDArray[np.float64]:
    """The shortest vectors from a point to where two planes meet that are so far off, or to the plane between
    them."""
    cosine = (normals[:, 0] * normals[:, 1]).sum(axis=1)
    square = 1 - cosine**2
    sharp = square > ANGLE**2
    share = (off - cosine[:, None] * off[:, ::-1]) / np.where(sharp, square, 1)[:, None]
    share[~sharp] = off[~sharp] / 2
    found: NDArray[np.float64] = (share[..., None] * normals).sum(axis=1)
    return found
