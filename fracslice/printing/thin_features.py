"""Walls and gaps that are too thin for samples, which miss them or show only some of them, found by rays
from an offset field.

An offset field, the field less `NEAR` voxels, is sampled: each wall is thicker by that on both sides and no
longer fits between samples. From its surface, rays follow the normal inwards on the field itself: to where
the object begins, and on to where it ends. For gaps all signs are reversed.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from .._native import graph_components, ray_points
from ..common.arrays import Rows, weighted_quantiles
from ..common.cache import key
from ..errors import VolumeError
from ..fields.box import Box
from ..fields.devices import ArrayField
from ..fields.field import Bounds, Device, Field, Kernel, Precision
from ..volume import Bricks, Lattice, sample
from ..volume.bricks import BRICK, values_at
from ..work import Work
from .walls import (
    AT_ONCE,
    AWAY,
    OPPOSITE,
    Direction,
    Samples,
    Walls,
    edge_crossings,
    in_blocks,
    slopes,
    walls,
)

ROUNDS = 400
"""Maximum number of steps along a ray."""


@dataclass(frozen=True, eq=False)
class Rays(Rows):
    """Rays that start next to a surface and pass through it."""

    start: np.ndarray  # origins, scene units, and unit directions
    directions: np.ndarray
    area: np.ndarray  # surface that each ray represents
    enter: np.ndarray  # distances along the ray to the beginning and the end of a thin wall or gap
    leave: np.ndarray

    def points(self, s: np.ndarray) -> np.ndarray:
        """Points at distances `s` along the rays, [3, n]."""
        return np.asarray(self.start.T + s * self.directions.T)

    def some_points(self, which: np.ndarray, s: np.ndarray) -> np.ndarray:
        """Points at distances `s` along the rays of these numbers, [3, n]."""
        return ray_points(self.start, self.directions, which, s)


def first_negative(
    field: Callable[[np.ndarray, np.ndarray], np.ndarray],
    begin: np.ndarray,
    end: np.ndarray,
    bound: float,
    least: float,
) -> np.ndarray:
    """Distance along each ray at which a field first turns negative.

    Steps follow the distance (sphere tracing, Hart 1996). Over the last step the field is taken as linear.

    `begin`, `end`: float64 [n]. Returns float64 [n].
    """
    s, before, todo = begin + least, begin.copy(), np.arange(len(begin))
    high, low = np.full((2, len(begin)), least * bound / 2)
    for _ in range(ROUNDS):
        f = field(todo, s[todo])
        on, below = todo[f >= 0], todo[f < 0]
        before[on], high[on], low[below] = s[on], f[f >= 0], f[f < 0]
        s[on] += np.maximum(high[on] / bound, least)
        far = below[s[below] - before[below] > 1.01 * least]
        s[far] = (before[far] + s[far]) / 2
        todo = np.concatenate([on[s[on] < end[on]], far])
        if not len(todo):
            break
    s[todo] = end[todo]
    negative = s < end
    share = low[negative] / (low[negative] - high[negative])
    s[negative] -= share * (s[negative] - before[negative])
    return s


@dataclass(frozen=True, eq=False)
class OffsetField(ArrayField):
    """A field less a constant."""

    root: Field  # the field to offset
    by: float  # constant to subtract, scene units; positive values grow the inside

    @cached_property
    def bounds(self) -> Bounds:
        """Bounds as of the formula `offset`. A flatter field's inside can extend farther from its box."""
        own = self.root.bounds
        return replace(own, box=own.box.grown(self.by), lipschitz=own.slope_less(self.by))

    @property
    def key(self) -> str:
        """`Field.key`."""
        return key(self.root.key, "offset", self.by)

    @property
    def proved_box(self) -> Box:
        """`Field.proved_box`."""
        return self.root.proved_box.grown(self.by)

    def conservative(self) -> OffsetField:
        """`Field.conservative`. An escape-time fractal is not shrunk: its interior values bound nothing."""
        by = max(self.by, 0.0) if self.root.bounds.exterior_only else self.by
        return OffsetField(self.root.conservative(), by)

    def kernel(self, device: Device = "cpu", precision: Precision = "float32") -> Kernel:
        """`Field.kernel`."""
        return _Shifted(self.root.kernel(device, precision), self.by)


