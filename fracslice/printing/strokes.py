"""The distance to many balls and struts, on bricks around them."""

from __future__ import annotations

import numpy as np
from numba import njit

from ..volume import Bricks
from ..volume.bricks import OUTSIDE
from .samples import Samples

BAND = 2.0
"""Voxels around the strokes that are sampled."""


def strokes(start: np.ndarray, end: np.ndarray, radius: float, like: Bricks) -> Samples:
    """The field of round-ended strokes from start to end, float64 [n, 3], scene units; balls where they are
    the same. Sampled on the grid of `like`, in bricks of its own.
    """
    voxel, reach = like.voxel, radius + BAND * like.voxel
    low = np.floor((np.minimum(start, end).min(0) - reach - like.origin) / (8 * voxel)).astype(int) - 1
    high = np.ceil((np.maximum(start, end).max(0) + reach - like.origin) / (8 * voxel)).astype(int) + 1
    origin = np.asarray(like.origin) + 8 * voxel * low
    index = np.full(high - low, OUTSIDE, np.int32)
    a, b = (start - origin) / voxel, (end - origin) / voxel
    _mark(a, b, reach / voxel, index)
    touched = index >= 0
    index[touched] = np.arange(touched.sum())
    ijk = np.ascontiguousarray(8 * np.argwhere(touched), np.int32)
    values = np.full((len(ijk), 512), BAND, np.float32)
    _stroke(a, b, radius / voxel, index, values)
    x, y, z = origin.tolist()
    return Samples(Bricks((x, y, z), voxel, ijk, values * np.float32(voxel), index))


@njit(cache=True, nogil=True)
def _range(a, b, reach, axis):  # type: ignore[no-untyped-def]
    low, high = min(a[axis], b[axis]) - reach, max(a[axis], b[axis]) + reach
    return int(np.floor(low)), int(np.ceil(high)) + 1


@njit(cache=True, nogil=True)
def _mark(start, end, reach, index):  # type: ignore[no-untyped-def]
    for n in range(len(start)):
        (x0, x1), (y0, y1), (z0, z1) = (
            _range(start[n], end[n], reach, 0),
            _range(start[n], end[n], reach, 1),
            _range(start[n], end[n], reach, 2),
        )
        index[x0 >> 3 : (x1 >> 3) + 1, y0 >> 3 : (y1 >> 3) + 1, z0 >> 3 : (z1 >> 3) + 1] = 0


@njit(cache=True, nogil=True)
def _stroke(start, end, radius, index, values):  # type: ignore[no-untyped-def]
    reach = radius + BAND
    for n in range(len(start)):
        a, along = start[n], end[n] - start[n]
        square = max((along * along).sum(), 1e-30)
        (x0, x1), (y0, y1), (z0, z1) = (
            _range(start[n], end[n], reach, 0),
            _range(start[n], end[n], reach, 1),
            _range(start[n], end[n], reach, 2),
        )
        for x in range(x0, x1):
            for y in range(y0, y1):
                for z in range(z0, z1):
                    u, v, w = x - a[0], y - a[1], z - a[2]
                    t = (u * along[0] + v * along[1] + w * along[2]) / square
                    t = min(max(t, 0.0), 1.0)
                    u, v, w = u - t * along[0], v - t * along[1], w - t * along[2]
                    f = np.sqrt(u * u + v * v + w * w) - radius
                    row = index[x >> 3, y >> 3, z >> 3]
                    s = (x & 7) * 64 + (y & 7) * 8 + (z & 7)
                    if f < values[row, s]:
                        values[row, s] = f
