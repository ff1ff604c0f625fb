"""Bridges between disconnected bodies: where bodies touch, borders between them, and struts of minimum
length.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import cached_property

import numpy as np

from .._native import bricks_near, capsule_squares, steps_to
from ..common.cache import key
from ..fields.field import Kernel
from ..volume import Bricks
from ..volume.bricks import INSIDE, OUTSIDE, values_at
from ..work import Work
from .walls import Samples, SolidComponents, components_of, positions

NONE = -1
"""Marks samples in no body and cells without an entry."""

ACROSS = 192
"""Maximum number of cells along the longest side; on finer grids, a cell spans several samples."""

CHUNK = 2048
"""Bricks processed at a time."""


def bridging_struts(
    components: SolidComponents, bodies: np.ndarray, groups: np.ndarray | None = None, near: float = 0.0
) -> tuple[np.ndarray, np.ndarray]:
    """Struts that join n bodies with minimum total length, and those shorter than `near` samples between
    bodies larger than crumbs.

    Each cell of the empty space belongs to its nearest body, by exact Euclidean distances (Maurer, Qi and
    Raghavan 2003). Bodies whose regions are adjacent are candidate pairs. The minimum spanning tree of the
    bodies is among these pairs, as the one of points is in their Delaunay triangulation.

    `bodies`: int64 [n]; `groups`: int64 [n], optional. Returns start, end float64 [m, 3], scene units: n - 1
    of them for one group, and those that are near.
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
    large = (components.count[bodies] >= CRUMB)[pairs].all(1) & (length < near)
    kept = [n for n, (i, j) in enumerate(pairs.tolist()) if (i, j) in chosen or large[n]]
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
    base = pairs.max() + 1  # numbers are sorted in a fraction of the time that rows take
    numbers, of = np.unique(pairs[:, 0] * base + pairs[:, 1], return_inverse=True)
    kinds = np.column_stack(np.divmod(numbers, base))
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


REACH = 8
"""Largest distance from a border, voxels. Farther off, unsampled bricks may lie between, which the search
cannot cross.
"""


def nearer(components: SolidComponents, these: np.ndarray, others: np.ndarray) -> Samples:
    """A field that is negative nearer to some components than to others.

    The value is half the difference of the grid steps to either, so the border lies midway between them. The
    surfaces of both stay unchanged.

    `these`, `others`: int64 [k]. Returns the field in scene units, at most `REACH` voxels in magnitude.
    """
    solid, (samples, tiles) = components.solid, components.masks(these)
    near, index = _around(solid, np.any(samples, axis=1), tiles)
    labels, ijk = components.labels[near], solid.ijk[near]
    to_these, to_others = (steps_to(ijk, index, np.isin(labels, those)) for those in (these, others))
    half = np.clip((to_these.astype(np.float32) - to_others) / 2, -REACH, REACH)
    values = half * np.float32(solid.voxel)
    return Samples(replace(solid, ijk=ijk, values=values, index=index))


