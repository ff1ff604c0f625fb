"""Thickness of walls and width of gaps, from surface to surface, in a sampled solid and in a mesh;
interpolation between samples, and connected components of the solid and what is around it.

From each crossing of a grid edge a ray follows the normal to the opposite surface, in steps of the distance
(sphere tracing, Hart 1996). Its length is the thickness of the wall there if the two faces look away from
each other. So the edge of a cube is not a thin wall, as it would be for inscribed spheres (Hildebrand and
Rüegsegger 1997), and a plate is as thick at its rim as in its middle. This is the shape diameter function
(Shapira, Shamir and Cohen-Or 2008) with one ray.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from .._native import SampledField, crossings_by_component, graph_components, least, solid_components
from .._native import thin_walls as _thin_walls
from ..common.arrays import Rows, weighted_quantiles
from ..common.cache import key
from ..common.messages import format_count, place
from ..fields.box import Box
from ..fields.devices import ArrayField
from ..fields.field import Bounds, Device, Field, Kernel, Precision
from ..records import PIECES, Print
from ..volume import Bricks, SignBricks
from ..volume.bricks import BRICK, INSIDE, OUTSIDE, values_at
from ..work import Work, chunks

LIPSCHITZ = 1.8
"""Lipschitz bound of interpolated distances: each of the three slopes is at most 1, never all at once."""


class Samples(ArrayField):
    """Bricks of samples as a field over all space.

    Values are trilinear between samples. Elsewhere they are signed lower bounds of the distance to the
    surface, from the number of bricks to the nearest samples. Safe to use from many threads.
    """

    def __init__(self, bricks: Bricks) -> None:
        self.bricks = bricks

    @cached_property
    def bounds(self) -> Bounds:
        """`Field.bounds`."""
        lo = np.asarray(self.bricks.origin)
        hi = lo + self.bricks.voxel * BRICK * np.array(self.bricks.index.shape)
        return Bounds(Box(tuple(lo.tolist()), tuple(hi.tolist())), LIPSCHITZ, False)

    @cached_property
    def key(self) -> str:
        """`Field.key`."""
        b = self.bricks
        return key(b.origin, b.voxel, b.ijk, b.values, b.index)

    def kernel(self, device: Device = "cpu", precision: Precision = "float32") -> Kernel:
        """`Field.kernel`, always on the CPU."""
        return _Interpolated(self, np.dtype(precision))

    @cached_property
    def native(self) -> SampledField:
        """Evaluator of the field."""
        b = self.bricks
        return SampledField(b.origin, b.voxel, b.ijk, b.values, b.index)

    def free(self, start: np.ndarray, directions: np.ndarray, far: np.ndarray) -> np.ndarray:
        """Distance along rays to the first grid cell that contains the surface.

        `start`, `directions`: float64 [n, 3], scene units; `far`: float64 [n], scene units. Returns float64
        [n].
        """
        return self.native.free(start, directions, far)

    def points(self, x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
        """Values at points.

        `x`, `y`, `z` in scene units.
        """
        u, v, w = (np.ascontiguousarray(a, np.float64).ravel() for a in (x, y, z))
        return self._interpolated(u, v, w).reshape(np.shape(x))

    def _interpolated(self, x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
        """Values at points [n], in scene units."""
        return self.native.values(x, y, z)


class _Interpolated(Kernel):
    """Kernel of a sampled field."""

    def __init__(self, samples: Samples, dtype: np.dtype) -> None:
        self._samples, self.dtype = samples, dtype

    def points(self, x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
        """`Kernel.points`."""
        return self._samples.points(x, y, z).astype(self.dtype, copy=False)


def together(solid: Bricks, added: Bricks) -> Bricks:
    """Unite two fields sampled on the same grid, possibly in different bricks."""
    shift = np.round((np.array(added.origin) - solid.origin) / (8 * solid.voxel)).astype(int)
    low = np.minimum(shift, 0)
    shape = np.maximum(shift + added.index.shape, solid.index.shape) - low
    rows, others = np.full((2, *shape), OUTSIDE, np.int32)
    for bricks, to, first in ((solid, rows, -low), (added, others, shift - low)):
        to[tuple(slice(f, f + n) for f, n in zip(first, bricks.index.shape, strict=True))] = bricks.index
    index = np.where((rows == INSIDE) | (others == INSIDE), INSIDE, np.maximum(rows, others)).astype(np.int32)
    sampled = index >= 0
    index[sampled] = np.arange(np.count_nonzero(sampled))
    values = least(solid.values, rows[sampled], added.values, others[sampled])
    x, y, z = (np.array(solid.origin) + 8 * solid.voxel * low).tolist()
    ijk = np.ascontiguousarray(8 * np.argwhere(sampled), np.int32)
    return Bricks((x, y, z), solid.voxel, ijk, values, index)


def rows_of(bricks: Bricks, others: Bricks) -> np.ndarray:
    """Rows of the bricks at the places of others, on the same grid; int64 [n]."""
    shift = np.round((np.array(others.origin) - bricks.origin) / (8 * bricks.voxel)).astype(int)
    rows = bricks.index[tuple((others.ijk // 8 + shift).T)]
    return np.asarray(rows[rows >= 0], np.int64)


def positions(bricks: Bricks, rows: np.ndarray, offsets: np.ndarray) -> np.ndarray:
    """Grid indices of samples.

    `rows`, `offsets`: int64 [n]. Returns int64 [n, 3].
    """
    inner = np.stack([offsets >> 6, offsets >> 3 & 7, offsets & 7], -1)
    place: np.ndarray = bricks.ijk[rows].astype(np.int64) + inner
    return place


@dataclass(frozen=True, eq=False)
class SolidComponents:
    """Connected components, numbered from 0. Number 0 is the space that extends beyond the samples."""

    solid: Bricks  # the samples
    labels: np.ndarray  # component of each sample
    tiles: np.ndarray  # component of each unsampled brick, -1 for sampled ones
    inside: np.ndarray  # true if the component is solid
    count: np.ndarray  # size of the component, samples

    @cached_property
    def bodies(self) -> np.ndarray:
        """Numbers of the solid components, int64 [k], the largest first."""
        return self._by_size(self.inside)

    @cached_property
    def cavities(self) -> np.ndarray:
        """Numbers of the enclosed empty components, int64 [k], the largest first."""
        empty = self._by_size(~self.inside)
        return np.asarray(empty[empty > 0])

    def _by_size(self, chosen: np.ndarray) -> np.ndarray:
        numbers = np.flatnonzero(chosen)
        return np.asarray(numbers[np.argsort(-self.count[numbers], kind="stable")])

    @property
    def crossings(self) -> np.ndarray:
        """Grid edges that cross the surface of each component, int64 [m]; zero for empty components."""
        solid, count = self.solid, len(self.inside)
        return crossings_by_component(solid.ijk, solid.values, solid.index, self.labels, count)

    @property
    def thin_share(self) -> float:
        """Share of the material in bodies whose mean thickness is below a voxel.

        Walls of this thickness fall between samples: their crumbs do not tell which bodies there are. The
        thickness is twice the volume by the area. The volume is a cubic voxel for each sample inside; the
        area is two thirds of a square voxel for each grid edge that crosses the surface, which is the mean
        over all directions (Cauchy-Crofton formula).
        """
        thin = self.inside & (self.crossings > 3 * self.count)
        return float(self.count[thin].sum() / self.count[self.inside].sum())

    @property
    def tells_bodies(self) -> bool:
        """Whether thin walls hold too little of the material to hide which bodies there are."""
        return self.thin_share < PIECES

    def box(self, numbers: np.ndarray) -> Box:
        """Bounding box of the samples of some components.

        `numbers`: int64 [k].
        """
        return Box.around(map(tuple, self.outermost(numbers).tolist()))

    def outermost(self, numbers: np.ndarray) -> np.ndarray:
        """Outermost samples of some components along -x, -y, -z, x, y and z.

        `numbers`: int64 [k]. Returns float64 [6, 3].
        """
        place = self.places(numbers)
        rows = np.concatenate([place.argmin(0), place.argmax(0)])
        return np.asarray(np.array(self.solid.origin) + self.solid.voxel * place[rows])

    def masks(self, numbers: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Masks of some components.

        `numbers`: int64 [k]. Returns samples, tiles bool [n, 512], bool [bx, by, bz].
        """
        chosen = np.zeros(len(self.inside) + 1, bool)
        chosen[numbers] = True
        return np.asarray(chosen[self.labels]), np.asarray(chosen[self.tiles])

    def filled(self, cavities: np.ndarray) -> SolidComponents:
        """Fill cavities. A body that floats in a cavity joins the body around it.

        `cavities`: int64 [k].
        """
        place = self.places(cavities)
        steps = np.vstack([np.eye(3, dtype=int), -np.eye(3, dtype=int)])
        beside = np.concatenate([self.at(place + step) for step in steps])
        number, count = graph_components(len(self.inside), np.tile(self.at(place), 6), beside)
        inside, sizes = np.zeros(count, bool), np.zeros(count, np.int64)
        inside[number[self.inside]] = True
        np.add.at(sizes, number, self.count)
        tiles = np.where(self.tiles >= 0, number[self.tiles], -1).astype(np.int32)
        solid = self._turned(cavities, -1.0, INSIDE)
        return SolidComponents(solid, number.astype(np.int32)[self.labels], tiles, inside, sizes)

    def sealed(self, before: SolidComponents) -> np.ndarray:
        """Cavities that were not cavities before.

        Returns int64 [k].
        """
        cavities = self.cavities
        place = self.places(cavities)
        points = np.array(self.solid.origin) + self.solid.voxel * place
        there = np.round((points - before.solid.origin) / before.solid.voxel).astype(np.int64)
        known = np.isin(before.at(there), before.cavities)
        return np.setdiff1d(cavities, self.at(place)[known])

    def places(self, numbers: np.ndarray) -> np.ndarray:
        """Samples of some components.

        `numbers`: int64 [k]. Returns int64 [n, 3].
        """
        return positions(self.solid, *np.nonzero(self.masks(numbers)[0]))

    def at(self, place: np.ndarray) -> np.ndarray:
        """Components at samples.

        `place`: int64 [n, 3]. Returns int64 [n].
        """
        brick = place >> 3
        within = np.all((brick >= 0) & (brick < self.solid.index.shape), axis=1)
        at = tuple(np.where(within[:, None], brick, 0).T)
        row = self.solid.index[at]
        label = np.where(row >= 0, self.labels[row, (place & 7) @ (64, 8, 1)], self.tiles[at])
        return np.where(within, label, 0).astype(np.int64)

    def without(self, bodies: np.ndarray) -> Bricks:
        """The solid without some bodies.

        `bodies`: int64 [k].
        """
        return self._turned(bodies, 1.0, OUTSIDE)

    def _turned(self, numbers: np.ndarray, sign: float, side: int) -> Bricks:
        """Move components to one side: samples to `sign` voxels from the surface, tiles to `side`."""
        samples, tiles = self.masks(numbers)
        values = np.where(samples, np.float32(sign * self.solid.voxel), self.solid.values)
        return replace(self.solid, values=values, index=np.where(tiles, np.int32(side), self.solid.index))


