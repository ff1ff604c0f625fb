"""Walls and gaps too thin for samples: they pass between them, or show in some only.

The field is sampled once more, less `NEAR` voxels, so that each wall is as much thicker on both sides and no
longer fits between samples. From there rays follow the normal inwards, now on the field itself: to where the
object begins, and on to where it ends. For gaps all is the other way round.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ..errors import VolumeError
from ..formulas import Box, Node
from ..formulas.registry import Facts
from ..kernel import Compilable, Kernel, compile_scene
from ..volume import Bricks, Lattice, sample
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


def slender(root: Node | Compilable, seen: Samples, work: Work, *, gaps: bool = False) -> Slender:
    """The thin walls or gaps of an object, also those that its samples miss.

    root: all depths known. seen: the distances that were sampled of it. The values of escape-time fractals
    are far from distances: there the samples are better, and only what they miss is looked for. A gap between
    walls that are themselves thinner than a voxel or two is not found: there is nothing to look from.
    """
    b, kernel, towards = seen.bricks, compile_scene(root), -1.0 if gaps else 1.0
    bound, reach = root.facts.lipschitz, NEAR * b.voxel * root.facts.lipschitz
    moved = Raised(kernel, towards * reach)
    raised = Samples(_raised(moved, root.facts, root.facts.box | seen.box, b.voxel, work))
    start, axis = crossed(raised)
    normals = normals_at(raised, start)
    ways = -towards * normals
    area = b.voxel**2 * np.abs(np.take_along_axis(normals, axis[:, None], 1)[:, 0])
    field = _along(kernel, start, ways, work)
    least = STEP * b.voxel
    far = 2 * reach + 2 * b.voxel
    enter = _first(field, np.arange(len(start)), np.zeros(len(start)), far, towards, bound, least)
    unknown = np.abs(seen.points(*(start + enter[:, None] * ways).T)) > AWAY * b.voxel
    rays = np.flatnonzero((enter < far) & (unknown | (not root.facts.weak)))
    leave = _first(field, rays, enter[rays], enter[rays] + THIN * b.voxel, -towards, bound, least)
    thin = leave < enter[rays] + THIN * b.voxel
    rays, leave = rays[thin], leave[thin]
    ends = [start[rays] + s[:, None] * ways[rays] for s in (enter[rays], leave)]
    facing = (_slopes(kernel, ends[0], least, work) * _slopes(kernel, ends[1], least, work)).sum(1)
    found = Walls(ends[0], ends[1], leave - enter[rays], area[rays])
    return Slender(found.chosen(facing < OPPOSITE), 0.0 if root.facts.weak else THIN * b.voxel)


def all_walls(
    root: Node | Compilable, seen: Samples, limit: float, work: Work, *, gaps: bool = False
) -> Walls:
    """The walls or gaps up to `limit` scene units, whether the samples tell of them or the field alone."""
    return slender(root, seen, work, gaps=gaps).beside(walls(seen, limit, work, gaps=gaps), limit)


def _raised(kernel: Raised, facts: Facts, box: Box, voxel: float, work: Work) -> Bricks:
    """Samples of a raised field: the flatter it is, the farther its inside reaches beyond the box."""
    for times in (2, 8, 32):
        try:
            wide = replace(facts, box=box.grown(times * abs(kernel.by)))
            return sample(kernel, wide, Lattice.around(wide.box, voxel), work)
        except VolumeError as error:
            failure = error
    raise failure


Along = Callable[[np.ndarray, np.ndarray], np.ndarray]


def _along(kernel: Kernel, start: np.ndarray, ways: np.ndarray, work: Work) -> Along:
    """The field on rays by their numbers and how far along."""
    return lambda rays, s: values_at(kernel, (start[rays] + s[:, None] * ways[rays]).T, work)


def _first(
    field: Along,
    rays: np.ndarray,
    begin: np.ndarray,
    end: np.ndarray | float,
    sign: float,
    bound: float,
    least: float,
) -> np.ndarray:
    """How far along each ray the field times `sign` is first below zero from `begin` on; beyond `end` where
    it never is. In steps of the distance (sphere tracing, Hart 1996), then by bisection.
    """
    s, before = begin.copy(), begin.copy()
    end = np.broadcast_to(end, s.shape)
    todo = np.arange(len(s))
    for _ in range(ROUNDS):
        f = sign * field(rays[todo], s[todo])
        todo, f = todo[f >= 0], f[f >= 0]
        before[todo] = s[todo]
        s[todo] += np.maximum(f / bound, least)
        todo = todo[s[todo] < end[todo]]
        if not len(todo):
            break
    found = np.flatnonzero((s < end) & (s > begin))
    for _ in range(HALVINGS):
        middle = (before[found] + s[found]) / 2
        low = sign * field(rays[found], middle) < 0
        s[found], before[found] = np.where(low, middle, s[found]), np.where(low, before[found], middle)
    return s


def _slopes(kernel: Kernel, points: np.ndarray, step: float, work: Work) -> np.ndarray:
    """Unit normals of the field itself, [n, 3]."""
    shifts = step * np.eye(3)
    slope = np.stack(
        [values_at(kernel, (points + s).T, work) - values_at(kernel, (points - s).T, work) for s in shifts], 1
    )
    unit: np.ndarray = slope / np.maximum(np.linalg.norm(slope, axis=1), 1e-30)[:, None]
    return unit


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
