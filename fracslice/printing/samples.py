"""A sampled field: interpolation between its samples, and connected components of the solid and what is
around it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from .._native import SampledField, crossings_by_component, graph_components, least, solid_components
from ..common.cache import key
from ..fields.box import Box
from ..fields.field import Bounds, Device, Kernel, Precision
from ..fields.tree import ArrayField
from ..volume import Bricks, SignBricks
from ..volume.bricks import BRICK, INSIDE, OUTSIDE

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


def thin_share(signs: SignBricks) -> float:
    """Share of the material in bodies whose mean thickness is below a voxel:
    `SolidComponents.thin_share`.
    """
    return components_of(sign_samples(signs)).thin_share


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
