"""Thickness of a sampled solid and width of its gaps, measured from surface to surface.

From each crossing of a grid edge a ray follows the normal to the opposite surface, in steps of the distance
(sphere tracing, Hart 1996). Its length is the thickness of the wall there if the two faces look away from
each other. So the edge of a cube is not a thin wall, as it would be for inscribed spheres (Hildebrand and
Rüegsegger 1997), and a plate is as thick at its rim as in its middle. This is the shape diameter function
(Shapira, Shamir and Cohen-Or 2008) with one ray.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from ..compiled import compiled
from ..rows import Rows
from ..work import Work, chunks
from .samples import SIDE, STRIDE, Samples, between, gather, interpolated, is_beside

OPPOSITE = -0.5
"""Maximum cosine between the normals of the two faces of a wall: wedges up to 60 degrees count."""

AT_ONCE = 512
"""Bricks processed at a time by one thread."""

ROOM = 8
"""Samples per crossing in the first allocation."""

ALONG = 0.999
"""Fraction of a normal's largest component above which another component ties with it."""

FIRST = 0.1
"""First step along a ray, voxels, away from the surface that it starts on."""

Direction = tuple[float, float, float]
R = TypeVar("R", bound=Rows)


@dataclass(frozen=True, eq=False)
class Walls(Rows):
    """Walls or gaps thinner than a limit. Lengths in scene units.

    Attributes
    ----------
    start, end : float64 [n, 3]
        Points on the two faces.
    width : float64 [n]
        Distance between them.
    area : float64 [n]
        Surface that each represents.
    """

    start: np.ndarray
    end: np.ndarray
    width: np.ndarray
    area: np.ndarray

    @property
    def middle(self) -> np.ndarray:
        """Midpoints between the faces, float64 [n, 3]."""
        return np.asarray((self.start + self.end) / 2)

    @classmethod
    def none(cls) -> Walls:
        """An empty record.

        Returns
        -------
        Walls
            No walls.
        """
        return cls(*np.empty((2, 0, 3)), *np.empty((2, 0)))

    def along(self, direction: Direction) -> Walls:
        """Walls whose faces look along a direction or against it, measured along it.

        Parameters
        ----------
        direction : three floats
            A unit vector.

        Returns
        -------
        Walls
            The walls, with new ends and widths.
        """
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
    """Measure walls, or gaps, on samples.

    Widths are accurate to one voxel. Features thinner than a voxel appear only where they contain a sample,
    see `thin_features`.

    Parameters
    ----------
    solid : Samples
        The samples.
    limit : float
        Maximum width, scene units.
    work : Work
        Threads and cancellation.
    gaps : bool
        Measure gaps instead of walls.
    direction : three floats, optional
        Measure along this unit vector instead of the normal, through faces that look along it or against it.

    Returns
    -------
    Walls
        Walls or gaps thinner than `limit`.

    Raises
    ------
    Cancelled
        When the work is cancelled.
    """
    b, towards = solid.bricks, -1.0 if gaps else 1.0

    def look(rows: slice) -> Walls:
        points, normals, area = crossed(solid, rows)
        ways = -towards * normals
        if direction is not None:
            ways = np.copysign(1, (ways * direction).sum(1))[:, None] * np.array(direction)
        width = np.empty(len(points))
        _through(
            points,
            ways,
            limit,
            towards,
            *b.origin,
            b.voxel,
            b.index,
            solid.brick_bounds,
            b.values,
            solid.beside,
            width,
        )
        thin = (width < limit) & (np.abs((normals * ways).sum(1)) > -OPPOSITE)
        ends = points + width[:, None] * ways
        thin[thin] = (normals_at(solid, ends[thin]) * normals[thin]).sum(1) < OPPOSITE
        return Walls(points, ends, width, area).chosen(thin)

    return gathered(look, len(b), AT_ONCE, work)


def gathered(look: Callable[[slice], R], count: int, size: int, work: Work) -> R:
    """Process rows in blocks on all threads and join the results in order.

    Parameters
    ----------
    look : callable
        Returns a record for a slice of rows.
    count, size : int
        Number of rows, and rows in a block.
    work : Work
        Threads and cancellation.

    Returns
    -------
    Rows
        The joined records.

    Raises
    ------
    Cancelled
        When the work is cancelled.
    """
    found = work.collect(look, chunks(count, size) or [slice(0, 0)])
    return type(found[0]).joined(found)


