"""Connected components of a sampled solid and of the space around it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from .._native import crossings_by_component, graph_components, solid_components
from ..formulas import Box
from ..volume import Bricks, SignBricks
from ..volume.bricks import INSIDE, OUTSIDE
from .samples import positions


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
