"""More triangles where a smooth surface bends away from them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..formulas.registry import Node
from ..kernel import Compilable
from ..volume.settling import anywhere, settle
from ..work import Work
from .model import Mesh

PASSES = 6
SMOOTH = 0.03
"""A middle moves by this share of its edge at most. Where the surface is farther off it is rough there, and
more triangles of this size would not follow it.
"""


def refine(root: Node | Compilable, mesh: Mesh, chord: float, voxel: float, work: Work | None = None) -> Mesh:
    """Splits edges whose middle is more than `chord` from the surface, and moves the middles there.

    mesh: closed, scene units, its vertices on the zero set of root's field; chord, voxel: scene units. Where
    an edge is split, so are both triangles at it (red and green refinement; Bank, Sherman and Weiser 1983,
    "Some refinement algorithms and data structures for regular local mesh refinement"): the surface stays
    closed. Sharp edges and rough places stay as they are, and so does what would make it cross itself. Raises
    `Cancelled`.
    """
    work, kept = work or Work(), np.empty(0, np.int64)
    for _ in range(PASSES):
        edges, sides = _edges(mesh.triangles)
        ends = mesh.vertices[edges]
        middles = ends.mean(axis=1)
        there = middles.copy()
        moved, places = settle(root, middles, anywhere, voxel, work)
        there[moved] = places
        off = np.linalg.norm(there - middles, axis=1)
        split = (off > chord) & (off < SMOOTH * np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1))
        split &= ~np.isin(_keys(edges), kept)
        mesh, stuck = _split_apart(mesh, sides, split, there, work)
        kept = np.concatenate([kept, _keys(edges[stuck])])
        if not split.any():
            break
    return mesh


def _split_apart(
    mesh: Mesh, sides: NDArray[np.int64], split: NDArray[np.bool_], there: NDArray[np.float64], work: Work
) -> tuple[Mesh, NDArray[np.int64]]:
    """The mesh with edges split, and those, taken out of `split`, that were left for it not to cross."""
    from .crossings import crossing_triangles

    stuck = np.empty(0, np.int64)
    while split.any():
        work.check()
        finer, parents = _split(mesh, sides, split, there)
        crossed = np.unique(sides[parents[crossing_triangles(finer, threads=work.threads)]])
        if not split[crossed].any():
            return finer, stuck
        stuck = np.concatenate([stuck, crossed])
        split[crossed] = False
    return mesh, stuck


def _keys(edges: NDArray[np.int64]) -> NDArray[np.int64]:
    return edges[:, 0] << 32 | edges[:, 1]


def _edges(triangles: NDArray[np.int32]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The edges, int64 [e, 2], and those of each triangle, [m, 3]: side k runs from corner k to the next."""
    ends = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2).astype(np.int64)
    ends.sort(axis=2)
    count = int(triangles.max()) + 1
    keys, sides = np.unique(ends[..., 0] * count + ends[..., 1], return_inverse=True)
    return np.stack([keys // count, keys % count], axis=1), sides.reshape(-1, 3)


def _split(
    mesh: Mesh, sides: NDArray[np.int64], split: NDArray[np.bool_], there: NDArray[np.float64]
) -> tuple[Mesh, NDArray[np.int64]]:
    """The mesh with new vertices in split edges, and the triangle that each of its triangles came from."""
    number = np.full(len(split), -1, np.int32)
    number[split] = len(mesh.vertices) + np.arange(split.sum(), dtype=np.int32)
    vertices = np.concatenate([mesh.vertices, there[split]])
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