def _around(solid: Bricks, rows: np.ndarray, tiles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rows of the bricks in and around `rows` and the unsampled bricks `tiles`, and an index of them.

    In the index, `tiles` are inside and all other unsampled bricks are outside.
    """
    from scipy.ndimage import binary_dilation

    near = tiles.copy()
    near[tuple(solid.ijk[rows].T >> 3)] = True
    near = binary_dilation(near, np.ones((3, 3, 3))) & (solid.index >= 0)
    index = np.where(tiles, INSIDE, OUTSIDE).astype(np.int32)
    chosen = np.sort(solid.index[near])
    index[tuple(solid.ijk[chosen].T >> 3)] = np.arange(len(chosen))
    return chosen, index


TOUCHING = 0.9
"""Value of the field, in samples, up to which two bodies touch: less than half of the thinnest gap."""

CLOSE = 6.0
"""Distance between the samples of two bodies, in samples, below which their contact is looked for even if
others join them: tips end at samples before they touch.
"""

SIDE = 33
"""Points along each side of the cube around a contact."""


def contacts(
    components: SolidComponents, bodies: np.ndarray, kernel: Kernel, work: Work
) -> tuple[np.ndarray, np.ndarray]:
    """Struts where bodies touch.

    Samples cannot tell bodies that touch from bodies with a gap of a sample between them. Around the middle
    of each strut the field is sampled 12 times finer.

    `bodies`: int64 [n]. Returns start, end float64 [m, 3], scene units.
    """
    voxel = components.solid.voxel
    start, end = bridging_struts(components, bodies, clusters(components)[bodies], CLOSE)
    touching = np.zeros(len(start), bool)
    for n in range(len(start)):
        touching[n] = _touching(kernel, start[n], end[n], voxel, work)
    return start[touching], end[touching]


def _touching(kernel: Kernel, start: np.ndarray, end: np.ndarray, voxel: float, work: Work) -> bool:
    """True if two points inside are connected in a cube around them, by samples of its own.

    Of most that touch, the straight way is inside; the cube, of many more samples, need not be seen.
    """
    from scipy.ndimage import label

    middle, half = (start + end) / 2, float(np.abs(end - start).max()) / 2 + voxel
    step = 2 * half / (SIDE - 1)

    def near(place: np.ndarray) -> np.ndarray:
        return values_at(kernel, middle[:, None] + step * place, work) < TOUCHING * step

    first, last = (np.round((p - middle) / step).astype(int) for p in (start, end))
    if near(_straight(first, last)).all():
        return True
    labels, _ = label(near(np.indices((SIDE,) * 3).reshape(3, -1) - SIDE // 2).reshape((SIDE,) * 3))
    a, b = (labels[tuple(place + SIDE // 2)] for place in (first, last))
    return bool(a == b != 0)


def _straight(first: np.ndarray, last: np.ndarray) -> np.ndarray:
    """Grid points of a way between two along the line between them, each a step of one axis from the one
    before it, int64 [3, n].
    """
    many = np.abs(last - first)
    axis = np.repeat(np.arange(3), many)
    order = np.argsort(np.concatenate([(np.arange(n) + 0.5) / max(n, 1) for n in many]), kind="stable")
    steps = np.sign(last - first)[axis[order]] * (axis[order] == np.arange(3)[:, None])
    return np.asarray(first[:, None] + np.pad(np.cumsum(steps, axis=1), ((0, 0), (1, 0))))


def clusters(components: SolidComponents) -> np.ndarray:
    """Clusters of bodies that touch, or nearly so.

    Returns int64 [m].
    """
    solid = components.solid
    grown = components_of(replace(solid, values=solid.values - np.float32(TOUCHING * solid.voxel)))
    result = np.zeros(len(components.inside), np.int64)
    result[components.labels] = grown.labels
    return np.where(components.inside, result, 0)


CRUMB = 8
"""Samples below which a fragment is a broken tip, if a larger one is near: a cube of two voxels."""

NEAR = 2
"""Distance of a tip from a larger fragment, samples along each axis."""


def fragments(
    meshed: SolidComponents, known: SolidComponents | None
) -> tuple[np.ndarray, np.ndarray, tuple[np.ndarray, np.ndarray]]:
    """Tips that break off, and struts that join the other fragments of each body.

    Returns tips, others int64 [k], int64 [n]; struts in scene units.
    """
    bodies = meshed.bodies
    owner = _owners(meshed, known)[bodies] if known else np.zeros(len(bodies), np.int64)
    tip = meshed.count[bodies] < CRUMB
    group = np.full(len(meshed.inside), NONE)
    group[bodies[~tip]] = owner[~tip]
    near = _beside(meshed, bodies[tip], group)
    tip[tip] = [own != NONE and own in groups for own, groups in zip(owner[tip], near, strict=True)]
    loose = ~tip & (owner != NONE)
    return bodies[tip], bodies[~tip], bridging_struts(meshed, bodies[loose], owner[loose])


def _beside(meshed: SolidComponents, bodies: np.ndarray, group: np.ndarray) -> Iterator[np.ndarray]:
    """Groups of the components near each body."""
    place = meshed.places(bodies)
    cube = np.indices((2 * NEAR + 1,) * 3).reshape(3, -1).T - NEAR
    near = group[meshed.at((place[:, None] + cube).reshape(-1, 3))].reshape(len(place), len(cube))
    of = meshed.at(place)
    for body in bodies:
        yield near[of == body]


def _owners(meshed: SolidComponents, known: SolidComponents) -> np.ndarray:
    """Body of `known` in which each body of `meshed` lies, int64 [m]; NONE if in none."""
    place = meshed.places(meshed.bodies)
    points = np.array(meshed.solid.origin) + meshed.solid.voxel * place
    theirs = known.at(np.round((points - known.solid.origin) / known.solid.voxel).astype(np.int64))
    within, result = known.inside[theirs], np.full(len(meshed.inside), NONE)
    result[meshed.at(place[within])] = theirs[within]
    return result


BAND = 2.0
"""Width of the sampled band around the capsules, voxels."""


class Capsules(Samples):
    """Capsules of one radius, as samples of the distance to them.

    Between samples, the squares of the distances to their axes are interpolated: less the square of the
    distance to any fixed point they are concave, so that interpolation makes no capsule thinner.
    """

    def __init__(self, bricks: Bricks, radius: float) -> None:
        super().__init__(bricks)
        self._radius = radius

    @cached_property
    def key(self) -> str:
        """`Field.key`."""
        return key(super().key, self._radius)

    def _interpolated(self, x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
        return self.native.capsule_values(x, y, z, self._radius)


def capsules(start: np.ndarray, end: np.ndarray, radius: float, like: Bricks) -> Capsules:
    """Sample the distance to capsules on the grid of given bricks.

    `start`, `end`: float64 [n, 3], scene units.
    """
    voxel, reach = like.voxel, radius / like.voxel + BAND
    low = np.floor(((np.minimum(start, end).min(0) - like.origin) / voxel - reach) / 8).astype(int) - 1
    high = np.ceil(((np.maximum(start, end).max(0) - like.origin) / voxel + reach) / 8).astype(int) + 1
    origin = np.asarray(like.origin) + 8 * voxel * low
    lines = _lines((start - origin) / voxel, (end - start) / voxel)
    points, of = _along(lines)
    touched = bricks_near(points, reach, tuple((high - low).tolist()))
    index = np.full(touched.shape, OUTSIDE, np.int32)
    index[touched] = np.arange(touched.sum())
    ijk = np.ascontiguousarray(8 * np.argwhere(touched), np.int32)
    squares = capsule_squares(lines, points, of, reach, ijk, index)
    x, y, z = origin.tolist()
    values = (np.sqrt(squares, out=squares) - np.float32(reach - BAND)) * np.float32(voxel)
    return Capsules(Bricks((x, y, z), voxel, ijk, values, index), radius)


def _lines(start: np.ndarray, along: np.ndarray) -> np.ndarray:
    """Start, direction vector and inverse squared length of each axis, float64 [n, 7]; 0 for balls."""
    square = (along**2).sum(1, keepdims=True)
    return np.hstack([start, along, np.divide(1, square, np.zeros_like(square), where=square > 1e-12)])


def _along(lines: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points on the axes, at most a voxel apart, float64 [m, 3], and axis numbers, int32 [m]."""
    pieces = np.ceil(np.linalg.norm(lines[:, 3:6], axis=1)).astype(np.int64)
    of = np.repeat(np.arange(len(lines), dtype=np.int32), pieces + 1)
    first = np.repeat(np.cumsum(pieces + 1) - pieces - 1, pieces + 1)
    share = (np.arange(len(of)) - first) / np.maximum(pieces[of], 1)
    return lines[of, :3] + share[:, None] * lines[of, 3:6], of
