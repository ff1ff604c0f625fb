"""The connected parts of a sampled solid and of the space around it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..compiled import compiled
from ..disjoint import find, roots, unite
from ..volume import Bricks
from ..volume.bricks import INSIDE, OUTSIDE


@dataclass(frozen=True, eq=False)
class Components:
    """Parts numbered from 0; number 0 is the space that reaches beyond the samples.

    labels: int32 [n, 512], the part of each sample. tiles: int32 [bx, by, bz], that of each brick without
    samples, -1 for the others. inside: bool [m], whether a part is solid. count: int64 [m], in samples.
    """

    labels: np.ndarray
    tiles: np.ndarray
    inside: np.ndarray
    count: np.ndarray

    @cached_property
    def bodies(self) -> np.ndarray:
        """The numbers of the solid parts, the largest first."""
        return self._by_size(self.inside)

    @cached_property
    def cavities(self) -> np.ndarray:
        """The numbers of the spaces that nothing reaches, the largest first."""
        return np.asarray([number for number in self._by_size(~self.inside) if number], np.int64)

    def _by_size(self, chosen: np.ndarray) -> np.ndarray:
        numbers = np.flatnonzero(chosen)
        return np.asarray(numbers[np.argsort(-self.count[numbers], kind="stable")])

    def masks(self, numbers: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Where these parts are: bool like labels, and like tiles."""
        chosen = np.zeros(len(self.inside) + 1, bool)
        chosen[numbers] = True
        return np.asarray(chosen[self.labels]), np.asarray(chosen[self.tiles])


@dataclass(frozen=True, eq=False)
class Connected:
    """Samples of a solid, and its parts."""

    solid: Bricks
    components: Components

    def filled(self) -> Connected:
        """As they are once the cavities are solid: what floats in one is of the body around it."""
        solid = self._turned(self.components.cavities, -1.0, INSIDE)
        return Connected(solid, components_of(solid))

    def without(self, bodies: np.ndarray) -> Bricks:
        """The samples of the solid without some bodies."""
        return self._turned(bodies, 1.0, OUTSIDE)

    def _turned(self, numbers: np.ndarray, sign: float, side: int) -> Bricks:
        """With parts on the other side, a voxel from the surface."""
        samples, tiles = self.components.masks(numbers)
        values = np.where(samples, np.float32(sign * self.solid.voxel), self.solid.values)
        return replace(self.solid, values=values, index=np.where(tiles, np.int32(side), self.solid.index))


def components_of(bricks: Bricks) -> Components:
    """The parts of a sampled solid, in time linear in the samples.

    Samples are connected along the grid's edges: what touches only along a line is not joined. Each brick is
    labelled alone, then its faces are united with its neighbours' (union and find, Tarjan 1975).
    """
    labels = np.empty(bricks.values.shape, np.int32)
    first = np.zeros(len(bricks) + 1, np.int64)
    _label(bricks.values, labels, first)
    empty = bricks.index < 0
    tiles = np.full(bricks.index.shape, -1, np.int64)
    tiles[empty] = first[-1] + 1 + np.arange(empty.sum())
    labels += (first[:-1, None] + 1).astype(np.int32)
    total = int(first[-1] + 1 + empty.sum())
    parent, inside = np.arange(total), np.zeros(total, bool)
    inside[labels.ravel()] = bricks.values.ravel() < 0
    inside[tiles[empty]] = bricks.index[empty] == INSIDE
    _unite_faces(bricks.index, labels, tiles, inside, parent)
    root = roots(parent)
    names, number = np.unique(root, return_inverse=True)
    count = np.bincount(number[labels.ravel()], minlength=len(names))
    count += 512 * np.bincount(number[tiles[empty]], minlength=len(names))
    found = np.where(empty, number[tiles], -1).astype(np.int32)
    return Components(number.astype(np.int32)[labels], found, inside[names], count)


@compiled
def _label(values, labels, first):  # type: ignore[no-untyped-def]
    """The parts of each brick alone, numbered from 0, and how many there are before each brick."""
    parent = np.empty(512, np.int64)
    for row in range(len(values)):
        f = values[row]
        for s in range(512):
            parent[s] = s
            for step, at in ((64, s >> 6), (8, (s >> 3) & 7), (1, s & 7)):
                if at and (f[s] < 0) == (f[s - step] < 0):
                    unite(parent, s, s - step)
        count = 0
        for s in range(512):
            if parent[s] == s:
                labels[row, s] = count
                count += 1
            else:
                labels[row, s] = labels[row, find(parent, s)]
        first[row + 1] = first[row] + count


@compiled
def _unite_faces(index, labels, tiles, inside, parent):  # type: ignore[no-untyped-def]
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
    """The last layer of one brick along an axis with the first layer of the next; either may be a tile."""
    step, p, q = ((64, 8, 1), (8, 64, 1), (1, 64, 8))[axis]
    for i in range(8):
        for j in range(8):
            s = i * p + j * q
            a = labels[here, s + 7 * step] if here >= 0 else own
            b = labels[there, s] if there >= 0 else other
            if inside[a] == inside[b]:
                unite(parent, a, b)
