"""Walls and gaps too thin for samples: they pass between them, or show in some only.

The field is sampled once more, less `NEAR` voxels, so that each wall is as much thicker on both sides and no
longer fits between samples. From there rays follow the normal inwards, now on the field itself: to where the
object begins, and on to where it ends. For gaps all is the other way round.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..compiled import compiled
from ..errors import VolumeError
from ..kernel import Field, Kernel
from ..rows import Rows
from ..volume import Lattice, sample
from ..volume.values import values_at
from ..work import Work
from .faces import slopes
from .offset_field import OffsetField
from .samples import Samples
from .walls import AT_ONCE, OPPOSITE, Direction, Walls, crossed, gathered, walls

NEAR = 0.9
"""Voxels: more than from any point to the nearest sample, half the diagonal."""

BEFORE = 0.8
"""Voxels from where a ray begins in which it enters nothing."""

THIN = 3.0
"""Voxels: what is thicker is measured by samples, too."""

STEP = 0.05
"""Voxels: the least step along a ray; a wall or gap as thin as that may still be missed."""

SLACK = 0.25
"""Voxels before a thick wall or gap in which nothing else is looked for."""

ROUNDS = 400

RAYS = 1 << 13
"""At a time, by one thread."""


@dataclass(frozen=True, eq=False)
class ThinFeatures:
    """Walls, or gaps, that are thin, right within a hundredth of a voxel. replaces: below which width (scene
    units) they stand for what the samples tell; 0 where the samples are right, and these are what they miss.
    """

    walls: Walls
    replaces: float

    def beside(self, sampled: Walls, limit: float, direction: Direction | None = None) -> Walls:
        """All walls up to `limit` scene units: these, measured along a direction if there is one, and sampled
        ones.
        """
        mine = self.walls if direction is None else self.walls.along(direction)
        return sampled.chosen(sampled.width >= self.replaces) + mine.chosen(mine.width < limit)


def thin_features(root: Field, seen: Samples, work: Work) -> tuple[ThinFeatures, ThinFeatures]:
    """The thin walls and gaps of an object, also those that its samples miss.

    root: all depths known. seen: samples of it. The values of escape-time fractals
    are far from distances: there the samples are better, and only what they miss is looked for. A gap between
    walls that are themselves thin is found behind them.
    """
    look = _Look(root, seen, THIN * seen.bricks.voxel, work)
    return look.told(look.walls()), look.told(look.gaps())


@dataclass(frozen=True, eq=False)
class _Rays(Rows):
    """From beside a surface through it. start, ways: float64 [n, 3]; area: [n], of the surface that each
    stands for; enter, leave: [n], how far along the thin wall or gap begins and ends.
    """

    start: np.ndarray
    ways: np.ndarray
    area: np.ndarray
    enter: np.ndarray
    leave: np.ndarray

    def points(self, s: np.ndarray) -> np.ndarray:
        """So far along each, [3, n]."""
        return np.asarray(self.start.T + s * self.ways.T)


@dataclass(frozen=True, eq=False)
class _Look:
    """What is looked at, what its samples tell, and how thick walls and gaps are at most, scene units."""

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

    def told(self, found: Walls) -> ThinFeatures:
        """Walls or gaps that were found, and what they are better than."""
        return ThinFeatures(found, 0.0 if self.root.bounds.exterior_only else self.most)

    @cached_property
    def inwards(self) -> _Rays:
        """Through all thin walls."""
        return self.rays(1.0)

    def walls(self) -> Walls:
        """Thin walls."""
        return self.facing(self.inwards)

    def gaps(self) -> Walls:
        """Thin gaps: what is seen of them from within thick walls; and behind thin ones, also behind those
        that follow, where they are so near each other that no ray starts between them.
        """
        found, rays = self.from_within(), self.inwards
        while len(rays.start):
            gap = self.stretch(rays, rays.leave, 1.0)
            gap = self.missed(gap, gap.enter)
            gap = self.missed(gap, gap.leave)
            found = found + self.facing(gap)
            near = gap.chosen(gap.leave - gap.enter < 2 * NEAR * self.voxel)
            rays = self.stretch(near, near.leave, -1.0)
        return found

    def from_within(self) -> Walls:
        """Thin gaps seen from thick walls."""
        try:
            rays = self.rays(-1.0)
        except VolumeError:  # all walls are thin
            return Walls.none()
        limit = np.full(len(rays.start), self.most)
        back = self.first(replace(rays, ways=-rays.ways), 0 * limit, limit, -1.0)
        return self.facing(rays.chosen(rays.enter + back > limit))

    def stretch(self, rays: _Rays, begin: np.ndarray, sign: float) -> _Rays:
        """The rays on which the field times `sign`, which is positive from `begin` on, is negative within
        `most`; entered at the one, left at the other.
        """
        end = begin + self.most
        leave = self.first(rays, begin, end, sign)
        return replace(rays, enter=begin, leave=leave).chosen(leave < end)

    def rays(self, sign: float) -> _Rays:
        """Through all thin walls (sign 1), or from within all others through thin gaps (-1)."""
        reach = NEAR * self.voxel * self.root.bounds.lipschitz
        offset_field = self.offset_field(sign * reach)

        def look(rows: slice) -> _Rays:
            start, normals, area = crossed(offset_field, rows)
            far = np.full(len(start), 2 * (reach + self.voxel))
            rays = self.limited(_Rays(start, -sign * normals, area, 0 * area, far), sign)
            enter = self.first(rays, np.full(len(rays.start), BEFORE * self.voxel), rays.leave, sign)
            rays = replace(rays, enter=enter).chosen(enter < rays.leave)
            return self.stretch(rays, rays.enter, -sign)

        return gathered(look, len(offset_field.bricks), AT_ONCE, self.work)

    def limited(self, rays: _Rays, sign: float) -> _Rays:
        """Those that may enter something thin, up to where they leave. Of a field whose values tell distances
        these are all that may leave within `most` what they enter, `NEAR` voxels from where they begin at
        least: most others are as far from any surface halfway. Of a fractal they end where the samples know
        of a surface.
        """
        if self.root.bounds.exterior_only:
            end = self.seen.free(rays.start, rays.ways, rays.leave)
            return replace(rays, leave=end).chosen(end > BEFORE * self.voxel)
        half = self.most / 2
        middle = np.full(len(rays.start), (NEAR + SLACK) * self.voxel + half)
        f = sign * self.field(rays.points(middle))
        return rays.chosen(~(f <= -half * self.root.bounds.lipschitz))

    def missed(self, rays: _Rays, s: np.ndarray) -> _Rays:
        """Those that are to be looked at so far along: of a fractal, at what its samples miss."""
        if not self.root.bounds.exterior_only:
            return rays
        begin = rays.points(s).T
        return rays.chosen(self.seen.free(begin, rays.ways, np.full(len(begin), self.voxel)) > 0)

    def offset_field(self, by: float) -> Samples:
        """Samples of the field less `by`: the flatter it is, the farther its inside reaches from the box."""
        for times in (2, 8, 32):
            try:
                box = (self.root.bounds.box | self.seen.bounds.box).grown(times * abs(by))
                bounds, lattice = replace(self.root.bounds, box=box), Lattice.around(box, self.voxel)
                return Samples(sample(OffsetField(self.root, by).kernel(), bounds, lattice, self.work))
            except VolumeError as error:
                failure = error
        raise failure

    def first(self, rays: _Rays, begin: np.ndarray, end: np.ndarray, sign: float) -> np.ndarray:
        """How far along each ray the field times `sign` is first below zero from `begin` on; beyond `end`
        where it never is.
        """

        def field(which: np.ndarray, s: np.ndarray) -> np.ndarray:
            return sign * self.field(_points(rays.start, rays.ways, which, s))

        return _first(field, begin, end, self.root.bounds.lipschitz, STEP * self.voxel)

    def field(self, points: np.ndarray) -> np.ndarray:
        """At points [3, n]."""
        return values_at(self.kernel, points, self.work)

    def facing(self, rays: _Rays) -> Walls:
        """Those whose two faces are turned away from each other."""

        def look(part: slice) -> Walls:
            some = rays.chosen(part)
            ends = [some.points(s) for s in (some.enter, some.leave)]
            facing = (self.normals(ends[0]) * self.normals(ends[1])).sum(0)
            found = Walls(ends[0].T, ends[1].T, some.leave - some.enter, some.area)
            return found.chosen(facing < OPPOSITE)

        return gathered(look, len(rays.start), RAYS, self.work)

    def normals(self, points: np.ndarray) -> np.ndarray:
        """Unit normals of the field itself at points [3, n], [3, n]."""
        return slopes(self.kernel, points, STEP * self.voxel, self.work)[1]


def all_walls(root: Field, seen: Samples, limit: float, work: Work, *, gaps: bool = False) -> Walls:
    """The walls or gaps up to `limit` scene units, whether the samples tell of them or the field alone."""
    exterior_only, most = root.bounds.exterior_only, THIN * seen.bricks.voxel
    look = _Look(root, seen, most if exterior_only else max(most, limit), work)
    found = look.gaps() if gaps else look.walls()
    if exterior_only:
        found = walls(seen, limit, work, gaps=gaps) + found
    return found.chosen(found.width < limit)


@compiled
def _points(start, ways, which, s):  # type: ignore[no-untyped-def]
    """So far along some rays, [3, n]."""
    points = np.empty((3, len(s)))
    for i in range(len(s)):
        for axis in range(3):
            points[axis, i] = start[which[i], axis] + s[i] * ways[which[i], axis]
    return points


def _first(
    field: Callable[[np.ndarray, np.ndarray], np.ndarray],
    begin: np.ndarray,
    end: np.ndarray,
    bound: float,
    least: float,
) -> np.ndarray:
    """Where a field on rays, of their numbers and of how far along, is first below zero after `begin`: in
    steps of the distance (sphere tracing, Hart 1996), the last one of `least`, in which it is taken for
    straight. Beyond `end` where it never is.
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
    found = s < end
    share = low[found] / (low[found] - high[found])
    s[found] -= share * (s[found] - before[found])
    return s
