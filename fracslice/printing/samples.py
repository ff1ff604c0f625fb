"""A sampled field, interpolated between its samples."""

from __future__ import annotations

from functools import cached_property
from typing import NamedTuple

import numpy as np

from ..common.cache import key
from ..common.compiled import compiled
from ..fields.box import Box
from ..fields.field import Bounds, Device, Kernel, Precision
from ..fields.tree import ArrayField
from ..volume import Bricks
from ..volume.bricks import INSIDE, OUTSIDE
from ..volume.lattice import BRICK

STRIDE = 0.5
"""Step along a ray, voxels."""

NEAR = 1.5
"""Minimum distance of unsampled points from the surface, voxels."""

SIDE = 11
"""Samples along each axis of a brick with one layer before it and two after it."""


class Grid(NamedTuple):
    """Samples for compiled functions."""

    x0: float  # origin, scene units
    y0: float
    z0: float
    voxel: float  # spacing, scene units
    ijk: np.ndarray  # as of `Bricks`: `row` is its index
    row: np.ndarray
    values: np.ndarray
    # signed lower bound of the distance to the surface in each unsampled brick, scene units
    bounds: np.ndarray


@compiled
def interpolate(xs, ys, zs, grid, out):  # type: ignore[no-untyped-def]
    """Write the values at points."""
    x0, y0, z0, voxel, _, index, values, bounds = grid
    for n in range(len(xs)):
        u, v, w = (xs[n] - x0) / voxel, (ys[n] - y0) / voxel, (zs[n] - z0) / voxel
        out[n] = between(u, v, w, voxel, index, bounds, values)


@compiled
def between(u, v, w, voxel, index, bounds, values):  # type: ignore[no-untyped-def]
    """Value at a point in voxels from the origin of the grid.

    `u`, `v`, `w` in voxels. Returns a value in scene units.
    """
    i, j, k = int(np.floor(u)), int(np.floor(v)), int(np.floor(w))
    u, v, w = u - i, v - j, w - k
    p, q, r = i & 7, j & 7, k & 7
    bi, bj, bk = i >> 3, j >> 3, k >> 3
    nx, ny, nz = index.shape
    within = 0 <= bi < nx and 0 <= bj < ny and 0 <= bk < nz
    row = index[bi, bj, bk] if within else 0
    if row < 0 and (max(p, q, r) < 7 or abs(bounds[bi, bj, bk]) > BRICK / 2 * voxel):
        return float(bounds[bi, bj, bk])
    if within and max(p, q, r) < 7:
        f, s = values[row], 64 * p + 8 * q + r
        a, b = (1 - w) * f[s] + w * f[s + 1], (1 - w) * f[s + 8] + w * f[s + 9]
        c, d = (1 - w) * f[s + 64] + w * f[s + 65], (1 - w) * f[s + 72] + w * f[s + 73]
        return (1 - u) * ((1 - v) * a + v * b) + u * ((1 - v) * c + v * d)
    total = 0.0
    for corner in range(8):
        a, b, c = corner >> 2, (corner >> 1) & 1, corner & 1
        share = (u if a else 1 - u) * (v if b else 1 - v) * (w if c else 1 - w)
        total += share * sample_at(index, bounds, values, voxel, i + a, j + b, k + c)
    return total


@compiled
def sample_at(index, bounds, values, voxel, i, j, k):  # type: ignore[no-untyped-def]
    """Sample at a grid point, or a bound if it has none.

    `i`, `j`, `k`: grid index, which may lie beyond the bricks.
    """
    bi, bj, bk = i >> 3, j >> 3, k >> 3
    nx, ny, nz = index.shape
    if min(bi, bj, bk) < 0 or bi >= nx or bj >= ny or bk >= nz:
        beyond = max(max(-i, i - 8 * nx + 1), max(max(-j, j - 8 * ny + 1), max(-k, k - 8 * nz + 1)))
        return voxel * (NEAR + beyond - 1)
    row = index[bi, bj, bk]
    if row < 0:
        return float(bounds[bi, bj, bk])
    return float(values[row, (i & 7) * 64 + (j & 7) * 8 + (k & 7)])


