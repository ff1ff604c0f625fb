"""A sampled field, interpolated between its samples."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from .._native import SampledField, least
from ..common.cache import key
from ..fields.box import Box
from ..fields.field import Bounds, Device, Kernel, Precision
from ..fields.tree import ArrayField
from ..volume import Bricks
from ..volume.bricks import INSIDE, OUTSIDE
from ..volume.lattice import BRICK

LIPSCHITZ = 1.8
"""Lipschitz bound of interpolated distances: each of the three slopes is at most 1, never all at once."""


class Samples(ArrayField):
    """Bricks of samples as a field over all space.

    Values are trilinear between samples. Elsewhere they are signed lower bounds of the distance to the
    surface, from the number of bricks to the nearest samples. Safe to use from many threads.
    """

    def __init__(self, bricks: Bricks) -> None:
        self.bricks = bricks

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
    def native(self) -> SampledField:
        """Evaluator of the field."""
        b = self.bricks
        return SampledField(b.origin, b.voxel, b.ijk, b.values, b.index)

    def free(self, start: np.ndarray, directions: np.ndarray, far: np.ndarray) -> np.ndarray:
        """Distance along rays to the first grid cell that contains the surface.

        `start`, `directions`: float64 [n, 3], scene units; `far`: float64 [n], scene units. Returns float64
        [n].
        """
        return self.native.free(start, directions, far)

    def points(self, x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
        """Values at points.

        `x`, `y`, `z` in scene units.
        """
        u, v, w = (np.ascontiguousarray(a, np.float64).ravel() for a in (x, y, z))
        return self._interpolated(u, v, w).reshape(np.shape(x))

    def _interpolated(self, x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
        """Values at points [n], in scene units."""
        return self.native.values(x, y, z)


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
    values = least(solid.values, rows[sampled], added.values, others[sampled])
    x, y, z = (np.array(solid.origin) + 8 * solid.voxel * low).tolist()
    ijk = np.ascontiguousarray(8 * np.argwhere(sampled), np.int32)
    return Bricks((x, y, z), solid.voxel, ijk, values, index)


def rows_of(bricks: Bricks, others: Bricks) -> np.ndarray:
    """Rows of the bricks at the places of others, on the same grid; int64 [n]."""
    shift = np.round((np.array(others.origin) - bricks.origin) / (8 * bricks.voxel)).astype(int)
    rows = bricks.index[tuple((others.ijk // 8 + shift).T)]
    return np.asarray(rows[rows >= 0], np.int64)


def positions(bricks: Bricks, rows: np.ndarray, offsets: np.ndarray) -> np.ndarray:
    """Grid indices of samples.

    `rows`, `offsets`: int64 [n]. Returns int64 [n, 3].
    """
    inner = np.stack([offsets >> 6, offsets >> 3 & 7, offsets & 7], -1)
    place: np.ndarray = bricks.ijk[rows].astype(np.int64) + inner
    return place
