"""Triangles cut at the middles of their sides, so that the surface stays closed.

Red and green refinement (Bank, Sherman and Weiser 1983, "Some refinement algorithms and data structures for
regular local mesh refinement"): where an edge is split, so are both triangles at it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .model import Mesh

NEEDLE = 0.3
"""A triangle whose shortest side is a smaller share of its longest is cut at both of its long ones, or at
none."""


class Edges(NamedTuple):
    """Of a closed mesh. ends: int64 [e, 2], the lower vertex first. sides: int64 [m, 3], those of each
    triangle: side k runs from corner k to the next."""

    ends: NDArray[np.int64]
    sides: NDArray[np.int64]

    @property
    def keys(self) -> NDArray[np.int64]:
        """A number for each that does not depend on the others."""
        found: NDArray[np.int64] = self.ends[:, 0] << 32 | self.ends[:, 1]
        return found

    @property
    def beside(self) -> NDArray[np.int64]:
        """The two triangles at each, int64 [e, 2]."""
        return np.argsort(self.sides.ravel(), kind="stable").reshape(-1, 2) // 3


def edges_of(triangles: NDArray[np.int32]) -> Edges:
    """The edges of a closed mesh."""
    ends = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2).astype(np.int64)
    ends.sort(axis=2)
    keys, sides = np.unique(ends[..., 0] << 32 | ends[..., 1], return_inverse=True)
    return Edges(np.stack([keys >> 32, keys & 0xFFFFFFFF], axis=1), sides.reshape(-1, 3))


def with_needles(
    split: NDArray[np.bool_], sides: NDArray[np.int64], lengths: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """`split` and what has to go with it: half a needle would be a triangle of three points in a row."""
    own = lengths[sides]
    longest = own.max(axis=1, keepdims=True)
    needles = np.flatnonzero(own.min(axis=1) < NEEDLE * longest[:, 0])
    sides, long = sides[needles], own[needles] > longest[needles] / 2
    while True:
        more = np.unique(sides[(split[sides] & long).any(axis=1)[:, None] & long & ~split[sides]])
        if not len(more):
            return split
        split = split.copy()
        split[more] = True


def cut(
    mesh: Mesh, sides: NDArray[np.int64], split: NDArray[np.bool_], there: NDArray[np.float64]
) -> tuple[Mesh, NDArray[np.int64]]:
    """The mesh with new vertices, `there`, in split edges, and the triangle that each of its triangles came
    from: first those that are as they were."""
    number = np.full(len(split), -1, np.int32)
    number[split] = len(mesh.vertices) + np.arange(split.sum(), dtype=np.int32)
    vertices = np.concatenate([mesh.vertices, there])
    cuts = split[sides].sum(axis=1)
    parts, parents = [mesh.triangles[cuts == 0]], [np.flatnonzero(cuts == 0)]
    for count in (1, 2, 3):
        own = np.flatnonzero(cuts == count)
        pieces = _cut(mesh.triangles[own], number[sides[own]], count, vertices)
        parts += pieces
        parents += [own] * len(pieces)
    return Mesh(vertices, np.concatenate(parts)), np.concatenate(parents)


def _cut(
    triangles: NDArray[np.int32], middles: NDArray[np.int32], count: int, vertices: NDArray[np.float64]
) -> list[NDArray[np.int32]]:
    """Triangles cut at the middles of `count` of their sides, int32 [m, 3], -1 where a side is whole."""
    # Turned so that the cut side is the first, or the whole one the last.
    first = np.argmax(middles >= 0, axis=1) if count == 1 else (np.argmin(middles, axis=1) + 1) % 3
    turn = (first[:, None] + np.arange(3)) % 3
    a, b, c = np.take_along_axis(triangles, turn, axis=1).T
    p, q, r = np.take_along_axis(middles, turn, axis=1).T
    if count == 1:
        return [np.stack([a, p, c], 1), np.stack([p, b, c], 1)]
    corner = np.stack([p, b, q], 1)
    if count == 3:
        return [corner, np.stack([a, p, r], 1), np.stack([r, q, c], 1), np.stack([p, q, r], 1)]
    across = vertices[[a, p]] - vertices[[q, c]]
    shorter = np.diff(np.linalg.norm(across, axis=2), axis=0)[0, :, None] > 0
    one = np.where(shorter, np.stack([a, p, q], 1), np.stack([a, p, c], 1))
    other = np.where(shorter, np.stack([a, q, c], 1), np.stack([p, q, c], 1))
    return [corner, one, other]
