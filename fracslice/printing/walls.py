"""How thick a sampled solid is, and how wide its gaps: straight through, from surface to surface.

From each crossing of a grid edge a ray follows the normal until it comes out again, in steps of the distance
to the surface (sphere tracing, Hart 1996); its length is the wall's thickness there if the two faces are
turned away from each other. So the edge of a cube is no thin wall, as it would be to inscribed spheres
(Hildebrand and Rüegsegger 1997), and a plate is as thick at its rim as in its middle. It is the shape
diameter function (Shapira, Shamir and Cohen-Or 2008) with one ray.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from ..compiled import compiled
from ..rows import Rows
from ..work import Work, chunks
from .samples import Samples, interpolated, sample_at

OPPOSITE = -0.5
"""The cosine between the normals of two faces of a wall is at most this: wedges up to 60 degrees are walls.
"""

AT_ONCE = 512
"""Bricks whose surface is looked at by one thread at a time."""

ROOM = 8
"""Samples for each crossing that room is made for at first."""

Direction = tuple[float, float, float]
R = TypeVar("R", bound=Rows)


@dataclass(frozen=True, eq=False)
class Walls(Rows):
    """Walls or gaps that are thinner than a limit. start, end: float64 [n, 3], on the two faces; width:
    float64 [n]; area: float64 [n], the part of the surface that each stands for. Scene units.
    """

    start: np.ndarray
    end: np.ndarray
    width: np.ndarray
    area: np.ndarray

    @property
    def middle(self) -> np.ndarray:
        """Halfway between the faces, float64 [n, 3]."""
        return np.asarray((self.start + self.end) / 2)

    @classmethod
    def none(cls) -> Walls:
        """No walls at all."""
        return cls(*np.empty((2, 0, 3)), *np.empty((2, 0)))

    def along(self, direction: Direction) -> Walls:
        """Those whose faces look along a direction or against it, measured along it."""
        way = self.end - self.start
        share = (way * direction).sum(1) / np.linalg.norm(way, axis=1)
        width = self.width / np.maximum(np.abs(share), 1e-9)
        end = self.start + np.copysign(width, share)[:, None] * np.array(direction)
        return Walls(self.start, end, width, self.area).chosen(np.abs(share) > -OPPOSITE)


def walls(
    solid: Samples,
    limit: float,
    work: Work,
    *,
    gaps: bool = False,
    direction: Direction | None = None,
) -> Walls:
    """Walls, or gaps, up to `limit` scene units thick, of a field of distances.

    direction: measure along it instead of the normal, through faces that look along it or against it. Right
    within a voxel; what is thinner than one shows only where a sample lies in it, see `thin_features`.
    """
    b, towards = solid.bricks, -1.0 if gaps else 1.0

    def look(rows: slice) -> Walls:
        points, normals, area = crossed(solid, rows)
        ways = -towards * normals
        if direction is not None:
            ways = np.copysign(1, (ways * direction).sum(1))[:, None] * np.array(direction)
        width = np.empty(len(points))
        _through(
            points, ways, limit, towards, *b.origin, b.voxel, b.index, solid.brick_bounds, b.values, width
        )
        thin = (width < limit) & (np.abs((normals * ways).sum(1)) > -OPPOSITE)
        ends = points + width[:, None] * ways
        thin[thin] = (normals_at(solid, ends[thin]) * normals[thin]).sum(1) < OPPOSITE
        return Walls(points, ends, width, area).chosen(thin)

    return gathered(look, len(b), AT_ONCE, work)


def gathered(look: Callable[[slice], R], count: int, size: int, work: Work) -> R:
    """What is found by looking at `count` rows, `size` of them at a time, on all threads; in order."""
    found = work.collect(look, chunks(count, size) or [slice(0, 0)])
    return type(found[0]).joined(found)


def crossed(solid: Samples, rows: slice) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Where the surface crosses the edges of the grid that begin in some bricks, float64 [n, 3], its unit
    normals there, [n, 3], and how much of it each crossing stands for, [n], scene units.
    """
    b = solid.bricks
    own = b.values[rows]
    n, room = own.size // ROOM, -1
    while n > room:
        room = n
        points, normals = np.empty((2, room, 3))
        area = np.empty(room)
        n = _cross(
            b.ijk[rows], own, *b.origin, b.voxel, b.index, solid.brick_bounds, b.values, points, normals, area
        )
    return points[:n].copy(), normals[:n].copy(), area[:n].copy()


