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

from ..errors import VolumeError
from ..formulas import Node
from ..kernel import Compilable, Kernel, compile_scene
from ..rows import Rows
from ..volume import Lattice, sample
from ..volume.values import values_at
from ..work import Work
from .samples import Samples
from .walls import OPPOSITE, Direction, Walls, crossed, normals_at, walls

NEAR = 0.9
"""Voxels: more than from any point to the nearest sample, half the diagonal."""

AWAY = 0.75
"""Voxels from the surface that the samples know, at least, that make another surface."""

THIN = 3.0
"""Voxels: what is thicker is measured by samples."""

STEP = 0.05
"""Voxels: the least step along a ray; a wall or gap as thin as that may still be missed."""

ROUNDS = 400
HALVINGS = 16


@dataclass(frozen=True, eq=False)
class Slender:
    """Walls, or gaps, up to `THIN` voxels thick, right within a hundredth of one. replaces: below which width
    (scene units) they stand for what the samples tell; 0 where the samples are right, and these are what they
    miss.
    """

    walls: Walls
    replaces: float

    def beside(self, sampled: Walls, limit: float, direction: Direction | None = None) -> Walls:
        """All walls up to `limit` scene units: these, measured along a direction if there is one, and sampled
        ones.
        """
        mine = self.walls if direction is None else self.walls.along(direction)
        return sampled.chosen(sampled.width >= self.replaces) + mine.chosen(mine.width < limit)


def slender(root: Node | Compilable, seen: Samples, work: Work) -> tuple[Slender, Slender]:
    """The thin walls and gaps of an object, also those that its samples miss.

    root: all depths known. seen: the distances that were sampled of it. The values of escape-time fractals
    are far from distances: there the samples are better, and only what they miss is looked for. A gap between
    walls that are themselves thin is found behind them.
    """
    look = _Look(root, seen, work)
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


@dataclass(frozen=True, eq=False)
class _Look:
    """What is looked at, and what its samples tell."""

    root: Node | Compilable
    seen: Samples
    work: Work

    @cached_property
    def kernel(self) -> Kernel:
        return compile_scene(self.root)

    @property
    def voxel(self) -> float:
        return self.seen.bricks.voxel

    def told(self, found: Walls) -> Slender:
        """Walls or gaps that were found, and what they are better than."""
        return Slender(found, 0.0 if self.root.facts.weak else THIN * self.voxel)

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
            gap = gap.chosen(self.missed(gap, gap.enter) & self.missed(gap, gap.leave))
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
        limit = np.full(len(rays.start), THIN * self.voxel)
        back = self.first(replace(rays, ways=-rays.ways), 0 * limit, limit, -1.0)
        return self.facing(rays.chosen(rays.enter + back > limit))

    def stretch(self, rays: _Rays, begin: np.ndarray, sign: float) -> _Rays:
        """The rays on which the field times `sign`, which is positive from `begin` on, is negative within
        `THIN` voxels; entered at the one, left at the other.
        """
        end = begin + THIN * self.voxel
        leave = self.first(rays, begin, end, sign)
        return replace(rays, enter=begin, leave=leave).chosen(leave < end)

    def rays(self, sign: float) -> _Rays:
        """Through all thin walls (sign 1), or from within all others through thin gaps (-1)."""
        reach = NEAR * self.voxel * self.root.facts.lipschitz
        raised = self.raised(sign * reach)
        start, axis = crossed(raised)
        normals = normals_at(raised, start)
        area = self.voxel**2 * np.abs(np.take_along_axis(normals, axis[:, None], 1)[:, 0])
        far, none = np.full(len(start), 2 * reach + 2 * self.voxel), np.zeros(len(start))
        rays = _Rays(start, -sign * normals, area, none, none)
        enter = self.first(rays, none, far, sign)
        rays = replace(rays, enter=enter).chosen((enter < far) & self.missed(rays, enter))
        return self.stretch(rays, rays.enter, -sign)

    def missed(self, rays: _Rays, s: np.ndarray) -> np.ndarray:
        """Whether what is so far along each ray is to be looked at: of a fractal, what its samples miss."""
        known = np.abs(self.seen.points(*(rays.start + s[:, None] * rays.ways).T)) <= AWAY * self.voxel
        return np.asarray(~known | (not self.root.facts.weak))

    def raised(self, by: float) -> Samples:
        """Samples of the field less `by`: the flatter it is, the farther its inside reaches from the box."""
        for times in (2, 8, 32):
            try:
                box = (self.root.facts.box | self.seen.box).grown(times * abs(by))
                facts = replace(self.root.facts, box=box)
                return Samples(
                    sample(Raised(self.kernel, by), facts, Lattice.around(box, self.voxel), self.work)
                )
            except VolumeError as error:
                failure = error
        raise failure

    def first(self, rays: _Rays, begin: np.ndarray, end: np.ndarray, sign: float) -> np.ndarray:
        """How far along each ray the field times `sign` is first below zero from `begin` on; beyond `end`
        where it never is.
        """

        def field(which: np.ndarray, s: np.ndarray) -> np.ndarray:
            points = rays.start[which] + s[:, None] * rays.ways[which]
            return sign * values_at(self.kernel, points.T, self.work)

        return _first(field, begin, end, self.root.facts.lipschitz, STEP * self.voxel)

    def facing(self, rays: _Rays) -> Walls:
        """Those whose two faces are turned away from each other."""
        ends = [rays.start + s[:, None] * rays.ways for s in (rays.enter, rays.leave)]
        facing = (self.normals(ends[0]) * self.normals(ends[1])).sum(1)
        return Walls(ends[0], ends[1], rays.leave - rays.enter, rays.area).chosen(facing < OPPOSITE)

    def normals(self, points: np.ndarray) -> np.ndarray:
        """Unit normals of the field itself, [n, 3]."""
        shifts = STEP * self.voxel * np.eye(3)
        values = [[values_at(self.kernel, (points + w).T, self.work) for w in (s, -s)] for s in shifts]
        slope = np.stack([ahead - back for ahead, back in values], 1)
        unit: np.ndarray = slope / np.maximum(np.linalg.norm(slope, axis=1), 1e-30)[:, None]
        return unit


