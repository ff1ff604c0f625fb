"""Contours of a layer as nested, oriented polygons in mm, with sharp corners and bends, projected to the
zero set.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from .._slices import Slab
from ..common.arrays import Rows
from ..common.messages import format_count
from ..fields.field import Kernel
from .stack import Stack

# Pictures need no contours: what traces them is imported where needed.

ROUNDS = 20
"""Maximum number of steps of false position."""

PRECISE = 1e-3
"""Maximum distance between a crossing and the zero set, pixels."""


@dataclass(frozen=True, eq=False)
class Contours:
    """Closed polygons without intersections, outer ones counter-clockwise, holes clockwise.

    Their points are crossings of the pixel lattice and, between these, sharp corners or bends of the outline.

    Attributes
    ----------
    points : float64 [n, 2]
        mm from the middle of the object's box, x to the right and y to the back.
    starts : int32 [m + 1]
        Polygon i has the points ``starts[i]:starts[i + 1]``; the first is not repeated.
    parent : int32 [m]
        The innermost polygon around each, -1 for none. A parent comes before its children.
    """

    points: np.ndarray
    starts: np.ndarray
    parent: np.ndarray

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {format_count(len(self), 'polygon')}, {self.area:.6g} mm2>"

    def __len__(self) -> int:
        return len(self.parent)

    def __getitem__(self, i: int) -> np.ndarray:
        return self.points[self.starts[i] : self.starts[i + 1]]

    @property
    def areas(self) -> np.ndarray:
        """Signed areas in mm^2, float64 [m]: positive for outer contours, negative for holes."""
        if not len(self):
            return np.zeros(0)
        following = np.arange(1, len(self.points) + 1)
        following[self.starts[1:] - 1] = self.starts[:-1]
        x, y = self.points.T
        return np.add.reduceat(x * y[following] - y * x[following], self.starts[:-1]) / 2

    @property
    def area(self) -> float:
        """Total inside area, mm^2."""
        return float(self.areas.sum())


def gathered(parts: Sequence[Contours]) -> Contours:
    """Contours of several objects that do not touch."""
    ends = np.cumsum([0, *(len(part.points) for part in parts)])
    counts = np.cumsum([0, *map(len, parts)])
    starts = [part.starts[:-1] + end for part, end in zip(parts, ends, strict=False)]
    parents = [
        np.where(part.parent < 0, -1, part.parent + count) for part, count in zip(parts, counts, strict=False)
    ]
    return Contours(
        np.concatenate([part.points for part in parts]),
        np.concatenate([*starts, ends[-1:]]).astype(np.int32),
        np.concatenate(parents).astype(np.int32),
    )


def contours(slab: Slab, k: int, z: float, stack: Stack) -> Contours:
    """Extract the contours of a layer.

    `k`: layer in the slab; `z` in scene units.
    """

    edges, ends = slab.crossings(k)
    following, section = edges[:, 3], CrossSection(stack.exact, z, stack.frame)
    order, starts = _cycles(following)
    along = refine_crossings(section, edges, ends)
    # Never at an end of the edge: several contours, or branches of one, would meet there.
    along = np.clip(along, PRECISE, 1 - PRECISE)
    points = edges[:, :2] + along[:, None] * np.eye(2)[edges[:, 2]]
    vertices = Vertices(points, np.arange(len(points)), np.zeros(len(points)))
    if len(points) and not stack.root.escape_time_only:
        vertices += _turns(points, edges, section)
    places = (vertices.points - np.array(stack.shape[::-1]) / 2) * stack.pixel
    return _nest_contours(replace(vertices, points=places), order, starts, edges, ends[:, 0] < 0)


def _turns(points: np.ndarray, edges: np.ndarray, section: CrossSection) -> Vertices:
    """Corners and bends between crossings."""

    following, middles = edges[:, 3], edges[:, :2] + 0.5 * np.eye(2)[edges[:, 2]]
    pixels = np.floor((middles + middles[following]) / 2).astype(int)
    sharp = corners(points, following, pixels, section)
    return sharp + bends(points, following, pixels, sharp, section)


def _cycles(following: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Cycles of a permutation, each from its lowest number on: order [n], starts [m + 1]."""
    steps, seen, order, starts = following.tolist(), bytearray(len(following)), [], [0]
    for first in range(len(steps)):
        at = first
        while not seen[at]:
            seen[at] = 1
            order.append(at)
            at = steps[at]
        if len(order) > starts[-1]:
            starts.append(len(order))
    return np.array(order, np.int32), np.array(starts, np.int32)


