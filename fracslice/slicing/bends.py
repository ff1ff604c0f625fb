"""Bends of contours: points of the outline where it leaves the straight side between two crossings."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from ..rows import Rows
from .section import CrossSection, Vertices, alone, free

SAGITTA = 2e-3
"""Pixels that an outline may be away from the middle of a side."""

STEEPEST = 1 / 8
"""Of a side's length, that its outline may be away from its middle: what is farther is no bend."""

SHORT = 0.1
"""Pixels: a shorter side tells no direction."""

LEVELS = 3
"""Times that a side is halved, at most."""

ROUNDS = 8


@dataclass(frozen=True, eq=False)
class _Sides(Rows):
    """begin, end: float64 [n, 2]. after, share: of their middles, as of `Vertices`. height: float64 [n], how
    far to the left of its middle the outline is, pixels. low, high: int64 [n, 2], corners of the pixels that
    it may be in.
    """

    begin: np.ndarray
    end: np.ndarray
    after: np.ndarray
    share: np.ndarray
    height: np.ndarray
    low: np.ndarray
    high: np.ndarray

    @property
    def way(self) -> np.ndarray:
        return np.asarray(self.end - self.begin)

    @property
    def middles(self) -> np.ndarray:
        return np.asarray((self.begin + self.end) / 2)

    @property
    def tops(self) -> np.ndarray:
        """Where the outline is beside their middles."""
        x, y = self.way.T
        left = np.column_stack([-y, x]) / np.hypot(x, y)[:, None]
        return np.asarray(self.middles + self.height[:, None] * left)

    def halved(self, share: float) -> _Sides:
        """From their ends to their tops. share: half of the way along a new one."""
        first = replace(self, end=self.tops, share=self.share - share, height=self.height / 4)
        return first + replace(first, begin=self.tops, end=self.end, share=self.share + share)

    @property
    def bent(self) -> _Sides:
        """Those that a bend is beside."""
        away = np.abs(self.height)
        return self.chosen((away > SAGITTA) & (away < STEEPEST * np.hypot(*self.way.T)))


def bends(
    points: np.ndarray, following: np.ndarray, pixels: np.ndarray, sharp: Vertices, section: CrossSection
) -> Vertices:
    """What is to be put between crossings so that no contour is farther than `SAGITTA` from its outline where
    that is smooth.

    points: of the crossings, lattice units, float64 [n, 2]; following: the next ones, int64 [n]; pixels: that
    each contour goes through from there, int64 [n, 2]; sharp: the corners. How far the outline leaves a side
    is guessed from the circles through three crossings, then found on the field; sides that it leaves are
    halved, again and again. A side that has no corner, alone in its pixel, is left for a point of that pixel,
    or of one beside it where no contour or corner is, within `STEEPEST` of its length: the angles of the
    sides there are too flat to meet again. So no contour crosses itself or another one.
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
    found = Vertices(sides.tops, sides.after, sides.share)
    for level in range(2, LEVELS + 1):
        sides = _settled(sides.halved(0.5**level).bent, section).bent
        between = (sides.tops > sides.low) & (sides.tops < sides.high)
        sides = sides.chosen(np.all(between, axis=1))
        found += Vertices(sides.tops, sides.after, sides.share)
    return found


def _guessed(points: np.ndarray, following: np.ndarray, pixels: np.ndarray) -> _Sides:
    """All sides. The outline is as curved as the less curved of its ends: beside a corner, and where it is
    rough, the other one tells of something else.
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
    """The crossing beside each, or the one beyond if that is so near that it tells no direction."""
    near = _square(points[beside] - points) < SHORT**2
    return np.where(near, beside[beside], beside)


def _curvature(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
    """Of the circles through three points, [n, 2] each; positive where it turns to the left."""
    u, v = b - a, c - b
    product = np.sqrt(_square(u) * _square(v) * _square(c - a))
    twice: np.ndarray = 2 * (u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0])
    return twice / np.where(product > 0, product, np.inf)


def _square(way: np.ndarray) -> np.ndarray:
    return np.asarray(way[:, 0] ** 2 + way[:, 1] ** 2)


def _settled(sides: _Sides, section: CrossSection) -> _Sides:
    """Sides with the heights that the field says, by the secant method; without those where it finds none."""
    height, before, last = sides.height.copy(), np.zeros(len(sides.height)), section(sides.middles)
    found, todo = np.zeros(len(height), bool), np.arange(len(height))
    for _ in range(ROUNDS):
        if not len(todo):
            break
        f = section(replace(sides.chosen(todo), height=height[todo]).tops)
        change = np.where(f == last[todo], np.inf, f - last[todo])
        step = -f * (height[todo] - before[todo]) / change
        before[todo], last[todo] = height[todo], f
        height[todo] += step
        found[todo] = np.abs(step) < SAGITTA / 2
        todo = todo[~found[todo] & np.isfinite(height[todo])]
    return replace(sides, height=height).chosen(found)