def crossed(solid: Samples, rows: slice) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Crossings of the surface with grid edges that begin in some bricks.

    A smooth surface has one crossing for each grid line along the axis nearest to its normal.

    Parameters
    ----------
    solid : Samples
        The samples.
    rows : slice
        Rows of the bricks.

    Returns
    -------
    points, normals : float64 [n, 3]
        Crossings, scene units, and unit normals.
    area : float64 [n]
        Surface that each crossing represents, squared scene units.
    """
    b = solid.bricks
    begin, end, _ = rows.indices(len(b))
    n, room = (end - begin) * 512 // ROOM, -1
    while n > room:
        room = n
        points, normals = np.empty((2, room, 3))
        area = np.empty(room)
        n = _cross(
            begin,
            end,
            *b.origin,
            b.voxel,
            b.ijk,
            b.index,
            solid.brick_bounds,
            b.values,
            points,
            normals,
            area,
        )
    return points[:n].copy(), normals[:n].copy(), area[:n].copy()


def normals_at(solid: Samples, points: np.ndarray) -> np.ndarray:
    """Unit normals by central differences over a voxel.

    Parameters
    ----------
    solid : Samples
        The samples.
    points : float64 [n, 3]
        Points, scene units.

    Returns
    -------
    float64 [n, 3]
        Unit normals.
    """
    b, normals = solid.bricks, np.empty(points.shape)
    _normals(points, *b.origin, b.voxel, b.index, solid.brick_bounds, b.values, normals)
    return normals


@compiled
def _cross(begin, end, x0, y0, z0, voxel, ijk, index, brick_bounds, values, points, normals, area):  # type: ignore[no-untyped-def]
    """Write the results of `crossed` as far as the arrays reach; return the number of crossings."""
    n, f = 0, np.empty(SIDE**3, np.float32)
    for row in range(begin, end):
        gather(ijk, index, brick_bounds, values, row, f)
        for s in range(512):
            u, v, w = s >> 6, (s >> 3) & 7, s & 7
            at = (u + 1) * SIDE * SIDE + (v + 1) * SIDE + w + 1
            for axis in range(3):
                step = (SIDE * SIDE, SIDE, 1)[axis]
                if (f[at] < 0) == (f[at + step] < 0):
                    continue
                if n < len(area):
                    share = float(f[at]) / (float(f[at]) - float(f[at + step]))
                    points[n, 0] = x0 + voxel * (ijk[row, 0] + u)
                    points[n, 1] = y0 + voxel * (ijk[row, 1] + v)
                    points[n, 2] = z0 + voxel * (ijk[row, 2] + w)
                    points[n, axis] += voxel * share
                    _across(f, at, axis, share, normals[n])
                    along = abs(normals[n, axis])
                    if along < ALONG * np.abs(normals[n]).max():
                        continue
                    area[n] = voxel * voxel / along
                n += 1
    return n


@compiled
def _across(f, at, axis, share, normal):  # type: ignore[no-untyped-def]
    """Write the unit normal at `share` along an edge, by interpolated central differences over a voxel."""
    along = (SIDE * SIDE, SIDE, 1)[axis]
    total = 0.0
    for k in range(3):
        step = (SIDE * SIDE, SIDE, 1)[k]
        if k != axis:
            here, there = f[at + step] - f[at - step], f[at + along + step] - f[at + along - step]
            slope = ((1 - share) * here + share * there) / 2
        elif share < 0.5:
            middle = f[at] + (share + 0.5) * (f[at + along] - f[at])
            slope = middle - f[at - along] - (share + 0.5) * (f[at] - f[at - along])
        else:
            middle = f[at] + (share - 0.5) * (f[at + along] - f[at])
            slope = f[at + along] + (share - 0.5) * (f[at + 2 * along] - f[at + along]) - middle
        normal[k] = slope
        total += slope * slope
    normal /= max(np.sqrt(total), 1e-30)


@compiled
def _normals(points, x0, y0, z0, voxel, index, brick_bounds, values, normals):  # type: ignore[no-untyped-def]
    """Write the unit normals at points."""
    for n in range(len(points)):
        x, y, z = points[n]
        normals[n] = _normal(x, y, z, x0, y0, z0, voxel, index, brick_bounds, values)


@compiled
def _normal(x, y, z, x0, y0, z0, voxel, index, brick_bounds, values):  # type: ignore[no-untyped-def]
    """Unit normal at a point, by central differences over a voxel."""
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
def _through(points, ways, limit, towards, x0, y0, z0, voxel, index, brick_bounds, values, beside, width):  # type: ignore[no-untyped-def]
    """Write the distance along each ray to the opposite surface; twice the limit if it is farther."""
    for n in range(len(points)):
        x, y, z = (points[n, 0] - x0) / voxel, (points[n, 1] - y0) / voxel, (points[n, 2] - z0) / voxel
        s, before = FIRST, 0.0
        width[n] = 2 * limit
        while s < limit / voxel + 1:
            u, v, w = x + s * ways[n, 0], y + s * ways[n, 1], z + s * ways[n, 2]
            f = -1.0
            if is_beside(u, v, w, index, beside):
                f = towards * between(u, v, w, voxel, index, brick_bounds, values)
            if f >= 0:
                width[n] = voxel * (s - (STRIDE * f / (f - before) if before < 0 else 0.0))
                break
            before, s = f, s + STRIDE