def sign_samples(signs: SignBricks) -> Bricks:
    """Signs as samples, int8: -1 inside, else 0."""
    inside = np.unpackbits(signs.signs.reshape(-1), bitorder="little").view(np.int8)
    values = np.negative(inside, out=inside).reshape(-1, 512)
    return Bricks(signs.origin, signs.voxel, signs.ijk, values, signs.index)


def components_of(bricks: Bricks) -> SolidComponents:
    """Label the connected components of a sampled solid, in time linear in the samples.

    Samples are connected along edges of the grid: solids that touch only along a line are not connected. An
    unsampled brick is connected as a whole (union-find, Tarjan 1975).
    """
    of, sizes, inside = solid_components(bricks.ijk, bricks.values, bricks.index)
    size, empty = bricks.values.size, bricks.index < 0
    labels, tiles = of[1 : 1 + size].reshape(bricks.values.shape), np.full(empty.shape, -1, of.dtype)
    tiles[empty] = of[1 + size :]
    return SolidComponents(bricks, labels, tiles, inside, sizes)


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


SLACK = 0.01
"""Part of the minimum thickness by which a wall may be thinner."""

ENOUGH = 4
"""Voxels across the minimum thickness from which on triangles cut little off round walls."""


@dataclass(frozen=True, eq=False)
class ThinWalls(Rows):
    """Walls that are thinner than the minimum thickness, mm."""

    width: np.ndarray
    area: np.ndarray  # surface that each represents
    middle: np.ndarray  # float64 [n, 3], from the middle of the object along x and y, above its lowest point

    def note(self, least: float, spot: float) -> tuple[str, ...]:
        """A note on them: the number of places, and the thinnest one.

        Walls are one place where they are in cubes of the minimum thickness that touch. Those of less area
        than a square of side `spot`, such as creases, are counted apart.

        `least`: minimum thickness, mm.
        """
        if not len(self.width):
            return ()
        areas = np.bincount(_clusters(self.middle, least), self.area)
        places, spots = int((areas >= spot**2).sum()), int((areas < spot**2).sum())
        first, thinner = int(self.width.argmin()), f" thinner than the thickness of {least:g} mm"
        counts = [f"{format_count(places, 'place')}{thinner}"] if places else []
        if spots:
            small = f"{format_count(spots, 'spot')} smaller than {spot:.2g} mm"
            counts.append(small if places else f"{small},{thinner}")
        at = place(self.middle[first].tolist())
        return (f"{', and '.join(counts)}; the thinnest, {self.width[first]:.2g} mm, at {at} mm",)


