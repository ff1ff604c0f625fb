"""A sampled field, interpolated between its samples."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from ..common.compiled import compiled
from ..common.keys import key
from ..formulas.box import Box
from ..formulas.field import Bounds, Device, Precision
from ..kernel import Kernel
from ..kernel.arrays import ArrayField
from ..volume import Bricks
from ..volume.bricks import INSIDE, OUTSIDE
from ..volume.lattice import BRICK
from .interpolation import NEAR, Grid, advance, interpolate, mark_beside

LIPSCHITZ = 1.8
"""Lipschitz bound of interpolated distances: each of the three slopes is at most 1, never all at once."""


class Samples(ArrayField):
    """Bricks of samples as a field over all space.

    Values are trilinear between samples. Elsewhere they are signed lower bounds of the distance to the
    surface, from the number of bricks to the nearest samples. Safe to use from many threads.

    Parameters
    ----------
    bricks : Bricks
        The samples.
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

        Parameters
        ----------
        start, directions : float64 [n, 3]
            Origins and unit directions, scene units.
        far : float64 [n]
            Maximum distances, scene units.

        Returns
        -------
        float64 [n]
            Distances, at most `far`.
        """
        out = np.empty(len(far))
        advance(start, directions, far, self.grid, self.beside, out)
        return out

    def points(self, x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
        """Values at points.

        Parameters
        ----------
        x, y, z : array_like
            Coordinates, scene units.

        Returns
        -------
        float64
            Values, in the shape of `x`.
        """
        out = np.empty(np.shape(x))
        u, v, w = (np.ascontiguousarray(a, np.float64).ravel() for a in (x, y, z))
        interpolate(u, v, w, self.grid, out.ravel())
        return out


class _Interpolated(Kernel):
    """Kernel of a sampled field."""

    def __init__(self, samples: Samples, dtype: np.dtype) -> None:
        self._samples, self.dtype = samples, dtype

    def points(self, x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
        """`Kernel.points`."""
        return self._samples.points(x, y, z).astype(self.dtype, copy=False)


def together(solid: Bricks, added: Bricks) -> Bricks:
    """Unite two fields sampled on the same grid, possibly in different bricks.

    Returns
    -------
    Bricks
        Samples of the union.
    """
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

    Parameters
    ----------
    bricks : Bricks
        The samples.
    rows, offsets : int64 [n]
        Row of each sample's brick, and offset in the brick.

    Returns
    -------
    int64 [n, 3]
        Grid indices.
    """
    inner = np.stack([offsets >> 6, offsets >> 3 & 7, offsets & 7], -1)
    place: np.ndarray = bricks.ijk[rows].astype(np.int64) + inner
    return place
