"""Distance to many capsules (balls and round-ended struts), sampled on bricks around them."""

from __future__ import annotations

import numpy as np

from ..common.compiled import compiled
from ..volume import Bricks
from ..volume.bricks import OUTSIDE
from .samples import Samples

BAND = 2.0
"""Width of the sampled band around the capsules, voxels."""


def capsules(start: np.ndarray, end: np.ndarray, radius: float, like: Bricks) -> Samples:
    """Sample the distance to capsules on the grid of given bricks.

    Parameters
    ----------
    start, end : float64 [n, 3]
        Ends of the axes, scene units; equal ends make a ball.
    radius : float
        Scene units.
    like : Bricks
        Samples whose grid is used.

    Returns
    -------
    Samples
        The union of the capsules, in bricks of its own.
    """
    voxel, reach = like.voxel, radius / like.voxel + BAND
    low = np.floor(((np.minimum(start, end).min(0) - like.origin) / voxel - reach) / 8).astype(int) - 1
    high = np.ceil(((np.maximum(start, end).max(0) - like.origin) / voxel + reach) / 8).astype(int) + 1
    origin = np.asarray(like.origin) + 8 * voxel * low
    lines = _lines((start - origin) / voxel, (end - start) / voxel)
    points, of = _along(lines)
    index = np.full(high - low, OUTSIDE, np.int32)
    _mark(points, reach, index)
    touched = index >= 0
    index[touched] = np.arange(touched.sum())
    ijk = np.ascontiguousarray(8 * np.argwhere(touched), np.int32)
    squares = np.full((len(ijk), 512), reach**2, np.float32)
    _shorten(lines, points, of, reach, index, squares)
    x, y, z = origin.tolist()
    values = (np.sqrt(squares, out=squares) - np.float32(reach - BAND)) * np.float32(voxel)
    return Samples(Bricks((x, y, z), voxel, ijk, values, index))


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


@compiled
def _mark(points, reach, index):  # type: ignore[no-untyped-def]
    """Mark the bricks within `reach` voxels of the points."""
    for n in range(len(points)):
        x, y, z = points[n]
        for i in range(int(x - reach) >> 3, (int(x + reach) >> 3) + 1):
            for j in range(int(y - reach) >> 3, (int(y + reach) >> 3) + 1):
                for k in range(int(z - reach) >> 3, (int(z + reach) >> 3) + 1):
                    index[i, j, k] = 0


@compiled
def _shorten(lines, points, of, reach, index, squares):  # type: ignore[no-untyped-def]
    """Lower the squared distances of samples to those of nearer capsules.

    Every sample within reach of a capsule is within reach plus half a voxel of one of its axis points.
    """
    far = reach + 0.5
    for m in range(len(points)):
        x, y, z = points[m]
        n = of[m]
        a, b, c, inverse = lines[n, 3], lines[n, 4], lines[n, 5], lines[n, 6]
        for i in range(int(np.ceil(x - far)), int(x + far) + 1):
            for j in range(int(np.ceil(y - far)), int(y + far) + 1):
                u, v = i - lines[n, 0], j - lines[n, 1]
                left = far * far - (i - x) ** 2 - (j - y) ** 2
                if left < 0:
                    continue
                for k in range(int(np.ceil(z - np.sqrt(left))), int(z + np.sqrt(left)) + 1):
                    w = k - lines[n, 2]
                    t = min(max((u * a + v * b + w * c) * inverse, 0.0), 1.0)
                    square = (u - t * a) ** 2 + (v - t * b) ** 2 + (w - t * c) ** 2
                    row, s = index[i >> 3, j >> 3, k >> 3], ((i & 7) << 6) + ((j & 7) << 3) + (k & 7)
                    squares[row, s] = min(squares[row, s], np.float32(square))