def _clusters(points: np.ndarray, side: float) -> np.ndarray:
    """Number points [n, 3] by groups of cubes of a side that touch, int64 [n]."""
    cells, which = np.unique(np.floor(points / side).astype(np.int64), axis=0, return_inverse=True)
    shape = tuple((np.ptp(cells, axis=0) + 3).tolist())
    number = np.ravel_multi_index(tuple((cells - cells.min(0) + 1).T), shape)
    steps = np.ravel_multi_index(tuple(np.array(list(product((0, 1, 2), repeat=3)))[14:].T), shape)
    near = number[:, None] + steps - np.ravel_multi_index((1, 1, 1), shape)
    at = np.minimum(np.searchsorted(number, near), len(number) - 1)
    some, step = np.nonzero(number[at] == near)
    return np.asarray(graph_components(len(cells), some, at[some, step])[0][which.reshape(-1)])


class MeshSurface(NamedTuple):
    """Triangles of a mesh, mm, and the tree of their boxes in halves; see `fracslice.mesh.model`."""

    vertices: NDArray[np.float64]
    triangles: NDArray[np.int32]
    order: NDArray[np.int64]
    low: NDArray[np.float64]
    high: NDArray[np.float64]


def thin_walls(of: MeshSurface, count: int, least: float, threads: int = 0) -> ThinWalls:
    """Walls of the first triangles of a mesh that are thinner than `least` mm.

    Rays have the length of a wall where the face that they meet looks away from their own, as for
    `fracslice.printing.walls`. A ray that leaves through a neighbour of its triangle, beside a sharp edge,
    measures none; nor does one that leaves a mesh that is open.
    """
    found = _thin_walls(*of, count, (1 - SLACK) * least, threads)
    return ThinWalls(found[:, 0], found[:, 1], found[:, 2:])


def thickness_note(found: Sequence[ThinWalls], how: Print, voxel: float) -> tuple[str, ...]:
    """A note on the walls of a mesh, but those of the raft, which has a height of its own.

    `voxel` in mm.
    """
    if not found:
        return ()
    thin, finer = ThinWalls.joined(found), how.thickness / ENOUGH
    notes = thin.chosen(thin.middle[:, 2] > how.raft).note(how.thickness, voxel)
    advice = f"; expected a voxel of {finer:.2g} mm" if voxel > 1.01 * finer else ""
    return tuple(note + advice for note in notes)