def all_walls(
    root: Node | Compilable, seen: Samples, limit: float, work: Work, *, gaps: bool = False
) -> Walls:
    """The walls or gaps up to `limit` scene units, whether the samples tell of them or the field alone."""
    look = _Look(root, seen, work)
    found = look.told(look.gaps() if gaps else look.walls())
    return found.beside(walls(seen, limit, work, gaps=gaps), limit)


def _first(
    field: Callable[[np.ndarray, np.ndarray], np.ndarray],
    begin: np.ndarray,
    end: np.ndarray,
    bound: float,
    least: float,
) -> np.ndarray:
    """Where a field on rays, of their numbers and of how far along, is first below zero: in steps of the
    distance (sphere tracing, Hart 1996), then by bisection.
    """
    s, before, todo = begin.copy(), begin.copy(), np.arange(len(begin))
    for _ in range(ROUNDS):
        f = field(todo, s[todo])
        todo, f = todo[f >= 0], f[f >= 0]
        before[todo] = s[todo]
        s[todo] += np.maximum(f / bound, least)
        todo = todo[s[todo] < end[todo]]
        if not len(todo):
            break
    found = np.flatnonzero((s < end) & (s > begin))
    for _ in range(HALVINGS):
        middle = (before[found] + s[found]) / 2
        low = field(found, middle) < 0
        s[found], before[found] = np.where(low, middle, s[found]), np.where(low, before[found], middle)
    return s


class Raised:
    """A kernel whose values are lower by a constant: its inside reaches farther, or less far."""

    def __init__(self, kernel: Kernel, by: float) -> None:
        self.kernel, self.by = kernel, by

    @property
    def dtype(self) -> np.dtype:
        return self.kernel.dtype

    @property
    def batch(self) -> int:
        return self.kernel.batch

    def points(self, x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
        """Field values at points, as `CpuKernel.points`."""
        f: np.ndarray = self.kernel.points(x, y, z) - self.dtype.type(self.by)
        return f

    def bricks(
        self, corners: np.ndarray, origin: tuple[float, float, float], voxel: float, out: np.ndarray
    ) -> None:
        """Field values on bricks, as `CpuKernel.bricks`."""
        self.kernel.bricks(corners, origin, voxel, out)
        out -= self.dtype.type(self.by)
