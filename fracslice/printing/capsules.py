"""The distance to many balls and struts, on bricks around them.

Each sample learns from its neighbours which stroke is nearest, in waves that start at the strokes (a vector
distance transform: Danielsson 1980); then the strokes beside that one are looked at, too.
"""

from __future__ import annotations

import numpy as np

from ..compiled import compiled
from ..volume import Bricks
from ..volume.bricks import OUTSIDE
from .samples import Samples

BAND = 2.0
"""Voxels around the strokes that are sampled."""

NONE = -1


def capsules(start: np.ndarray, end: np.ndarray, radius: float, like: Bricks) -> Samples:
    """The field of round-ended strokes from start to end, float64 [n, 3], scene units; balls where they are
    the same. Sampled on the grid of `like`, in bricks of its own.
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
    nearest = np.full(squares.shape, NONE, np.int32)
    _spread(lines, points, of, index, ijk, squares, nearest)
    near = max(reach - BAND - 1, 0), reach - BAND + 1
    _settle(lines, points, of, index, ijk, squares, nearest, near[0] ** 2, near[1] ** 2)
    x, y, z = origin.tolist()
    values = (np.sqrt(squares, out=squares) - np.float32(reach - BAND)) * np.float32(voxel)
    return Samples(Bricks((x, y, z), voxel, ijk, values, index))


def _lines(start: np.ndarray, along: np.ndarray) -> np.ndarray:
    """Where strokes begin, how they go on, and the inverse square of their length: float64 [n, 7]."""
    square = (along**2).sum(1, keepdims=True)
    return np.hstack([start, along, np.divide(1, square, np.zeros_like(square), where=square > 1e-12)])


def _along(lines: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Points on strokes, a voxel apart at most, float64 [m, 3], and whose they are, int32 [m]."""
    pieces = np.ceil(np.linalg.norm(lines[:, 3:6], axis=1)).astype(np.int64)
    of = np.repeat(np.arange(len(lines), dtype=np.int32), pieces + 1)
    first = np.repeat(np.cumsum(pieces + 1) - pieces - 1, pieces + 1)
    share = (np.arange(len(of)) - first) / np.maximum(pieces[of], 1)
    return lines[of, :3] + share[:, None] * lines[of, 3:6], of


@compiled
def _mark(points, reach, index):  # type: ignore[no-untyped-def]
    for n in range(len(points)):
        x, y, z = points[n]
        for i in range(int(x - reach) >> 3, (int(x + reach) >> 3) + 1):
            for j in range(int(y - reach) >> 3, (int(y + reach) >> 3) + 1):
                for k in range(int(z - reach) >> 3, (int(z + reach) >> 3) + 1):
                    index[i, j, k] = 0


@compiled
def _foot(lines, n, x, y, z):  # type: ignore[no-untyped-def]
    """From the nearest point of a stroke's middle line to a point."""
    u, v, w = x - lines[n, 0], y - lines[n, 1], z - lines[n, 2]
    a, b, c = lines[n, 3], lines[n, 4], lines[n, 5]
    t = min(max((u * a + v * b + w * c) * lines[n, 6], 0.0), 1.0)
    return u - t * a, v - t * b, w - t * c


@compiled
def _square(lines, n, x, y, z):  # type: ignore[no-untyped-def]
    u, v, w = _foot(lines, n, x, y, z)
    return np.float32(u * u + v * v + w * w)


@compiled
def _offset(x, y, z):  # type: ignore[no-untyped-def]
    return ((x & 7) << 6) + ((y & 7) << 3) + (z & 7)


@compiled
def _spread(lines, points, of, index, ijk, squares, nearest):  # type: ignore[no-untyped-def]
    """Waves from the corners of the cells that the points are in. fresh: in which wave, of two that take
    turns, a sample has to tell its neighbours.
    """
    fresh, busy = np.zeros(squares.shape, np.uint8), np.zeros(len(squares), np.bool_)
    for m in range(len(points)):
        x, y, z = int(points[m, 0]), int(points[m, 1]), int(points[m, 2])
        for i in range(x, x + 2):
            for j in range(y, y + 2):
                for k in range(z, z + 2):
                    square = _square(lines, of[m], i, j, k)
                    row, s = index[i >> 3, j >> 3, k >> 3], _offset(i, j, k)
                    if square < squares[row, s]:
                        squares[row, s], nearest[row, s], fresh[row, s], busy[row] = square, of[m], 1, True
    now, later = 1, 2
    while busy.any():
        for row in np.flatnonzero(busy):
            busy[row] = False
            for s in range(512):
                busy[row] |= fresh[row, s] == later
                if fresh[row, s] != now:
                    continue
                fresh[row, s], n = 0, nearest[row, s]
                x, y, z = ijk[row, 0] + (s >> 6), ijk[row, 1] + ((s >> 3) & 7), ijk[row, 2] + (s & 7)
                for i in range(x - 1, x + 2):
                    for j in range(y - 1, y + 2):
                        for k in range(z - 1, z + 2):
                            there, to = index[i >> 3, j >> 3, k >> 3], _offset(i, j, k)
                            square = _square(lines, n, i, j, k)
                            if there >= 0 and square < squares[there, to]:
                                squares[there, to], nearest[there, to] = square, n
                                fresh[there, to], busy[there] = later, True
        now, later = later, now


@compiled
def _settle(lines, points, of, index, ijk, squares, nearest, low, high):  # type: ignore[no-untyped-def]
    """Of samples at edges of the grid that the surface may cross, also the strokes with points in the cells
    beside where the nearest one is nearest.
    """
    last, before = np.full(squares.shape, NONE, np.int32), np.empty(len(points), np.int32)
    for m in range(len(points)):
        x, y, z = int(points[m, 0]), int(points[m, 1]), int(points[m, 2])
        row, s = index[x >> 3, y >> 3, z >> 3], _offset(x, y, z)
        before[m], last[row, s] = last[row, s], m
    for row in range(len(squares)):
        for s in range(512):
            if not low <= squares[row, s] < high:
                continue
            x, y, z = ijk[row, 0] + (s >> 6), ijk[row, 1] + ((s >> 3) & 7), ijk[row, 2] + (s & 7)
            u, v, w = _foot(lines, nearest[row, s], x, y, z)
            u, v, w = int(x - u), int(y - v), int(z - w)
            for i in range(u - 1, u + 2):
                for j in range(v - 1, v + 2):
                    for k in range(w - 1, w + 2):
                        there = index[i >> 3, j >> 3, k >> 3]
                        m = last[there, _offset(i, j, k)] if there >= 0 else NONE
                        while m != NONE:
                            squares[row, s] = min(squares[row, s], _square(lines, of[m], x, y, z))
                            m = before[m]