def normals_at(solid: Samples, points: np.ndarray) -> np.ndarray:
    """Unit normals by central differences over a voxel, [n, 3]."""
    b, normals = solid.bricks, np.empty(points.shape)
    _normals(points, *b.origin, b.voxel, b.index, solid.brick_bounds, b.values, normals)
    return normals


@compiled
def _cross(ijk, own, x0, y0, z0, voxel, index, brick_bounds, values, points, normals, area):  # type: ignore[no-untyped-def]
    """Writes what `crossed` returns, as much as there is room for, and returns how much there is."""
    n = 0
    for row in range(len(ijk)):
        for s in range(512):
            f = float(own[row, s])
            for axis in range(3):
                shift = 6 - 3 * axis
                u, v, w = _place(ijk, row, s)
                if (s >> shift) & 7 < 7:
                    g = float(own[row, s + (1 << shift)])
                else:
                    there = u + (axis == 0), v + (axis == 1), w + (axis == 2)
                    g = sample_at(index, brick_bounds, values, voxel, *there)
                if (f < 0) == (g < 0):
                    continue
                if n >= len(area):
                    n += 1
                    continue
                points[n] = x0 + voxel * u, y0 + voxel * v, z0 + voxel * w
                points[n, axis] += voxel * f / (f - g)
                x, y, z = points[n]
                normals[n] = _normal(x, y, z, x0, y0, z0, voxel, index, brick_bounds, values)
                area[n] = voxel * voxel * abs(normals[n, axis])
                n += 1
    return n


@compiled
def _place(ijk, row, s):  # type: ignore[no-untyped-def]
    """The grid index of a sample."""
    return ijk[row, 0] + (s >> 6), ijk[row, 1] + ((s >> 3) & 7), ijk[row, 2] + (s & 7)


@compiled
def _normals(points, x0, y0, z0, voxel, index, brick_bounds, values, normals):  # type: ignore[no-untyped-def]
    for n in range(len(points)):
        x, y, z = points[n]
        normals[n] = _normal(x, y, z, x0, y0, z0, voxel, index, brick_bounds, values)


@compiled
def _normal(x, y, z, x0, y0, z0, voxel, index, brick_bounds, values):  # type: ignore[no-untyped-def]
    h = voxel / 2
    u = interpolated(x + h, y, z, x0, y0, z0, voxel, index, brick_bounds, values)
    u -= interpolated(x - h, y, z, x0, y0, z0, voxel, index, brick_bounds, values)
    v = interpolated(x, y + h, z, x0, y0, z0, voxel, index, brick_bounds, values)
    v -= interpolated(x, y - h, z, x0, y0, z0, voxel, index, brick_bounds, values)
    w = interpolated(x, y, z + h, x0, y0, z0, voxel, index, brick_bounds, values)
    w -= interpolated(x, y, z - h, x0, y0, z0, voxel, index, brick_bounds, values)
    length = max(np.sqrt(u * u + v * v + w * w), 1e-30)
    return u / length, v / length, w / length


@compiled
def _through(points, ways, limit, towards, x0, y0, z0, voxel, index, brick_bounds, values, width):  # type: ignore[no-untyped-def]
    """How far it is to the other side; twice the limit where that is farther."""
    for n in range(len(points)):
        (x, y, z), (u, v, w) = points[n], ways[n]
        s, f, before = 0.1 * voxel, 0.0, 0.0
        width[n] = 2 * limit
        while s < limit + voxel:
            f = towards * interpolated(
                x + s * u, y + s * v, z + s * w, x0, y0, z0, voxel, index, brick_bounds, values
            )
            if f >= 0:
                break
            before, s = -f, s + max(-f, 0.1 * voxel)
        if f >= 0 and s < limit + voxel:
            step = max(before, 0.1 * voxel) if before > 0 else 0.0
            width[n] = s - step * f / (f + before) if before + f > 0 else s