@compiled
def gather(grid, row, f):  # type: ignore[no-untyped-def]
    """Copy a brick's samples with one layer before them and two after them along each axis.

    `f`: float32 [SIDE**3].
    """
    index, values, bounds = grid.row, grid.values, grid.bounds
    x, y, z = grid.ijk[row, 0] >> 3, grid.ijk[row, 1] >> 3, grid.ijk[row, 2] >> 3
    nx, ny, nz = index.shape
    for a in range(3):
        for b in range(3):
            for c in range(3):
                u, v, w = x + a - 1, y + b - 1, z + c - 1
                known = 0 <= u < nx and 0 <= v < ny and 0 <= w < nz
                there = index[u, v, w] if known else -1
                flat = bounds[u, v, w] if known else bounds[x, y, z]
                for i in range((0, 1, 9)[a], (1, 9, 11)[a]):
                    for j in range((0, 1, 9)[b], (1, 9, 11)[b]):
                        to = (i * SIDE + j) * SIDE
                        at = (((i + 7) & 7) << 6) + (((j + 7) & 7) << 3)
                        for k in range((0, 1, 9)[c], (1, 9, 11)[c]):
                            f[to + k] = values[there, at + ((k + 7) & 7)] if there >= 0 else flat


@compiled
def mark_beside(grid, out):  # type: ignore[no-untyped-def]
    """Mark the samples with the opposite sign among the 26 samples around them; see `Samples.beside`."""
    f = np.empty(SIDE**3, np.float32)
    one, two = np.empty(SIDE**3, np.uint8), np.empty(SIDE**3, np.uint8)
    for row in range(len(grid.ijk)):
        gather(grid, row, f)
        for s in range(SIDE**3):
            one[s] = 1 if f[s] < 0 else 2
        for step in (1, SIDE, SIDE * SIDE):
            for s in range(step, SIDE**3 - step):
                two[s] = one[s - step] | one[s] | one[s + step]
            one, two = two, one
        for s in range(512):
            at = ((s >> 6) + 1) * SIDE * SIDE + (((s >> 3) & 7) + 1) * SIDE + (s & 7) + 1
            out[row, s] = one[at] == 3


@compiled
def advance(start, directions, far, grid, beside, out):  # type: ignore[no-untyped-def]
    """Write the distance along each ray to the first cell with the surface; see `Samples.free`."""
    x0, y0, z0, voxel, _, index, values, bounds = grid
    for n in range(len(far)):
        x, y, z = (start[n, 0] - x0) / voxel, (start[n, 1] - y0) / voxel, (start[n, 2] - z0) / voxel
        s = 0.0
        while s < far[n] / voxel:
            u, v, w = x + s * directions[n, 0], y + s * directions[n, 1], z + s * directions[n, 2]
            if is_beside(u, v, w, index, beside) and _is_mixed(u, v, w, voxel, index, bounds, values):
                break
            s += STRIDE
        out[n] = min(voxel * s, far[n])


@compiled
def _is_mixed(u, v, w, voxel, index, bounds, values):  # type: ignore[no-untyped-def]
    """True if the cell around a point, in voxels from the origin, has corners on both sides."""
    i, j, k = int(np.floor(u)), int(np.floor(v)), int(np.floor(w))
    inside = 0
    for corner in range(8):
        at = i + (corner >> 2), j + ((corner >> 1) & 1), k + (corner & 1)
        inside += sample_at(index, bounds, values, voxel, *at) < 0
    return 0 < inside < 8


@compiled
def is_beside(u, v, w, index, beside):  # type: ignore[no-untyped-def]
    """True if the nearest sample of a point is `Samples.beside`.

    `u`, `v`, `w`: voxels from the origin of the grid.
    """
    i, j, k = int(np.floor(u + 0.5)), int(np.floor(v + 0.5)), int(np.floor(w + 0.5))
    nx, ny, nz = index.shape
    x, y, z = i >> 3, j >> 3, k >> 3
    row = index[x, y, z] if 0 <= x < nx and 0 <= y < ny and 0 <= z < nz else -1
    return row >= 0 and beside[row, ((i & 7) << 6) + ((j & 7) << 3) + (k & 7)]


