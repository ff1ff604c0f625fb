"""Thickness of a sampled solid and width of its gaps, measured from surface to surface.

From each crossing of a grid edge a ray follows the normal to the opposite surface, in steps of the distance
(sphere tracing, Hart 1996). Its length is the thickness of the wall there if the two faces look away from
each other. So the edge of a cube is not a thin wall, as it would be for inscribed spheres (Hildebrand and
Rüegsegger 1997), and a plate is as thick at its rim as in its middle. This is the shape diameter function
(Shapira, Shamir and Cohen-Or 2008) with one ray.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from ..common.compiled import compiled
from ..common.rows import Rows
from ..work import Work, chunks
from .edge_crossings import edge_crossings, slopes
from .interpolation import STRIDE, between, is_beside
from .samples import Samples

OPPOSITE = -0.5
"""Maximum cosine between the normals of the two faces of a wall: wedges up to 60 degrees count."""

AT_ONCE = 512
"""Bricks processed at a time by one thread."""

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
    facing : float64 [n]
        Cosine between the normals of the faces: -1 where they are parallel.
    """

    start: np.ndarray
    end: np.ndarray
    width: np.ndarray
    area: np.ndarray
    facing: np.ndarray

    @property
    def middle(self) -> np.ndarray:
        """Midpoints between the faces, float64 [n, 3]."""
        return np.asarray((self.start + self.end) / 2)

    @classmethod
    def none(cls) -> Walls:
        """An empty record."""
        return cls(*np.empty((2, 0, 3)), *np.empty((3, 0)))

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
        span = self.end - self.start
        share = (span * direction).sum(1) / np.linalg.norm(span, axis=1)
        width = self.width / np.maximum(np.abs(share), 1e-9)
        end = self.start + np.copysign(width, share)[:, None] * np.array(direction)
        return replace(self, end=end, width=width).chosen(np.abs(share) > -OPPOSITE)


def walls(
    solid: Samples,
    limit: float,
    work: Work,
    *,
    gaps: bool = False,
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

    Returns
    -------
    Walls
        Walls or gaps thinner than `limit`.

    Raises
    ------
    Cancelled
        When the work is cancelled.
    """
    (one,) = walls_of(solid, limit, work, [Measure(gaps)])
    return one


@dataclass(frozen=True)
class Measure:
    """How walls are measured.

    Attributes
    ----------
    gaps : bool
        Measure gaps instead of walls.
    direction : three floats, optional
        Measure along this unit vector instead of the normal, through faces that look along it or against it.
    """

    gaps: bool = False
    direction: Direction | None = None


def walls_of(solid: Samples, limit: float, work: Work, kinds: Sequence[Measure]) -> list[Walls]:
    """Measure several kinds of walls from the same crossings of grid edges.

    Parameters
    ----------
    solid, limit, work
        As for `walls`.
    kinds : sequence of Measure
        How each is measured.

    Raises
    ------
    Cancelled
        When the work is cancelled.
    """

    def look(rows: slice) -> list[Walls]:
        crossings = edge_crossings(solid, rows)
        return [_measured(solid, limit, work, how, *crossings) for how in kinds]

    blocks = work.collect(look, chunks(len(solid.bricks), AT_ONCE) or [slice(0, 0)])
    return [Walls.joined(list(parts)) for parts in zip(*blocks, strict=True)]


def _measured(
    solid: Samples,
    limit: float,
    work: Work,
    how: Measure,
    points: np.ndarray,
    normals: np.ndarray,
    area: np.ndarray,
) -> Walls:
    """Walls at crossings of grid edges."""
    towards = -1.0 if how.gaps else 1.0
    directions = -towards * normals
    if how.direction is not None:
        upright = np.copysign(1, (directions * how.direction).sum(1))
        directions = upright[:, None] * np.array(how.direction)
    width = np.empty(len(points))
    _through(points, directions, limit, towards, solid.grid, solid.beside, width)
    thin = (width < limit) & (np.abs((normals * directions).sum(1)) > -OPPOSITE)
    points, normals, directions, width = points[thin], normals[thin], directions[thin], width[thin]
    ends = points + width[:, None] * directions
    exact = solid.kernel("cpu", "float64")
    opposite = slopes(exact, ends.T, solid.bricks.voxel / 2, work)[1].T
    facing = (opposite * normals).sum(1)
    return Walls(points, ends, width, area[thin], facing).chosen(facing < OPPOSITE)


def in_blocks(look: Callable[[slice], R], count: int, size: int, work: Work) -> R:
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
    result = work.collect(look, chunks(count, size) or [slice(0, 0)])
    return type(result[0]).joined(result)


@compiled
def _through(points, directions, limit, towards, grid, beside, width):  # type: ignore[no-untyped-def]
    """Write the distance along each ray to the opposite surface; twice the limit if it is farther."""
    x0, y0, z0, voxel, _, index, values, bounds = grid
    for n in range(len(points)):
        x, y, z = (points[n, 0] - x0) / voxel, (points[n, 1] - y0) / voxel, (points[n, 2] - z0) / voxel
        s, before = FIRST, 0.0
        width[n] = 2 * limit
        while s < limit / voxel + 1:
            u, v, w = x + s * directions[n, 0], y + s * directions[n, 1], z + s * directions[n, 2]
            f = -1.0
            if is_beside(u, v, w, index, beside):
                f = towards * between(u, v, w, voxel, index, bounds, values)
            if f >= 0:
                width[n] = voxel * (s - (STRIDE * f / (f - before) if before < 0 else 0.0))
                break
            before, s = f, s + STRIDE