def refine_crossings(section: CrossSection, edges: np.ndarray, ends: np.ndarray) -> np.ndarray:
    """Refine the crossings of edges to `PRECISE`.

    False position with the Illinois rule (Dowell and Jarratt 1971), on all edges at once; converged ones are
    left out.

    `edges`: int32 [n, 4]; `ends`: float64 [n, 2]. Returns float64 [n].
    """
    base, step = edges[:, :2].astype(float), np.eye(2)[edges[:, 2]]
    lo, hi = np.zeros(len(edges)), np.ones(len(edges))
    f_lo, f_hi = ends[:, 0].copy(), ends[:, 1].copy()
    best = f_lo / (f_lo - f_hi)
    moved = np.zeros(len(edges), np.int8)
    todo = np.arange(len(edges))
    for _ in range(ROUNDS):
        if not len(todo):
            break
        t = best[todo]
        f = section(base[todo] + t[:, None] * step[todo])
        left = (f < 0) == (f_lo[todo] < 0)
        a = np.where(left, f, np.where(moved[todo] == 2, f_lo[todo] / 2, f_lo[todo]))
        b = np.where(left, np.where(moved[todo] == 1, f_hi[todo] / 2, f_hi[todo]), f)
        lo[todo], hi[todo] = np.where(left, t, lo[todo]), np.where(left, hi[todo], t)
        f_lo[todo], f_hi[todo], moved[todo] = a, b, np.where(left, 1, 2)
        new = lo[todo] + (hi[todo] - lo[todo]) * a / np.where(a == b, 1.0, a - b)
        best[todo] = new
        todo = todo[(np.abs(new - t) > PRECISE / 2) & (f != 0)]
    return np.asarray(best)


def _nest_contours(
    vertices: Vertices, order: np.ndarray, starts: np.ndarray, edges: np.ndarray, leaves: np.ndarray
) -> Contours:
    """Contours in the order of their lowest, leftmost crossing of a row of samples, each with its parent.

    The crossing to the left of that one in its row is on the parent or on a sibling, depending on whether the
    solid begins or ends there (as in Suzuki and Abe 1985, "Topological structural analysis of digitized
    binary images").
    """
    count = len(starts) - 1
    loop = np.empty(len(order), np.int32)
    loop[order] = np.repeat(np.arange(count), np.diff(starts))
    rows = np.flatnonzero(edges[:, 2] == 0)
    rows = rows[np.lexsort((edges[rows, 0], edges[rows, 1]))]
    loops, first = np.unique(loop[rows], return_index=True)
    turn = np.argsort(first)
    new = np.empty(count, np.int32)
    new[loops[turn]] = np.arange(count)
    parent = np.full(count, -1, np.int32)
    is_hole = np.zeros(count, bool)
    for i, at in enumerate(first[turn]):
        is_hole[i] = leaves[rows[at]]
        if at == 0 or edges[rows[at - 1], 1] != edges[rows[at], 1]:
            continue
        beside = new[loop[rows[at - 1]]]
        parent[i] = beside if is_hole[beside] != is_hole[i] else parent[beside]
    pieces = [order[starts[i] : starts[i + 1]] for i in loops[turn]]
    place = np.empty(len(order), np.int64)
    place[np.concatenate([order[:0], *pieces])] = np.arange(len(order))
    before = np.concatenate([[0], np.cumsum(np.bincount(place[vertices.after], minlength=len(order)))])
    ends = np.concatenate([[0], np.cumsum([len(p) for p in pieces])]).astype(int)
    along = np.lexsort([vertices.share, place[vertices.after]])
    return Contours(vertices.points[along], before[ends].astype(np.int32), parent)


