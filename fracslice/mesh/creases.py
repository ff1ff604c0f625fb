"""New vertices on sharp edges and at corners."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .fit import Fit

STEPS = 6
NEAREST = 4e-3
"""Minimum distance from the sharp edge at which planes are evaluated, relative to the length of the mesh
edge.
"""

ANGLE = 0.05
"""Minimum sine between two planes; below it they count as one."""


LEAST = 0.1
"""Minimum determinant of the normals of three sides that meet in a corner."""

SAME = 0.95
"""Minimum cosine between the normals of one side, far from the sharp edge and near it."""

REACH = 0.9
"""Maximum displacement of the midpoint, relative to the length of its edge."""


def on_creases(
    fit: Fit, ends: NDArray[np.float64], starts: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Points on sharp edges near the midpoints of mesh edges.

    The tangent planes of the field on both sides are intersected repeatedly, each time closer to their
    intersection: Newton's method for two equations.

    Parameters
    ----------
    fit : Fit
        Tangent planes of the field.
    ends : ndarray of float64, shape (n, 2, 3)
        End points of the mesh edges.
    starts : ndarray of float64, shape (n, 2, 3)
        A point on either side of each sharp edge.

    Returns
    -------
    ndarray of float64, shape (n, 3)
        Points.
    ndarray of bool, shape (n,)
        True where the point is on a sharp edge.
    """
    middles = there = ends.mean(axis=1)
    length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    points, spacing, first = starts, length / 4, np.empty(0)
    for step in range(STEPS):
        planes = fit.planes(points.reshape(-1, 3)).reshape(-1, 2, 4)
        normals = planes[..., :3]
        first = normals if step == 0 else first
        points = points - planes[..., 3:] * normals
        move = _nearest(normals, ((points - there[:, None]) * normals).sum(axis=2))
        size = np.linalg.norm(move, axis=1)
        there = there + move * np.minimum(1, length / np.maximum(size, 1e-300))[:, None]
        directions = points - there[:, None]
        directions /= np.maximum(np.linalg.norm(directions, axis=2, keepdims=True), 1e-300)
        spacing = np.clip(2 * size, NEAREST * length, spacing / 2)
        points = there[:, None] + spacing[:, None, None] * directions
    result = ((first * normals).sum(axis=2) > SAME).all(axis=1) & (size < NEAREST / 4 * length)
    result &= np.linalg.norm(there - middles, axis=1) < REACH * length
    return there, result


def on_three(
    fit: Fit, corners: NDArray[np.float64], size: float
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Corners of the surface near triangles, where three of its sides meet.

    As `on_creases`, with the three of the tangent planes near the triangle that differ most.

    Parameters
    ----------
    fit : Fit
        Tangent planes of the field.
    corners : ndarray of float64, shape (n, 3, 3)
        Corners of the triangles.
    size : float
        Size of the triangles, scene units.

    Returns
    -------
    ndarray of float64, shape (n, 3)
        Points.
    ndarray of bool, shape (n,)
        True where three sides meet in the point.
    """
    there = corners.mean(axis=1)
    around = np.concatenate(
        [0.9 * corners + 0.1 * there[:, None], (corners + np.roll(corners, 1, axis=1)) / 2], 1
    )
    normals, each = fit.planes(around.reshape(-1, 3))[:, :3].reshape(-1, 6, 3), np.arange(len(corners))
    second = (normals * normals[:, :1]).sum(axis=2).argmin(axis=1)
    across = np.cross(normals[:, 0], normals[each, second])
    third = np.abs((normals * across[:, None]).sum(axis=2)).argmax(axis=1)
    points = np.stack([around[:, 0], around[each, second], around[each, third]], axis=1)
    result = np.ones(len(corners), bool)
    first: NDArray[np.float64] = np.empty(0)
    moved = spacing = np.full(len(corners), size / 4, np.float64)
    for step in range(STEPS):
        planes = fit.planes(points.reshape(-1, 3)).reshape(-1, 3, 4)
        normals = planes[..., :3]
        first = normals if step == 0 else first
        result &= np.abs(np.linalg.det(normals)) > LEAST
        points = points - planes[..., 3:] * normals
        off = ((points - there[:, None]) * normals).sum(axis=2)
        move = np.linalg.solve(np.where(result[:, None, None], normals, np.eye(3)), off[..., None])[..., 0]
        there, moved = there + move, np.linalg.norm(move, axis=1)
        directions = points - there[:, None]
        directions /= np.maximum(np.linalg.norm(directions, axis=2, keepdims=True), 1e-300)
        spacing = np.clip(2 * moved, NEAREST * size, spacing / 2)
        points = there[:, None] + spacing[:, None, None] * directions
    result &= ((first * normals).sum(axis=2) > SAME).all(axis=1) & (moved < NEAREST / 4 * size)
    return there, result


def _nearest(normals: NDArray[np.float64], off: NDArray[np.float64]) -> NDArray[np.float64]:
    """Shortest vectors from points to the intersection of two planes at signed distances `off`, or, if these
    are nearly parallel, to the plane midway.
    """
    cosine = (normals[:, 0] * normals[:, 1]).sum(axis=1)
    square = 1 - cosine**2
    sharp = square > ANGLE**2
    share = (off - cosine[:, None] * off[:, ::-1]) / np.where(sharp, square, 1)[:, None]
    share[~sharp] = off[~sharp] / 2
    result: NDArray[np.float64] = (share[..., None] * normals).sum(axis=1)
    return result