class _Shifted(Kernel):
    """Kernel of an offset field."""

    def __init__(self, root: Kernel, by: float) -> None:
        self.dtype, self.batch = root.dtype, root.batch
        self._root, self._by = root, root.dtype.type(by)

    def points(self, x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
        """`Kernel.points`."""
        f: np.ndarray = self._root.points(x, y, z) - self._by
        return f

    def bricks(
        self, corners: np.ndarray, origin: tuple[float, float, float], voxel: float, out: np.ndarray
    ) -> None:
        """`Kernel.bricks`."""
        self._root.bricks(corners, origin, voxel, out)
        out -= self._by


NEAR = 0.9
"""Offset in voxels: more than the distance from any point to the nearest sample, half the diagonal."""

BEFORE = 0.8
"""Length at the start of a ray in which it enters nothing, voxels."""

THIN = 3.0
"""Voxels; thicker features are measured on samples, too."""

STEP = 0.05
"""Minimum step along a ray, voxels; walls and gaps as thin as that may still be missed."""

SLACK = 0.25
"""Voxels before a thick wall or gap in which nothing else is searched for."""

RAYS = 1 << 13
"""Rays traced at a time by one thread."""


@dataclass(frozen=True, eq=False)
class ThinFeatures:
    """Thin walls, or thin gaps, accurate to a hundredth of a voxel."""

    walls: Walls  # the walls or gaps
    # width, scene units, below which they replace those measured on samples. 0 if the samples are accurate,
    # and `walls` has only those that the samples miss
    replaces: float

    def least(self, voxel: float) -> float:
        """Least width on samples of a wall that `beside` may keep once its faces are projected."""
        return self.replaces - 2.01 * AWAY * voxel

    def beside(self, sampled: Walls, limit: float, direction: Direction | None = None) -> Walls:
        """Combine with walls measured on samples.

        `limit` in scene units.
        """
        mine = self.walls if direction is None else self.walls.along(direction)
        return sampled.chosen(sampled.width >= self.replaces) + mine.chosen(mine.width < limit)


def thin_features(root: Field, seen: Samples, work: Work) -> tuple[ThinFeatures, ThinFeatures]:
    """Find the thin walls and gaps of an object, including those that its samples miss.

    The values of escape-time fractals are far from distances: their samples are more accurate, and only
    features that the samples miss are searched for. A gap between thin walls is reached through them.
    """
    look = _Look(root, seen, THIN * seen.bricks.voxel, work)
    return look.features(look.walls()), look.features(look.gaps())


@dataclass(frozen=True, eq=False)
class _Look:
    """A search for the thin features of a field: its samples, and the maximum width in scene units."""

    root: Field
    seen: Samples
    most: float
    work: Work

    @cached_property
    def kernel(self) -> Kernel:
        return self.root.kernel()

    @property
    def voxel(self) -> float:
        return self.seen.bricks.voxel

    def features(self, thin: Walls) -> ThinFeatures:
        """Walls or gaps with the width below which they replace sampled ones."""
        return ThinFeatures(thin, 0.0 if self.root.bounds.exterior_only else self.most)

    @cached_property
    def inwards(self) -> Rays:
        """Rays through all thin walls."""
        return self.rays(1.0)

    def walls(self) -> Walls:
        """Thin walls."""
        return self.facing(self.inwards)

    def gaps(self) -> Walls:
        """Thin gaps, searched from within thick walls and behind thin ones.

        Behind a thin wall the search goes on through the next gap and wall while the gaps are too narrow for
        a ray to start in them.
        """
        result, rays = self.from_within(), self.inwards
        while len(rays.start):
            rays = self.near(rays)
            gap = self.stretch(rays, rays.leave, 1.0)
            gap = self.missed(gap, gap.enter)
            gap = self.missed(gap, gap.leave)
            result = result + self.facing(gap)
            near = gap.chosen(gap.leave - gap.enter < 2 * NEAR * self.voxel)
            rays = self.stretch(near, near.leave, -1.0)
        return result

    def from_within(self) -> Walls:
        """Thin gaps between thick walls, searched from within them."""
        bounds = self.root.bounds
        if not (bounds.exterior_only or self.seen.native.may_be_deep(NEAR, bounds.lipschitz)):
            return Walls.none()
        try:
            rays = self.rays(-1.0)
        except VolumeError:  # all walls are thin
            return Walls.none()
        limit = np.full(len(rays.start), self.most)
        back = self.first(replace(rays, directions=-rays.directions), 0 * limit, limit, -1.0)
        return self.facing(rays.chosen(rays.enter + back > limit))

    def near(self, rays: Rays) -> Rays:
        """Rays that may meet something within `most` of where they leave: halfway, others are as far off."""
        half = self.most / 2
        f = self.field(rays.points(rays.leave + STEP * self.voxel + half))
        return rays.chosen(f < half * self.root.bounds.lipschitz)

    def stretch(self, rays: Rays, begin: np.ndarray, sign: float) -> Rays:
        """Rays along which the field times `sign`, positive from `begin` on, turns negative within `most`.

        They enter at `begin` and leave at the change of sign.
        """
        end = begin + self.most
        leave = self.first(rays, begin, end, sign)
        return replace(rays, enter=begin, leave=leave).chosen(leave < end)

    def rays(self, sign: float) -> Rays:
        """Rays through all thin walls (sign 1), or from within thick walls through thin gaps (sign -1)."""
        reach = NEAR * self.voxel * self.root.bounds.lipschitz
        offset_field = self.offset_field(sign * reach)

        def look(rows: slice) -> Rays:
            start, normals, area = edge_crossings(offset_field, np.arange(len(offset_field.bricks))[rows])
            far = np.full(len(start), 2 * (reach + self.voxel))
            rays = self.limited(Rays(start, -sign * normals, area, 0 * area, far), sign)
            enter = self.first(rays, np.full(len(rays.start), BEFORE * self.voxel), rays.leave, sign)
            rays = replace(rays, enter=enter).chosen(enter < rays.leave)
            return self.stretch(rays, rays.enter, -sign)

        return in_blocks(look, len(offset_field.bricks), AT_ONCE, self.work)

    def limited(self, rays: Rays, sign: float) -> Rays:
        """Rays that may enter something thin, with the distance up to which they are traced.

        If the field's values are distances, these are all rays that may leave within `most` what they enter
        at least `NEAR` voxels from their start: most others are as far from any surface halfway. Rays of a
        fractal end where its samples contain a surface.
        """
        if self.root.bounds.exterior_only:
            end = self.seen.free(rays.start, rays.directions, rays.leave)
            return replace(rays, leave=end).chosen(end > BEFORE * self.voxel)
        half = self.most / 2
        middle = np.full(len(rays.start), (NEAR + SLACK) * self.voxel + half)
        f = sign * self.field(rays.points(middle))
        return rays.chosen(~(f <= -half * self.root.bounds.lipschitz))

    def missed(self, rays: Rays, s: np.ndarray) -> Rays:
        """Rays to continue at distance `s`; of a fractal, only where its samples miss the surface."""
        if not self.root.bounds.exterior_only:
            return rays
        begin = rays.points(s).T
        return rays.chosen(self.seen.free(begin, rays.directions, np.full(len(begin), self.voxel)) > 0)

    def offset_field(self, by: float) -> Samples:
        """Samples of the field less `by`. The box grows: a flatter field's inside extends farther from it."""
        for times in (2, 8, 32):
            try:
                box = (self.root.bounds.box | self.seen.bounds.box).grown(times * abs(by))
                bounds, lattice = replace(self.root.bounds, box=box), Lattice.around(box, self.voxel)
                return Samples(sample(OffsetField(self.root, by).kernel(), bounds, lattice, self.work))
            except VolumeError as error:
                failure = error
        raise failure

    def first(self, rays: Rays, begin: np.ndarray, end: np.ndarray, sign: float) -> np.ndarray:
        """Distance along each ray at which the field times `sign` first turns negative after `begin`.

        Beyond `end` if it does not.
        """

        def field(which: np.ndarray, s: np.ndarray) -> np.ndarray:
            return sign * self.field(rays.some_points(which, s))

        return first_negative(field, begin, end, self.root.bounds.lipschitz, STEP * self.voxel)

    def closed_around(self, gaps: Walls) -> np.ndarray:
        """True if some line through the middle of a gap, across its width, is shorter than `most`."""
        normal, middle = (gaps.end - gaps.start) / gaps.width[:, None], gaps.middle
        one = np.cross(normal, np.eye(3)[np.abs(normal).argmin(1)])
        one /= np.linalg.norm(one, axis=1)[:, None]
        other, closed = np.cross(normal, one), np.zeros(len(middle), bool)
        for angle in np.pi / LINES * np.arange(LINES):
            todo = np.flatnonzero(~closed)
            line = np.cos(angle) * one[todo] + np.sin(angle) * other[todo]
            one_way, back = (self.free(middle[todo], way, self.most) for way in (line, -line))
            closed[todo] = one_way + back < self.most
        return closed

    def free(self, start: np.ndarray, directions: np.ndarray, most: float | np.ndarray) -> np.ndarray:
        """Distance from points outside to the object along directions [n, 3], up to `most`."""
        begin, end = np.zeros(len(start)), np.full(len(start), most)
        far = self.first(Rays(start, directions, begin, begin, end), begin, end, 1.0)
        return np.asarray(np.minimum(far, end))

    def in_sight(self, points: np.ndarray, most: float) -> tuple[np.ndarray, int]:
        """Number points outside, [n, 3], by groups that see each other within `most`; count the groups."""
        from scipy.spatial import cKDTree

        some, others = cKDTree(points).query_pairs(most, output_type="ndarray").T
        way = points[others] - points[some]
        far = np.linalg.norm(way, axis=1)
        seen = self.free(points[some], way / far[:, None], far) >= far
        return graph_components(len(points), some[seen], others[seen])

    def field(self, points: np.ndarray) -> np.ndarray:
        """Field values at points [3, n]."""
        return values_at(self.kernel, points, self.work)

    def facing(self, rays: Rays) -> Walls:
        """Rays whose two faces look away from each other, as walls."""

        def look(part: slice) -> Walls:
            some = rays.chosen(part)
            ends = [some.points(s) for s in (some.enter, some.leave)]
            facing = (self.normals(ends[0]) * self.normals(ends[1])).sum(0)
            result = Walls(ends[0].T, ends[1].T, some.leave - some.enter, some.area, facing)
            return result.chosen(facing < OPPOSITE)

        return in_blocks(look, len(rays.start), RAYS, self.work)

    def normals(self, points: np.ndarray) -> np.ndarray:
        """Unit normals of the field at points [3, n], [3, n]."""
        return slopes(self.kernel, points, STEP * self.voxel, self.work)[1]


def all_walls(root: Field, seen: Samples, limit: float, work: Work, *, gaps: bool = False) -> Walls:
    """Find all walls or gaps, on the samples and on the field.

    `limit` in scene units.
    """
    exterior_only, most = root.bounds.exterior_only, THIN * seen.bricks.voxel
    look = _Look(root, seen, most if exterior_only else max(most, limit), work)
    result = look.gaps() if gaps else look.walls()
    if exterior_only:
        result = walls(seen, limit, work, gaps=gaps) + result
    return result.chosen(result.width < limit)


LINES = 12
"""Lines across a gap: one is within 7.5 degrees of the shortest, and 0.9 % longer at most."""


def narrow_holes(root: Field, seen: Samples, gaps: Walls, limit: float, work: Work) -> Walls:
    """Find holes narrower than a limit: gaps that are narrow in a second direction across, too.

    One place is tried in each cube of that size. Places in sight of each other are one hole; one that is
    shorter than wide is a dent. A fractal has holes of every width, and none is searched for.

    `limit` in scene units. Returns a place of median width in each hole.
    """
    if root.bounds.exterior_only or not len(gaps.width):
        return Walls.none()
    look = _Look(root, seen, limit, work)
    place = np.rint(gaps.middle / limit).astype(np.int64).T
    place -= place.min(1, keepdims=True)
    _, cube = np.unique(np.ravel_multi_index(tuple(place), tuple(place.max(1) + 1)), return_inverse=True)
    tried = gaps.chosen(_median_of_each(cube, gaps.width))
    closed = look.closed_around(tried)
    places = tried.chosen(closed)
    number, count = look.in_sight(places.middle, 2 * limit)
    hole = np.full(len(closed), -1)
    hole[closed] = number
    low, high = np.full((2, count + 1, 3), np.inf)
    np.minimum.at(low, hole[cube], gaps.middle)
    np.minimum.at(high, hole[cube], -gaps.middle)
    holes = places.chosen(_median_of_each(number, places.width))
    return holes.chosen(np.linalg.norm(-high - low, axis=1)[:count] >= holes.width)


def _median_of_each(number: np.ndarray, width: np.ndarray) -> np.ndarray:
    """Index of a median width of each number 0, 1, 2 ..., int64 [numbers]."""
    order, count = np.lexsort((width, number)), np.bincount(number)
    return np.asarray(order[np.cumsum(count) - (count + 1) // 2])


FINEST = 768
"""Maximum number of samples along the longest side in the search for a surface."""

MOST = 150_000
"""Approximate maximum number of bricks in samples that resolve connectivity, for a field whose batches are of
the usual size; fewer if its values take longer.
"""

AGAIN = 3.0
"""Refinement factor for fractals that appear disconnected."""


def sampled_object(root: Field, outer: Box, longest: float, samples: float, work: Work) -> Bricks:
    """Sample an object until a surface appears: a plate may lie between all samples.

    A lattice has no samples on the middle planes of its box. Where it shows nothing, one that has is tried,
    then a finer one.

    `outer`, `longest` in scene units.
    """
    for times in (1, 2, 4, 8):
        lattice = Lattice.around(outer, longest / (times * samples))
        x, y, z = (first - lattice.voxel / 2 for first in lattice.origin)
        for grid in (lattice, replace(lattice, origin=(x, y, z))):
            try:
                return sample(root.kernel(), root.bounds, grid, work)
            except VolumeError as error:
                failure = error
        if 2 * times * samples > FINEST:
            break
    raise failure


def resolve_connectivity(root: Field, bricks: Bricks, least: float, loose: bool, work: Work) -> Bricks:
    """Resample an object finer if its samples may miss walls or gaps: two samples across the thinnest.

    A plate thicker than sqrt 3 samples is not pierced, whatever its tilt (Andres, Acharya and Sibata 1997,
    "Discrete analytical hyperplanes"). A fractal has walls of every thickness; it is resampled only if it
    appears disconnected.

    `least`: squared scene units.
    """
    times = AGAIN if loose else 1.0
    if not root.bounds.exterior_only:
        walls, gaps = thin_features(root, Samples(bricks), work)
        times = _times(bricks, walls.walls + gaps.walls, least, MOST * root.kernel().batch / Kernel.batch)
    if times <= 1:
        return bricks
    lattice = Lattice.around(Samples(bricks).bounds.box, bricks.voxel / times)
    kernel = root.kernel()
    return sample(kernel, root.bounds, lattice, work, kernel)


def _times(bricks: Bricks, thin: Walls, least: float, most: float) -> float:
    """Refinement factor for these walls and gaps, up to `most` bricks; 1 if fewer than `least` are thin."""
    voxel = bricks.voxel
    if thin.chosen(thin.width < 2 * voxel).area.sum() < least:
        return 1.0
    count = max(len(bricks), float(thin.area.sum()) / (BRICK * voxel) ** 2)
    (thinnest,) = weighted_quantiles(thin.width, thin.area, 0.01)
    return float(min(2 * voxel / thinnest, (most / count) ** 0.5))
