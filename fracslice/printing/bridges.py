"""The shortest struts that join loose bodies."""

from __future__ import annotations

import numpy as np

from ..volume import Bricks
from .parts import Parts

NONE = -1


def struts(solid: Bricks, parts: Parts, bodies: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The ends of struts, float64 [n - 1, 3] each, scene units, that join n bodies, together as short as can
    be.

    Every sample of the space between belongs to its nearest body (exact Euclidean distances: Maurer, Qi and
    Raghavan 2003); where two such cells meet, their bodies may be joined. The minimum spanning tree of the
    bodies is among these pairs, as the one of points is in their Delaunay triangulation.
    """
    from scipy.ndimage import distance_transform_edt
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import minimum_spanning_tree

    if len(bodies) < 2:
        return np.empty((0, 3)), np.empty((0, 3))
    body = _dense(solid, parts, bodies)
    nearest = distance_transform_edt(body == NONE, return_distances=False, return_indices=True)
    pairs, ends = _meetings(body, nearest)
    pairs, ends, length = _nearest(pairs, ends)
    tree = minimum_spanning_tree(coo_array((length, pairs.T), (len(bodies),) * 2)).tocoo()
    chosen = {(int(i), int(j)) for i, j in zip(*tree.coords, strict=True)}
    kept = [n for n, (i, j) in enumerate(pairs.tolist()) if (i, j) in chosen]
    points = np.array(solid.origin) + solid.voxel * ends[kept]
    return points[:, 0], points[:, 1]


def _nearest(pairs: np.ndarray, ends: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Each pair once, with the ends that are nearest to each other, and their distance. Where faces lie side
    by side many are, but for a sample: then the ones nearest to the middle of them.
    """
    kinds, of = np.unique(pairs, axis=0, return_inverse=True)
    length = np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1)
    least = np.full(len(kinds), np.inf)
    np.minimum.at(least, of, length)
    near = length < least[of] + 1
    ends, of, length = ends[near], of[near], length[near]
    middle, count = np.zeros((len(kinds), 3)), np.bincount(of)
    np.add.at(middle, of, ends.mean(1))
    away = np.linalg.norm(ends.mean(1) - (middle / count[:, None])[of], axis=1)
    order = np.lexsort([away, of])
    first = order[np.flatnonzero(np.r_[True, np.diff(of[order]) > 0])]
    return kinds, ends[first], length[first]


def _dense(solid: Bricks, parts: Parts, bodies: np.ndarray) -> np.ndarray:
    """Which of the bodies each grid point is in, int32 [x, y, z], or `NONE`."""
    number = np.full(len(parts.inside) + 1, NONE, np.int32)
    number[bodies] = np.arange(len(bodies))
    nx, ny, nz = solid.index.shape
    cells = np.where(solid.index >= 0, NONE, number[parts.tiles])[..., None] + np.zeros(512, np.int32)
    cells[tuple(solid.ijk.T // 8)] = number[parts.labels]
    return cells.reshape(nx, ny, nz, 8, 8, 8).transpose(0, 3, 1, 4, 2, 5).reshape(8 * nx, 8 * ny, 8 * nz)


def _meetings(body: np.ndarray, nearest: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of bodies [n, 2] whose cells meet somewhere, the lower number first, and the nearest points
    there, [n, 2, 3].
    """
    owner = body[tuple(nearest)]
    pairs, ends = [np.empty((0, 2), np.int64)], [np.empty((0, 2, 3), np.int64)]
    for axis in range(3):
        own, near = np.moveaxis(owner, axis, 0), np.moveaxis(nearest, 1 + axis, 1)
        here = np.nonzero(own[:-1] != own[1:])
        there = (here[0] + 1, *here[1:])
        two = np.stack([own[here], own[there]], 1)
        at = np.stack([np.stack([n[end] for n in near], 1) for end in (here, there)], 1)
        swapped = two[:, 0] > two[:, 1]
        two[swapped], at[swapped] = two[swapped][:, ::-1], at[swapped][:, ::-1]
        pairs.append(two)
        ends.append(at)
    return np.concatenate(pairs), np.concatenate(ends)
