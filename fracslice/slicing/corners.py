"""Sharp corners of contours: where the outline turns within a pixel, the point where its two sides meet."""

from __future__ import annotations

import numpy as np

from ..kernel import Kernel

STEP = 1e-4
"""Pixels between the points of a slope."""

SINE = 0.17
"""Of the angle between two sides, at least: 10 degrees."""

NEAR = 0.01
"""Pixels between a corner and the zero set, at most."""


def corners(points: np.ndarray, edges: np.ndarray, kernel: Kernel, z: float, frame: np.ndarray) -> np.ndarray:
    """The corner between each crossing and the one that follows it, lattice units, float64 [n, 2]; NaN where
    there is none.

    points: of the crossings, lattice units, float64 [n, 2]. edges: as `Slab.crossings`. A corner is where the
    tangents of two crossings of one pixel meet, as in dual contouring (Ju, Losasso, Schaefer and Warren 2002,
    "Dual contouring of Hermite data"), if the field is zero there. It lies in that pixel, and no other
    contour does; or beside it in one that has no contour and no other corner. So no two contours can meet.
    """
    found = np.full(points.shape, np.nan)
    following = edges[:, 3]
    middles = edges[:, :2] + 0.5 * np.eye(2)[edges[:, 2]]
    pixels = np.floor((middles + middles[following]) / 2).astype(int)
    cut, which, contours = np.unique(_keys(pixels), return_inverse=True, return_counts=True)
    f, slope = _tangents(points, kernel, z, frame)
    a, b = slope, slope[following]
    sine = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    steep = np.hypot(*a.T) * np.hypot(*b.T)
    chosen = np.flatnonzero((np.abs(sine) > SINE * steep) & (contours[which] == 1))
    if not len(chosen):
        return found
    a, b, sine = a[chosen], b[chosen], sine[chosen]
    # a x = p and b x = q, Cramer's rule; the crossings are not quite on the zero set.
    p = (a * points[chosen]).sum(1) - f[chosen]
    q = (b * points[following[chosen]]).sum(1) - f[following[chosen]]
    meet = np.column_stack([p * b[:, 1] - q * a[:, 1], a[:, 0] * q - b[:, 0] * p]) / sine[:, None]
    where = np.floor(meet).astype(int)
    _, which, many = np.unique(_keys(where), return_inverse=True, return_counts=True)
    aside = np.abs(where - pixels[chosen]).sum(1)
    within = (aside == 0) | ((aside == 1) & (many[which] == 1) & ~np.isin(_keys(where), cut))
    chosen, meet, a = chosen[within], meet[within], a[within]
    right = np.abs(_field(meet, kernel, z, frame)) < NEAR * np.hypot(*a.T)
    found[chosen[right]] = meet[right]
    return found


def _keys(pixels: np.ndarray) -> np.ndarray:
    """A number for each pixel [n, 2]."""
    keys: np.ndarray = (pixels[:, 0] << 32) + pixels[:, 1]
    return keys


def _field(points: np.ndarray, kernel: Kernel, z: float, frame: np.ndarray) -> np.ndarray:
    x, y = frame[:2, None] + frame[2:, None] * points.T
    return kernel.points(x, y, np.full(len(points), z))


def _tangents(
    points: np.ndarray, kernel: Kernel, z: float, frame: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The field at points, and its slope per pixel, float64 [n] and [n, 2]."""
    f = _field(points, kernel, z, frame)
    along = [_field(points + STEP * step, kernel, z, frame) - f for step in np.eye(2)]
    return f, np.column_stack(along) / STEP
