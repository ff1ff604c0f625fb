"""Bends of contours: vertices where the outline leaves the straight side between two crossings."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..common.rows import Rows
from .section import CrossSection, Vertices, alone, free

SAGITTA = 2e-3
"""Maximum distance of the outline from the midpoint of a side, pixels."""

STEEPEST = 1 / 8
"""Maximum distance of a bend from the midpoint of a side, as a fraction of the side's length."""

SHORT = 0.1
"""Pixels; a shorter side has no reliable direction."""

LEVELS = 3
"""Maximum number of times that a side is halved."""

ROUNDS = 8
"""Maximum number of steps of the secant method."""


@dataclass(frozen=True, eq=False)
class _Sides(Rows):
    """Sides of contours, in pixels.

    begin, end: float64 [n, 2]. after, share: of the midpoints, as of `Vertices`. height: float64 [n],
    distance of the outline to the left of the midpoint. low, high: int64 [n, 2], corners of the pixels that
    the outline may be in.
    """

    begin: np.ndarray
    end: np.ndarray
    after: np.ndarray
    share: np.ndarray
    height: np.ndarray
    low: np.ndarray
    high: np.ndarray

    @property
    def span(self) -> np.ndarray:
        """Vectors from `begin` to `end`."""
        return np.asarray(self.end - self.begin)

    @property
    def middles(self) -> np.ndarray:
        """Midpoints of the sides."""
        return np.asarray((self.begin + self.end) / 2)

    @property
    def tops(self) -> np.ndarray:
        """Points of the outline next to the midpoints."""
        x, y = self.span.T
        left = np.column_stack([-y, x]) / np.hypot(x, y)[:, None]
        return np.asarray(self.middles + self.height[:, None] * left)

    def halved(self, share: float) -> _Sides:
        """Sides from both ends to the tops. share: half of a new side's share."""
        first = replace(self, end=self.tops, share=self.share - share, height=self.height / 4)
        return first + replace(first, begin=self.tops, end=self.end, share=self.share + share)

    @property
    def bent(self) -> _Sides:
        """Sides with a bend next to them."""
        away = np.abs(self.height)
        return self.chosen((away > SAGITTA) & (away < STEEPEST * np.hypot(*self.span.T)))


def bends(
    points: np.ndarray, following: np.ndarray, pixels: np.ndarray, sharp: Vertices, section: CrossSection
) -> Vertices:
    """Vertices to add between crossings, so that smooth contours are within `SAGITTA` of their outlines.

    The distance of the outline from a side is estimated from circles through three crossings, then solved for
    on the field. Sides that the outline leaves are halved, up to `LEVELS` times. A side is bent only if it
    has no corner and is alone in its pixel. The vertex is in that pixel, or in an adjacent one without
    contours and corners, and within `STEEPEST` of the side's length: the angles between sides are too flat
    for them to meet again. So contours have no intersections.

    Parameters
    ----------
    points : float64 [n, 2]
        Crossings, lattice units.
    following : int64 [n]
        The next crossing of each one's contour.
    pixels : int64 [n, 2]
        The pixel that the contour goes through from there.
    sharp : Vertices
        Corners.
    section : CrossSection
        The field in the plane of the layer.
    """
    sides = _guessed(points, following, pixels).bent
    if not len(sides.after):
        return Vertices.none()
    single = alone(pixels)
    single[sharp.after] = False
    sides = _settled(sides.chosen(single[sides.after]), section).bent
    where, taken = (
        np.floor(sides.tops).astype(int),
        np.concatenate([pixels, np.floor(sharp.points).astype(int)]),
    )
    sides = replace(sides, low=np.minimum(sides.low, where), high=np.maximum(sides.high, where + 1))
    sides = sides.chosen(free(pixels[sides.after], where, taken))
    result = Vertices(sides.tops, sides.after, sides.share)
    for level in range(2, LEVELS + 1):
        sides = _settled(sides.halved(0.5**level).bent, section).bent
        between = (sides.tops > sides.low) & (sides.tops < sides.high)
        sides = sides.chosen(np.all(between, axis=1))
        result += Vertices(sides.tops, sides.after, sides.share)
    return result


def _guessed(points: np.ndarray, following: np.ndarray, pixels: np.ndarray) -> _Sides:
    """All sides, with estimated heights.

    The smaller curvature of the two ends counts: next to a corner, and on a rough outline, the larger one
    belongs to another part of the outline.
    """
    before = np.empty_like(following)
    before[following] = np.arange(len(following))
    begin, end = points, points[following]
    first = _curvature(points[_far(points, before)], begin, end)
    last = _curvature(begin, end, points[_far(points, following)[following]])
    least = np.where(first * last > 0, np.copysign(np.minimum(np.abs(first), np.abs(last)), first), 0)
    number, half = np.arange(len(points)), np.full(len(points), 0.5)
    return _Sides(begin, end, number, half, -least * _square(end - begin) / 8, pixels, pixels + 1)


def _far(points: np.ndarray, beside: np.ndarray) -> np.ndarray:
    """The adjacent crossing, or the one beyond it if the adjacent one is too near for a direction."""
    near = _square(points[beside] - points) < SHORT**2
    return np.where(near, beside[beside], beside)


def _curvature(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
    """Curvature of the circles through three points, [n, 2] each; positive if it turns left."""
    u, v = b - a, c - b
    product = np.sqrt(_square(u) * _square(v) * _square(c - a))
    twice: np.ndarray = 2 * (u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0])
    return twice / np.where(product > 0, product, np.inf)


def _square(span: np.ndarray) -> np.ndarray:
    """Squared lengths of vectors [n, 2]."""
    return np.asarray(span[:, 0] ** 2 + span[:, 1] ** 2)


def _settled(sides: _Sides, section: CrossSection) -> _Sides:
    """Sides with their heights on the field, by the secant method; those without a solution are dropped."""
    height, before, last = sides.height.copy(), np.zeros(len(sides.height)), section(sides.middles)
    result, todo = np.zeros(len(height), bool), np.arange(len(height))
    for _ in range(ROUNDS):
        if not len(todo):
            break
        f = section(replace(sides.chosen(todo), height=height[todo]).tops)
        change = np.where(f == last[todo], np.inf, f - last[todo])
        step = -f * (height[todo] - before[todo]) / change
        before[todo], last[todo] = height[todo], f
        height[todo] += step
        result[todo] = np.abs(step) < SAGITTA / 2
        todo = todo[~result[todo] & np.isfinite(height[todo])]
    return replace(sides, height=height).chosen(result)
