"""Connected components of a sampled solid and of the space around it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..compiled import compiled
from ..disjoint import roots, unite, unite_all
from ..volume import Bricks
from ..volume.bricks import INSIDE, OUTSIDE
from .samples import positions


@dataclass(frozen=True, eq=False)
class Components:
    """Connected components, numbered from 0. Number 0 is the space that extends beyond the samples.

    Attributes
    ----------
    labels : int32 [n, 512]
        Component of each sample.
    tiles : int32 [bx, by, bz]
        Component of each unsampled brick, -1 for sampled ones.
    inside : bool [m]
        True if the component is solid.
    count : int64 [m]
        Size of the component, samples.
    """

    labels: np.ndarray
    tiles: np.ndarray
    inside: np.ndarray
    count: np.ndarray

    @cached_property
    def bodies(self) -> np.ndarray:
        """Numbers of the solid components, int64 [k], the largest first."""
        return self._by_size(self.inside)

    @cached_property
    def cavities(self) -> np.ndarray:
        """Numbers of the enclosed empty components, int64 [k], the largest first."""
        return np.asarray([number for number in self._by_size(~self.inside) if number], np.int64)

    def _by_size(self, chosen: np.ndarray) -> np.ndarray:
        numbers = np.flatnonzero(chosen)
        return np.asarray(numbers[np.argsort(-self.count[numbers], kind="stable")])

    def samples(self, numbers: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Samples of some components.

        Parameters
        ----------
        numbers : int64 [k]
            Numbers of the components.

        Returns
        -------
        rows, offsets : int64 [n]
            Row of each sample's brick, and offset in the brick.
        """
        chosen = np.zeros(len(self.inside), np.bool_)
        chosen[numbers] = True
        flat = np.empty(self.count[numbers].sum(), np.int64)
        found = flat[: _samples(self.labels, chosen, flat)]
        return found >> 9, found & 511

    def masks(self, numbers: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Masks of some components.

        Parameters
        ----------
        numbers : int64 [k]
            Numbers of the components.

        Returns
        -------
        samples, tiles : bool [n, 512], bool [bx, by, bz]
            True in the components, shaped like `labels` and `tiles`.
        """
        chosen = np.zeros(len(self.inside) + 1, bool)
        chosen[numbers] = True
        return np.asarray(chosen[self.labels]), np.asarray(chosen[self.tiles])


@dataclass(frozen=True, eq=False)
class Connected:
    """A sampled solid and its connected components.

    Attributes
    ----------
    solid : Bricks
        The samples.
    components : Components
        Their components.
    """

    solid: Bricks
    components: Components

    @classmethod
    def of(cls, solid: Bricks) -> Connected:
        """Label the components of a sampled solid.

        Parameters
        ----------
        solid : Bricks
            The samples.

        Returns
        -------
        Connected
            The samples and their components.
        """
        return cls(solid, components_of(solid))

    def filled(self, cavities: np.ndarray) -> Connected:
        """Fill cavities. A body that floats in a cavity joins the body around it.

        Parameters
        ----------
        cavities : int64 [k]
            Numbers of the cavities.

        Returns
        -------
        Connected
            The filled solid, its components renumbered.
        """
        place = self._places(cavities)
        beside = [self._at(place + step) for step in np.vstack([np.eye(3, dtype=int), -np.eye(3, dtype=int)])]
        parent = np.arange(len(self.components.inside))
        unite_all(parent, np.tile(self._at(place), 6), np.concatenate(beside))
        names, number = np.unique(roots(parent), return_inverse=True)
        labels, tiles = self.components.labels, self.components.tiles
        inside = self.components.inside.copy()
        inside[cavities] = True
        merged = Components(
            number.astype(np.int32)[labels],
            np.where(tiles >= 0, number[tiles], -1).astype(np.int32),
            inside[names],
            np.bincount(number, self.components.count).astype(np.int64),
        )
        return Connected(self._turned(cavities, -1.0, INSIDE), merged)

    def sealed(self, before: Connected) -> np.ndarray:
        """Cavities that were not cavities before.

        Parameters
        ----------
        before : Connected
            The solid before, which may be sampled on another grid.

        Returns
        -------
        int64 [k]
            Numbers of the new cavities.
        """
        cavities = self.components.cavities
        place = self._places(cavities)
        points = np.array(self.solid.origin) + self.solid.voxel * place
        there = np.round((points - before.solid.origin) / before.solid.voxel).astype(np.int64)
        known = np.isin(before._at(there), before.components.cavities)
        return np.setdiff1d(cavities, self._at(place)[known])

    def _places(self, numbers: np.ndarray) -> np.ndarray:
        """Grid indices of the samples of some components, int64 [n, 3]."""
        return positions(self.solid, *self.components.samples(numbers))

    def _at(self, place: np.ndarray) -> np.ndarray:
        """Components at grid indices [n, 3], int64 [n]; 0 beyond the bricks."""
        brick = place >> 3
        within = np.all((brick >= 0) & (brick < self.solid.index.shape), axis=1)
        at = tuple(np.where(within[:, None], brick, 0).T)
        row = self.solid.index[at]
        label = np.where(
            row >= 0, self.components.labels[row, (place & 7) @ (64, 8, 1)], self.components.tiles[at]
        )
        return np.where(within, label, 0).astype(np.int64)

    def without(self, bodies: np.ndarray) -> Bricks:
        """The solid without some bodies.

        Parameters
        ----------
        bodies : int64 [k]
            Numbers of the bodies.

        Returns
        -------
        Bricks
            The samples.
        """
        return self._turned(bodies, 1.0, OUTSIDE)

    def _turned(self, numbers: np.ndarray, sign: float, side: int) -> Bricks:
        """Move components to one side: samples to `sign` voxels from the surface, tiles to `side`."""
        samples, tiles = self.components.masks(numbers)
        values = np.where(samples, np.float32(sign * self.solid.voxel), self.solid.values)
        return replace(self.solid, values=values, index=np.where(tiles, np.int32(side), self.solid.index))


def components_of(bricks: Bricks) -> Components:
    """Label the connected components of a sampled solid, in time linear in the samples.

    Samples are connected along edges of the grid: solids that touch only along a line are not connected. Each
    brick is labelled alone, then united with its neighbours across faces (union-find, Tarjan 1975).

    Parameters
    ----------
    bricks : Bricks
        The samples.

    Returns
    -------
    Components
        The components.
    """
    labels = np.empty(bricks.values.shape, np.int32)
    first = np.zeros(len(bricks) + 1, np.int64)
    _label(bricks.values, labels, first)
    empty = bricks.index < 0
    tiles = np.full(bricks.index.shape, -1, np.int64)
    tiles[empty] = first[-1] + 1 + np.arange(empty.sum())
    total = int(first[-1] + 1 + empty.sum())
    count, inside = np.zeros(total, np.int64), np.zeros(total, np.bool_)
    _tally(bricks.values, labels, first, count, inside)
    count[tiles[empty]], inside[tiles[empty]] = 512, bricks.index[empty] == INSIDE
    parent = np.arange(total)
    _unite_faces(bricks.index, labels, tiles, inside, parent)
    names, number = np.unique(roots(parent), return_inverse=True)
    found = np.where(empty, number[tiles], -1).astype(np.int32)
    _renumber(labels, number)
    sizes = np.zeros(len(names), np.int64)
    np.add.at(sizes, number, count)
    return Components(labels, found, inside[names], sizes)


@compiled
def _samples(labels, chosen, flat):  # type: ignore[no-untyped-def]
    """Write the flat indices of the samples of chosen components; return their number."""
    n = 0
    for row in range(len(labels)):
        for s in range(512):
            if chosen[labels[row, s]]:
                flat[n] = 512 * row + s
                n += 1
    return n


@compiled
def _tally(values, labels, first, count, inside):  # type: ignore[no-untyped-def]
    """Number the components of all bricks from 1; record the samples and the side of each."""
    for row in range(len(labels)):
        for s in range(512):
            label = labels[row, s] + first[row] + 1
            labels[row, s] = label
            count[label] += 1
            inside[label] = values[row, s] < 0


@compiled
def _renumber(labels, number):  # type: ignore[no-untyped-def]
    """Replace labels by component numbers."""
    for row in range(len(labels)):
        for s in range(512):
            labels[row, s] = number[labels[row, s]]


@compiled
def _label(values, labels, first):  # type: ignore[no-untyped-def]
    """Label the components of each brick alone, from 0, and count the components before each brick."""
    parent = np.empty(512, np.int32)
    for row in range(len(values)):
        f = values[row]
        for s in range(512):
            here = f[s] < 0
            root = s
            for step, at in ((64, s >> 6), (8, (s >> 3) & 7), (1, s & 7)):
                if at and here == (f[s - step] < 0):
                    other = s - step
                    while parent[other] != other:
                        parent[other] = parent[parent[other]]
                        other = parent[other]
                    if root == s:
                        root = other
                    elif root != other:
                        low, high = min(root, other), max(root, other)
                        parent[high] = low
                        root = low
            parent[s] = root
        count = 0
        for s in range(512):
            if parent[s] == s:
                labels[row, s] = count
                count += 1
            else:
                labels[row, s] = labels[row, parent[s]]
        first[row + 1] = first[row] + count


@compiled
def _unite_faces(index, labels, tiles, inside, parent):  # type: ignore[no-untyped-def]
    """Unite components across brick faces, and the empty ones at the rim with number 0."""
    nx, ny, nz = index.shape
    for x in range(nx):
        for y in range(ny):
            for z in range(nz):
                here = index[x, y, z]
                rim = min(x, y, z) == 0 or x == nx - 1 or y == ny - 1 or z == nz - 1
                if here < 0 and rim and not inside[tiles[x, y, z]]:
                    unite(parent, 0, tiles[x, y, z])
                for axis in range(3):
                    u, v, w = x + (axis == 0), y + (axis == 1), z + (axis == 2)
                    there = index[u, v, w] if u < nx and v < ny and w < nz else -1
                    if here < 0 and there < 0:
                        if u < nx and v < ny and w < nz and inside[tiles[x, y, z]] == inside[tiles[u, v, w]]:
                            unite(parent, tiles[x, y, z], tiles[u, v, w])
                        continue
                    other = tiles[u, v, w] if u < nx and v < ny and w < nz else 0
                    _unite_face(axis, here, there, tiles[x, y, z], other, labels, inside, parent)
                    if here >= 0 and (x, y, z)[axis] == 0:
                        _unite_face(axis, -1, here, 0, 0, labels, inside, parent)


@compiled
def _unite_face(axis, here, there, own, other, labels, inside, parent):  # type: ignore[no-untyped-def]
    """Unite the last layer of a brick along an axis with the first of the next; either may be unsampled."""
    step, p, q = ((64, 8, 1), (8, 64, 1), (1, 64, 8))[axis]
    for i in range(8):
        for j in range(8):
            s = i * p + j * q
            a = labels[here, s + 7 * step] if here >= 0 else own
            b = labels[there, s] if there >= 0 else other
            if inside[a] == inside[b]:
                unite(parent, a, b)