LIPSCHITZ = 1.8
"""Lipschitz bound of interpolated distances: each of the three slopes is at most 1, never all at once."""


class Samples(ArrayField):
    """Bricks of samples as a field over all space.

    Values are trilinear between samples. Elsewhere they are signed lower bounds of the distance to the
    surface, from the number of bricks to the nearest samples. Safe to use from many threads.
    """

    def __init__(self, bricks: Bricks) -> None:
        self.bricks = b = bricks
        self.grid = Grid(*b.origin, b.voxel, b.ijk, b.index, b.values, _brick_bounds(b))

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
    def beside(self) -> np.ndarray:
        """True for samples with the opposite sign among the 26 samples around them, bool [n, 512]."""
        out = np.empty(self.bricks.values.shape, np.bool_)
        mark_beside(self.grid, out)
        return out

    def free(self, start: np.ndarray, directions: np.ndarray, far: np.ndarray) -> np.ndarray:
        """Distance along rays to the first grid cell that contains the surface.

        `start`, `directions`: float64 [n, 3], scene units; `far`: float64 [n], scene units. Returns float64
        [n].
        """
        out = np.empty(len(far))
        advance(start, directions, far, self.grid, self.beside, out)
        return out

    def points(self, x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
        """Values at points.

        `x`, `y`, `z` in scene units.
        """
        out = np.empty(np.shape(x))
        u, v, w = (np.ascontiguousarray(a, np.float64).ravel() for a in (x, y, z))
        self._interpolate(u, v, w, out.ravel())
        return out

    def _interpolate(self, x: np.ndarray, y: np.ndarray, z: np.ndarray, out: np.ndarray) -> None:
        """Write the values at points, in scene units, to `out`."""
        interpolate(x, y, z, self.grid, out)


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
    values = np.empty((np.count_nonzero(sampled), 512), np.float32)
    _least(solid.values, rows[sampled], added.values, others[sampled], values)
    x, y, z = (np.array(solid.origin) + 8 * solid.voxel * low).tolist()
    ijk = np.ascontiguousarray(8 * np.argwhere(sampled), np.int32)
    return Bricks((x, y, z), solid.voxel, ijk, values, index)


def rows_of(bricks: Bricks, others: Bricks) -> np.ndarray:
    """Rows of the bricks at the places of others, on the same grid; int64 [n]."""
    shift = np.round((np.array(others.origin) - bricks.origin) / (8 * bricks.voxel)).astype(int)
    rows = bricks.index[tuple((others.ijk // 8 + shift).T)]
    return np.asarray(rows[rows >= 0], np.int64)


@compiled
def _least(some, rows, more, others, out):  # type: ignore[no-untyped-def]
    """Minimum of two fields, brick by brick; copies a brick that only one of them has."""
    for n in range(len(out)):
        if rows[n] < 0:
            out[n] = more[others[n]]
        elif others[n] < 0:
            out[n] = some[rows[n]]
        else:
            out[n] = np.minimum(some[rows[n]], more[others[n]])


def _brick_bounds(bricks: Bricks) -> np.ndarray:
    """Signed lower bound of the distance to the surface in each unsampled brick, float32 [bx, by, bz]."""
    from scipy.ndimage import distance_transform_cdt

    away = distance_transform_cdt(bricks.index < 0, metric="chessboard") if len(bricks) else bricks.index * 0
    far = np.maximum((away - 1) * BRICK, NEAR) * bricks.voxel
    return np.asarray(np.where(bricks.index == INSIDE, -far, far), np.float32)


def positions(bricks: Bricks, rows: np.ndarray, offsets: np.ndarray) -> np.ndarray:
    """Grid indices of samples.

    `rows`, `offsets`: int64 [n]. Returns int64 [n, 3].
    """
    inner = np.stack([offsets >> 6, offsets >> 3 & 7, offsets & 7], -1)
    place: np.ndarray = bricks.ijk[rows].astype(np.int64) + inner
    return place
