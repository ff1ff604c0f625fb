"""Sharp corners of contours: where the outline turns within a pixel, the point where its two sides meet."""

from __future__ import annotations

import numpy as np

from .section import CrossSection, Vertices, alone, free

STEP = 1e-4
"""Pixels between the points of a slope."""

SINE = 0.17
"""Of the angle between two sides, at least: 10 degrees."""

NEAR = 0.01
"""Pixels between a corner and the zero set, at most."""


def corners(points: np.ndarray, following: np.ndarray, pixels: np.ndarray, section: CrossSection) -> Vertices:
    """Corners between crossings.

    points, following, pixels: as of `bends`. A corner is where the tangents of two crossings of one pixel
    meet, as in dual contouring (Ju, Losasso, Schaefer and Warren 2002, "Dual contouring of Hermite data"), if
    the field is zero there; between them an arc is half as far from its chord. It lies in that pixel, and no
    other contour does; or beside it in one that has no contour and no other corner. So no two contours can
    meet.
    """
    f, slope = _tangents(points, section)
    a, b = slope, slope[following]
    sine = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    steep = np.hypot(*a.T) * np.hypot(*b.T)
    chosen = np.flatnonzero((np.abs(sine) > SINE * steep) & alone(pixels))
    if not len(chosen):
        return Vertices.none()
    a, b, sine = a[chosen], b[chosen], sine[chosen]
    # a x = p and b x = q, Cramer's rule; the crossings are not quite on the zero set.
    p = (a * points[chosen]).sum(1) - f[chosen]
    q = (b * points[following[chosen]]).sum(1) - f[following[chosen]]
    meet = np.column_stack([p * b[:, 1] - q * a[:, 1], a[:, 0] * q - b[:, 0] * p]) / sine[:, None]
    within = free(pixels[chosen], np.floor(meet).astype(int), pixels)
    chosen, meet, a = chosen[within], meet[within], a[within]
    u, v = meet - points[chosen], points[following[chosen]] - points[chosen]
    away = np.abs(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]) / np.hypot(*v.T)
    right = np.abs(section(meet)) < np.minimum(NEAR, away / 4) * np.hypot(*a.T)
    return Vertices(meet[right], chosen[right], np.full(np.count_nonzero(right), 0.5))


def _tangents(points: np.ndarray, section: CrossSection) -> tuple[np.ndarray, np.ndarray]:
    """The field at points, and its slope per pixel, float64 [n] and [n, 2]."""
    f = section(points)
    along = [section(points + STEP * step) - f for step in np.eye(2)]
    return f, np.column_stack(along) / STEP