@dataclass(frozen=True, eq=False)
class CrossSection:
    """The field in the plane of a layer."""

    kernel: Kernel  # kernel of the field
    z: float  # height of the plane, scene units
    frame: np.ndarray  # (x0, y0, dx, dy) of the lattice, scene units

    def __call__(self, points: np.ndarray) -> np.ndarray:
        """Field at points of the lattice.

        `points`: float64 [n, 2], lattice units. Returns [n].
        """
        x, y = self.frame[:2, None] + self.frame[2:, None] * points.T
        return self.kernel.points(x, y, np.full(len(points), self.z))


@dataclass(frozen=True, eq=False)
class Vertices(Rows):
    """Vertices of contours."""

    points: np.ndarray  # positions, lattice units
    after: np.ndarray  # the crossing that each vertex is or follows
    share: np.ndarray  # fraction of the distance to the next crossing, 0 to 1

    @classmethod
    def none(cls) -> Vertices:
        """An empty record."""
        return cls(np.empty((0, 2)), np.empty(0, np.int64), np.empty(0))


def keys(pixels: np.ndarray) -> np.ndarray:
    """Unique number of each pixel.

    `pixels`: int64 [n, 2]. Returns int64 [n].
    """
    result: np.ndarray = (pixels[:, 0] << 32) + pixels[:, 1]
    return result


def alone(pixels: np.ndarray) -> np.ndarray:
    """Find pixels that occur once.

    `pixels`: int64 [n, 2]. Returns bool [n], true if no other row is the same pixel.
    """
    _, which, count = np.unique(keys(pixels), return_inverse=True, return_counts=True)
    return np.asarray(count[which] == 1)


def free(pixels: np.ndarray, beside: np.ndarray, taken: np.ndarray) -> np.ndarray:
    """Find vertices that may leave their pixel, or stay in it.

    `pixels`: int64 [n, 2], the pixel of each vertex; `beside`: int64 [n, 2], the pixel that it is to be in;
    `taken`: int64 [m, 2]. Returns bool [n], true if both pixels are the same.
    """
    away = np.abs(beside - pixels).sum(1)
    result: np.ndarray = (away == 0) | ((away == 1) & alone(beside) & ~np.isin(keys(beside), keys(taken)))
    return result


SAGITTA = 2e-3
"""Maximum distance of the outline from the midpoint of a side, pixels."""

STEEPEST = 1 / 8
"""Maximum distance of a bend from the midpoint of a side, as a fraction of the side's length."""

SHORT = 0.1
"""Pixels; a shorter side has no reliable direction."""

LEVELS = 3
"""Maximum number of times that a side is halved."""

BEND_ROUNDS = 8
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

    `points`: float64 [n, 2], lattice units; `following`: int64 [n]; `pixels`: int64 [n, 2], the pixel that
    the contour goes through from there.
    """
    sides = _guess_bends(points, following, pixels).bent
    if not len(sides.after):
        return Vertices.none()
    single = alone(pixels)
    single[sharp.after] = False
    sides = _settle_bends(sides.chosen(single[sides.after]), section).bent
    where, taken = (
        np.floor(sides.tops).astype(int),
        np.concatenate([pixels, np.floor(sharp.points).astype(int)]),
    )
    sides = replace(sides, low=np.minimum(sides.low, where), high=np.maximum(sides.high, where + 1))
    sides = sides.chosen(free(pixels[sides.after], where, taken))
    result = Vertices(sides.tops, sides.after, sides.share)
    for level in range(2, LEVELS + 1):
        sides = _settle_bends(sides.halved(0.5**level).bent, section).bent
        between = (sides.tops > sides.low) & (sides.tops < sides.high)
        sides = sides.chosen(np.all(between, axis=1))
        result += Vertices(sides.tops, sides.after, sides.share)
    return result


def _guess_bends(points: np.ndarray, following: np.ndarray, pixels: np.ndarray) -> _Sides:
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


def _settle_bends(sides: _Sides, section: CrossSection) -> _Sides:
    """Sides with their heights on the field, by the secant method; those without a solution are dropped."""
    height, before, last = sides.height.copy(), np.zeros(len(sides.height)), section(sides.middles)
    result, todo = np.zeros(len(height), bool), np.arange(len(height))
    for _ in range(BEND_ROUNDS):
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
