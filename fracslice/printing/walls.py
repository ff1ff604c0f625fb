"""Thickness of a sampled solid, width of its gaps, measured from surface to surface; statistics.

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

from ..common.arrays import Rows, weighted_quantiles
from ..fields.field import Field, Kernel
from ..volume.bricks import values_at
from ..work import Work, chunks
from .samples import Samples


def edge_crossings(solid: Samples, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Crossings of the surface with grid edges that begin in the bricks of these rows.

    A smooth surface has one crossing for each grid line along the axis nearest to its normal.

    Returns points, normals float64 [n, 3], scene units; area float64 [n], squared scene units.
    """
    return solid.native.crossings(rows)


def slopes(kernel: Kernel, points: np.ndarray, step: float, work: Work) -> tuple[np.ndarray, np.ndarray]:
    """Gradient of a field by central differences.

    `points`: float64 [3, n], scene units; `step` in scene units. Returns length, normals [n], [3, n].
    """
    shifts = step * np.eye(3)[:, :, None]
    slope = np.stack(
        [values_at(kernel, points + s, work) - values_at(kernel, points - s, work) for s in shifts]
    )
    length = np.maximum(np.linalg.norm(slope, axis=0), 1e-30)
    return length / (2 * step), slope / length


OPPOSITE = -0.5
"""Maximum cosine between the normals of the two faces of a wall: wedges up to 60 degrees count."""

AT_ONCE = 512
"""Bricks processed at a time by one thread."""

Direction = tuple[float, float, float]
R = TypeVar("R", bound=Rows)


@dataclass(frozen=True, eq=False)
class Walls(Rows):
    """Walls or gaps thinner than a limit. Lengths in scene units."""

    start: np.ndarray  # points on the two faces
    end: np.ndarray
    width: np.ndarray  # distance between them
    area: np.ndarray  # surface that each represents
    facing: np.ndarray  # cosine between the normals of the faces: -1 where they are parallel

    @property
    def middle(self) -> np.ndarray:
        """Midpoints between the faces, float64 [n, 3]."""
        return np.asarray((self.start + self.end) / 2)

    @classmethod
    def none(cls) -> Walls:
        """An empty record."""
        return cls(*np.empty((2, 0, 3)), *np.empty((3, 0)))

    def along(self, direction: Direction) -> Walls:
        """Walls whose faces look along a direction or against it, measured along it."""
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
    rows: np.ndarray | None = None,
) -> Walls:
    """Measure walls, or gaps, on samples; with `rows`, those that begin in these bricks.

    Widths are accurate to one voxel. Features thinner than a voxel appear only where they contain a sample,
    see `thin_features`.

    `limit` in scene units.
    """
    (one,) = walls_of(solid, limit, work, [Measure(gaps)], rows)
    return one


@dataclass(frozen=True)
class Measure:
    """How walls are measured."""

    gaps: bool = False  # measure gaps instead of walls
    least: float = 0.0  # leave out what is narrower, scene units
    # measure along this unit vector instead of the normal, through faces that look along it or against it
    direction: Direction | None = None


def walls_of(
    solid: Samples, limit: float, work: Work, kinds: Sequence[Measure], rows: np.ndarray | None = None
) -> list[Walls]:
    """Measure several kinds of walls from the same crossings of grid edges, of all bricks or of some."""
    chosen = np.arange(len(solid.bricks)) if rows is None else rows

    def look(part: slice) -> list[Walls]:
        crossings = edge_crossings(solid, chosen[part])
        return [_measure_walls(solid, limit, work, how, *crossings) for how in kinds]

    blocks = work.collect(look, chunks(len(chosen), AT_ONCE) or [slice(0, 0)])
    return [Walls.joined(list(parts)) for parts in zip(*blocks, strict=True)]


def _measure_walls(
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
    width = solid.native.through(points, directions, limit, towards)
    thin = (how.least <= width) & (width < limit) & (np.abs((normals * directions).sum(1)) > -OPPOSITE)
    points, normals, directions, width = points[thin], normals[thin], directions[thin], width[thin]
    ends = points + width[:, None] * directions
    exact = solid.kernel("cpu", "float64")
    opposite = slopes(exact, ends.T, solid.bricks.voxel / 2, work)[1].T
    facing = (opposite * normals).sum(1)
    return Walls(points, ends, width, area[thin], facing).chosen(facing < OPPOSITE)


def in_blocks(look: Callable[[slice], R], count: int, size: int, work: Work) -> R:
    """Process rows in blocks on all threads and join the results in order."""
    result = work.collect(look, chunks(count, size) or [slice(0, 0)])
    return type(result[0]).joined(result)


STEP = 0.05
"""Step of central differences, voxels."""

AWAY = 0.5
"""Maximum displacement of a face, voxels."""


def project_faces(root: Field, walls: Walls, voxel: float, work: Work) -> Walls:
    """Project the faces of walls or gaps to the surface, along the wall.

    Walls whose faces do not look away from each other there are dropped: they are artefacts of features
    thinner than a voxel. Walls of escape-time fractals are returned unchanged: samples are more accurate than
    values.

    `voxel` in scene units.
    """
    if root.bounds.exterior_only or not len(walls.width):
        return walls
    kernel, directions = root.kernel(), ((walls.end - walls.start) / walls.width[:, None]).T
    ends, normals = [], []
    for points in (walls.start.T, walls.end.T):
        steep, normal = slopes(kernel, points, STEP * voxel, work)
        along = steep * (normal * directions).sum(0)
        shift = -values_at(kernel, points, work) / np.where(np.abs(along) > -OPPOSITE * steep, along, np.inf)
        ends.append(points + np.clip(shift, -AWAY * voxel, AWAY * voxel) * directions)
        normals.append(normal)
    across = [np.abs((normal * directions).sum(0)) > -OPPOSITE for normal in normals]
    facing = (normals[0] * normals[1]).sum(0)
    width = ((ends[1] - ends[0]) * directions).sum(0)
    stays = np.where(across[0] & across[1], facing < OPPOSITE, across[0] | across[1]) & (width > 0)
    return Walls(ends[0].T, ends[1].T, width, walls.area, facing).chosen(stays)


BINS = 0.05 * np.arange(41)
"""Bin edges of the histogram, mm; the last bin includes everything thicker."""


@dataclass(frozen=True)
class Widths:
    """Statistics of the widths of walls or gaps, mm."""

    smallest: float  # minimum, first percentile and median
    thinnest_hundredth: float
    median: float
    # weight in each bin: pixels of medial axes in layers, mm^2 of surface in solids
    counts: tuple[float, ...]
    edges: tuple[float, ...] = tuple(round(float(b), 3) for b in BINS)  # edges of the bins


def widths_of(values: np.ndarray, weights: np.ndarray | None = None) -> Widths | None:
    """Summarise widths.

    `values`: float64 [n], mm; `weights`: float64 [n], optional.
    """
    if not len(values):
        return None
    weight = np.ones(len(values)) if weights is None else weights
    low, hundredth, middle = weighted_quantiles(values, weight, 0, 0.01, 0.5)
    counts = np.histogram(np.minimum(values, BINS[-1] - 1e-9), BINS, weights=weights)[0]
    return Widths(low, hundredth, middle, tuple(counts.tolist()))
