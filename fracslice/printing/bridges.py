"""Struts of minimum total length that join disconnected bodies."""

from __future__ import annotations

import numpy as np

from .samples import positions
from .solid_components import SolidComponents

NONE = -1
"""Marks samples in no body and cells without an entry."""

ACROSS = 192
"""Maximum number of cells along the longest side; on finer grids, a cell spans several samples."""

CHUNK = 2048
"""Bricks processed at a time."""


def bridging_struts(
    components: SolidComponents, bodies: np.ndarray, groups: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Struts that join n bodies with minimum total length.

    Each cell of the empty space belongs to its nearest body, by exact Euclidean distances (Maurer, Qi and
    Raghavan 2003). Bodies whose regions are adjacent are candidate pairs. The minimum spanning tree of the
    bodies is among these pairs, as the one of points is in their Delaunay triangulation.

    Parameters
    ----------
    components : SolidComponents
        Connected components of a sampled solid.
    bodies : int64 [n]
        Numbers of the components to join.
    groups : int64 [n], optional
        Group of each body; only bodies of one group are joined. By default all are of one.

    Returns
    -------
    start, end : float64 [m, 3]
        Ends of the struts, scene units: n - 1 of them for one group.
    """
    from scipy.ndimage import distance_transform_edt
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import minimum_spanning_tree

    if len(bodies) < 2:
        return np.empty((0, 3)), np.empty((0, 3))
    solid = components.solid
    times = -(-8 * max(solid.index.shape) // ACROSS)
    cell, body, place = _cells(components, bodies, times)
    shape = tuple(-(-8 * n // times) for n in solid.index.shape)
    of = np.full(shape, NONE)
    of.flat[cell] = np.arange(len(cell))
    nearest = distance_transform_edt(of == NONE, return_distances=False, return_indices=True)
    meeting = np.concatenate([_sharing(cell), _meetings(of[tuple(nearest)], body)])
    if groups is not None:
        meeting = meeting[groups[body[meeting[:, 0]]] == groups[body[meeting[:, 1]]]]
    if not len(meeting):
        return np.empty((0, 3)), np.empty((0, 3))
    pairs, ends, length = _nearest(body[meeting], place[meeting], times)
    tree = minimum_spanning_tree(coo_array((length, pairs.T), (len(bodies),) * 2)).tocoo()
    chosen = {(int(i), int(j)) for i, j in zip(*tree.coords, strict=True)}
    kept = [n for n, (i, j) in enumerate(pairs.tolist()) if (i, j) in chosen]
    points = np.array(solid.origin) + solid.voxel * ends[kept]
    return points[:, 0], points[:, 1]


def _nearest(pairs: np.ndarray, ends: np.ndarray, slack: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Unique pairs of bodies, their nearest end points, and the distance between these.

    Between parallel faces many end points are nearest within `slack` samples: the one closest to their mean
    is returned.
    """
    swapped = pairs[:, 0] > pairs[:, 1]
    pairs, ends = pairs.copy(), ends.copy()
    pairs[swapped], ends[swapped] = pairs[swapped][:, ::-1], ends[swapped][:, ::-1]
    kinds, of = np.unique(pairs, axis=0, return_inverse=True)
    length = np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1)
    least = np.full(len(kinds), np.inf)
    np.minimum.at(least, of, length)
    near = length < least[of] + slack
    ends, of, length = ends[near], of[near], length[near]
    middle, count = np.zeros((len(kinds), 3)), np.bincount(of)
    np.add.at(middle, of, ends.mean(1))
    away = np.linalg.norm(ends.mean(1) - (middle / count[:, None])[of], axis=1)
    order = np.lexsort([away, of])
    first = order[np.flatnonzero(np.r_[True, np.diff(of[order]) > 0])]
    return kinds, ends[first], length[first]


def _cells(
    components: SolidComponents, bodies: np.ndarray, times: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Cells of `times` samples along each side that contain bodies, once for each body in a cell.

    Returns the flat index of the cell, the position of the body in `bodies`, and the grid index of one of its
    samples in the cell: int64 [n], [n] and [n, 3].
    """
    solid, number = components.solid, np.full(len(components.inside), NONE)
    number[bodies] = np.arange(len(bodies))
    shape = [-(-8 * n // times) for n in solid.index.shape]
    keys, places = [np.empty(0, np.int64)], [np.empty((0, 3), np.int64)]
    for begin in range(0, len(solid), CHUNK):
        body = number[components.labels[begin : begin + CHUNK]]
        rows, offsets = np.nonzero(body != NONE)
        place = positions(solid, begin + rows, offsets)
        cell = np.ravel_multi_index(tuple(place.T // times), shape)
        result, first = np.unique(cell * len(bodies) + body[rows, offsets], return_index=True)
        keys.append(result)
        places.append(place[first])
    result, first = np.unique(np.concatenate(keys), return_index=True)
    return *np.divmod(result, len(bodies)), np.concatenate(places)[first]


def _sharing(cell: np.ndarray) -> np.ndarray:
    """Pairs of consecutive entries in the same cell, int64 [n, 2]."""
    first = np.flatnonzero(cell[:-1] == cell[1:])
    return np.column_stack([first, first + 1])


def _meetings(owner: np.ndarray, body: np.ndarray) -> np.ndarray:
    """Pairs of nearest entries on either side where regions of different bodies meet, int64 [n, 2]."""
    pairs = [np.empty((0, 2), np.int64)]
    for axis in range(3):
        own = np.moveaxis(owner, axis, 0)
        differ = body[own[:-1]] != body[own[1:]]
        pairs.append(np.column_stack([own[:-1][differ], own[1:][differ]]))
    return np.concatenate(pairs)
