"""Sharp corners of contours: where the outline turns within a pixel, the intersection of its two sides."""

from __future__ import annotations

import numpy as np

from .section import CrossSection, Vertices, alone, free

STEP = 1e-4
"""Step of finite differences, pixels."""

SINE = 0.17
"""Minimum sine of the angle between two sides: 10 degrees."""

NEAR = 0.01
"""Maximum distance between a corner and the zero set, pixels."""


def corners(points: np.ndarray, following: np.ndarray, pixels: np.ndarray, section: CrossSection) -> Vertices:
    """Corners between crossings.

    A corner is the point where the tangents at two crossings of a pixel meet, as in dual contouring (Ju,
    Losasso, Schaefer and Warren 2002, "Dual contouring of Hermite data"), if the field is zero there; an arc
    between the crossings would be half as far from its chord. It lies in that pixel, which has no other
    contour, or in an adjacent one without contours and other corners. So contours have no intersections.

    Parameters
    ----------
    points, following, pixels, section
        As of `bends`.
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
    """Field at points, [n], and its gradient per pixel, [n, 2], float64."""
    f = section(points)
    along = [section(points + STEP * step) - f for step in np.eye(2)]
    return f, np.column_stack(along) / STEP
