"""Subdivision of triangles at the midpoints of edges; the surface stays closed.

Red-green refinement (Bank, Sherman and Weiser 1983, "Some refinement algorithms and data structures for
regular local mesh refinement"): both triangles at a split edge are split.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .model import Mesh

NEEDLE = 0.3
"""Maximum ratio of the shortest to the longest side of a needle. A needle is split at both of its long sides
or at none.
"""


class Edges(NamedTuple):
    """Edges of a closed mesh.

    Attributes
    ----------
    ends : ndarray of int64, shape (e, 2)
        End points, the lower index first.
    sides : ndarray of int64, shape (m, 3)
        Edges of each triangle; side k runs from corner k to the next.
    """

    ends: NDArray[np.int64]
    sides: NDArray[np.int64]

    @property
    def keys(self) -> NDArray[np.int64]:
        """Unique key of each edge, made of its end points, int64 [e]."""
        result: NDArray[np.int64] = self.ends[:, 0] << 32 | self.ends[:, 1]
        return result

    @property
    def beside(self) -> NDArray[np.int64]:
        """The two triangles at each edge, int64 [e, 2]."""
        return np.argsort(self.sides.ravel(), kind="stable").reshape(-1, 2) // 3


def edges_of(triangles: NDArray[np.int32]) -> Edges:
    """Edges of a closed mesh.

    Parameters
    ----------
    triangles : ndarray of int32, shape (m, 3)
        Triangles.

    Returns
    -------
    Edges
        Edges, by ascending key.
    """
    ends = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2).astype(np.int64)
    ends.sort(axis=2)
    keys, sides = np.unique(ends[..., 0] << 32 | ends[..., 1], return_inverse=True)
    return Edges(np.stack([keys >> 32, keys & 0xFFFFFFFF], axis=1), sides.reshape(-1, 3))


def with_needles(
    split: NDArray[np.bool_], sides: NDArray[np.int64], lengths: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """Add the other long side of needles with a split side. Half a needle would be nearly degenerate.

    Parameters
    ----------
    split : ndarray of bool, shape (e,)
        True for each split edge.
    sides : ndarray of int64, shape (m, 3)
        Edges of each triangle.
    lengths : ndarray of float64, shape (e,)
        Lengths of the edges.

    Returns
    -------
    ndarray of bool, shape (e,)
        Split edges with the added ones.
    """
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
    """Split edges of a mesh.

    Parameters
    ----------
    mesh : Mesh
        Closed mesh.
    sides : ndarray of int64, shape (m, 3)
        Edges of each triangle.
    split : ndarray of bool, shape (e,)
        True for each edge to split.
    there : ndarray of float64, shape (k, 3)
        New vertices of these edges.

    Returns
    -------
    Mesh
        The mesh with the new vertices; unchanged triangles come first.
    ndarray of int64, shape (j,)
        Parent triangle of each triangle.
    """
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
    """Triangles split at `count` of their sides. Midpoint vertices int32 [m, 3]; -1 for a whole side."""
    # Rotated so that the split side comes first, or the whole one last.
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
