"""A sampled field between its samples."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property

import numpy as np

from ..compiled import compiled
from ..formulas.box import Box
from ..formulas.field import Bounds, Device, Precision
from ..kernel import Kernel
from ..kernel.arrays import ArrayField
from ..keys import key
from ..volume import Bricks
from ..volume.bricks import INSIDE
from ..volume.lattice import BRICK

NEAR = 1.5
"""Voxels from the surface: the least that a point without samples is away from it."""

LIPSCHITZ = 1.8
"""Of samples of a distance, interpolated: each of the three slopes is at most 1, and they are never all so.
"""


class Samples(ArrayField):
    """Bricks of samples as a field over all space: trilinear between samples, elsewhere a lower bound of the
    distance, with its sign, from how many bricks away the nearest samples are. May be used from many threads.
    """

    def __init__(self, bricks: Bricks) -> None:
        self.bricks = bricks
        self.brick_bounds = _brick_bounds(bricks)

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

    def points(self, x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
        """Values at points, float64 of their shape."""
        b, out = self.bricks, np.empty(np.shape(x))
        u, v, w = (np.ascontiguousarray(a, np.float64).ravel() for a in (x, y, z))
        _interpolate(u, v, w, *b.origin, b.voxel, b.index, self.brick_bounds, b.values, out.ravel())
        return out


class _Interpolated(Kernel):
    """The kernel of samples."""

    def __init__(self, samples: Samples, dtype: np.dtype) -> None:
        self._samples, self.dtype = samples, dtype

    def points(self, x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
        """`Kernel.points`."""
        return self._samples.points(x, y, z).astype(self.dtype, copy=False)


def lengths(bricks: Bricks, bounds: Bounds, limit: float) -> Samples:
    """Samples of a field as distances that none is larger than, for walls and gaps up to `limit` scene units:
    its own values, or where those are far from distances, as of escape-time fractals, measured ones.
    """
    from .distances import distances

    if bounds.exterior_only:
        reach = limit / 2 + bricks.voxel
        return Samples(distances(bricks, reach, reach))
    return Samples(replace(bricks, values=bricks.values / np.float32(bounds.lipschitz)))


def _brick_bounds(bricks: Bricks) -> np.ndarray:
    """For each brick without samples, how far its points are from the surface at least, signed, float32."""
    from scipy.ndimage import distance_transform_cdt

    away = distance_transform_cdt(bricks.index < 0, metric="chessboard") if len(bricks) else bricks.index * 0
    far = np.maximum((away - 1) * BRICK, NEAR) * bricks.voxel
    return np.asarray(np.where(bricks.index == INSIDE, -far, far), np.float32)


@compiled
def _interpolate(xs, ys, zs, x0, y0, z0, voxel, index, brick_bounds, values, out):  # type: ignore[no-untyped-def]
    for n in range(len(xs)):
        out[n] = interpolated(xs[n], ys[n], zs[n], x0, y0, z0, voxel, index, brick_bounds, values)


@compiled
def interpolated(x, y, z, x0, y0, z0, voxel, index, brick_bounds, values):  # type: ignore[no-untyped-def]
    """The value at one point."""
    u, v, w = (x - x0) / voxel, (y - y0) / voxel, (z - z0) / voxel
    i, j, k = int(np.floor(u)), int(np.floor(v)), int(np.floor(w))
    u, v, w = u - i, v - j, w - k
    total = 0.0
    p, q, r = i & 7, j & 7, k & 7
    nx, ny, nz = index.shape
    known = 0 <= i < 8 * nx and 0 <= j < 8 * ny and 0 <= k < 8 * nz and max(p, q, r) < 7
    row = index[i >> 3, j >> 3, k >> 3] if known else 0
    if known and row < 0:
        return float(brick_bounds[i >> 3, j >> 3, k >> 3])
    first = 64 * p + 8 * q + r
    for corner in range(8):
        a, b, c = corner >> 2, (corner >> 1) & 1, corner & 1
        share = (u if a else 1 - u) * (v if b else 1 - v) * (w if c else 1 - w)
        if known:
            total += share * values[row, first + 64 * a + 8 * b + c]
        else:
            total += share * sample_at(index, brick_bounds, values, voxel, i + a, j + b, k + c)
    return total


@compiled
def sample_at(index, brick_bounds, values, voxel, i, j, k):  # type: ignore[no-untyped-def]
    """The sample of a grid point, or a bound; beyond the bricks, from how far beyond it is."""
    bi, bj, bk = i >> 3, j >> 3, k >> 3
    nx, ny, nz = index.shape
    if min(bi, bj, bk) < 0 or bi >= nx or bj >= ny or bk >= nz:
        beyond = max(max(-i, i - 8 * nx + 1), max(max(-j, j - 8 * ny + 1), max(-k, k - 8 * nz + 1)))
        return voxel * (NEAR + beyond - 1)
    row = index[bi, bj, bk]
    if row < 0:
        return float(brick_bounds[bi, bj, bk])
    return float(values[row, (i & 7) * 64 + (j & 7) * 8 + (k & 7)])


def positions(bricks: Bricks, rows: np.ndarray, offsets: np.ndarray) -> np.ndarray:
    """Grid indices of samples, int64 [n, 3], from their rows and their offsets in the bricks."""
    inner = np.stack([offsets >> 6, offsets >> 3 & 7, offsets & 7], -1)
    place: np.ndarray = bricks.ijk[rows].astype(np.int64) + inner
    return place
