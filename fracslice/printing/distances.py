"""Distances from samples of any field, as far from its surface as is asked.

Beside the surface they follow from where it crosses the grid's edges. From there they spread in waves, by the
upwind differences of the eikonal equation (Zhao 2004), and only to samples that they still shorten.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..compiled import compiled
from ..volume import Bricks
from .border import beside

LESS = 0.01
"""Voxels: what shortens a distance by less is not told to its neighbours."""


def distances(bricks: Bricks, inside: float, outside: float) -> Bricks:
    """Signed distances to the surface of sampled bricks, scene units: right within `LESS`, up to so far on
    either side, and no larger.
    """
    within = bricks.values < 0
    far = np.where(within, np.float32(inside / bricks.voxel), np.float32(outside / bricks.voxel))
    around = np.empty((len(bricks), 6), np.int32)
    _surround(bricks.index, bricks.ijk, around)
    length = far
    settled = np.zeros(length.shape, np.bool_)
    _begin(bricks.values, around, length, settled)
    _spread(bricks.values, around, length, settled)
    length *= np.float32(bricks.voxel)
    return replace(bricks, values=np.where(within, -length, length))


@compiled
def _surround(index, ijk, around):  # type: ignore[no-untyped-def]
    """The rows of the bricks before and after each one, along each axis; negative for none."""
    for row in range(len(ijk)):
        for axis in range(3):
            for side in range(2):
                around[row, 2 * axis + side] = beside(index, ijk, row, axis, 2 * side - 1)


@compiled
def _next(around, row, s, side):  # type: ignore[no-untyped-def]
    """The row and the offset of a neighbour along the grid; a negative row for none. side: twice the axis,
    and one more for the neighbour after.
    """
    shift, way = 6 - 3 * (side >> 1), 2 * (side & 1) - 1
    if 0 <= ((s >> shift) & 7) + way < 8:
        return row, s + (way << shift)
    return around[row, side], s - (7 * way << shift)


@compiled
def _begin(values, around, length, settled):  # type: ignore[no-untyped-def]
    """Of samples with the surface on an edge beside them: to the plane through the nearest crossings."""
    for row in range(len(values)):
        for s in range(512):
            f, total = values[row, s], 0.0
            for axis in range(3):
                nearest = 2.0
                for side in (2 * axis, 2 * axis + 1):
                    there, to = _next(around, row, s, side)
                    if there >= 0 and (values[there, to] < 0) != (f < 0):
                        nearest = min(nearest, f / (f - values[there, to]))
                if nearest <= 1:
                    total += 1 / max(nearest, 1e-6) ** 2
            if total > 0:
                length[row, s], settled[row, s] = min(1 / np.sqrt(total), length[row, s]), True


@compiled
def _spread(values, around, length, settled):  # type: ignore[no-untyped-def]
    """Waves from what is settled. fresh: the wave, of two that take turns, in which a sample is looked at."""
    fresh, busy = np.zeros(length.shape, np.uint8), np.zeros(len(length), np.bool_)
    for row in range(len(length)):
        for s in range(512):
            if settled[row, s]:
                _tell(values, around, length, settled, fresh, busy, row, s, 1)
    now, later = 1, 2
    while busy.any():
        for at in np.flatnonzero(busy):
            row = int(at)
            busy[row] = False
            for s in range(512):
                busy[row] |= fresh[row, s] == later
                if fresh[row, s] == now:
                    fresh[row, s] = 0
                    shorter = _solved(values, around, length, row, s)
                    if shorter < length[row, s] - LESS:
                        length[row, s] = shorter
                        _tell(values, around, length, settled, fresh, busy, row, s, later)
        now, later = later, now


@compiled
def _tell(values, around, length, settled, fresh, busy, row, s, wave):  # type: ignore[no-untyped-def]
    """Neighbours on the same side that a distance may shorten are to be looked at."""
    for side in range(6):
        there, to = _next(around, row, s, side)
        if there < 0 or settled[there, to] or (values[there, to] < 0) != (values[row, s] < 0):
            continue
        if length[there, to] > length[row, s] + LESS and not fresh[there, to]:
            fresh[there, to], busy[there] = wave, True


@compiled
def _solved(values, around, length, row, s):  # type: ignore[no-untyped-def]
    """The distance that the nearer neighbour along each axis tells, voxels."""
    least = np.float32(np.inf)
    a = b = c = least
    for axis in range(3):
        nearest = least
        for side in (2 * axis, 2 * axis + 1):
            there, to = _next(around, row, s, side)
            if there >= 0 and (values[there, to] < 0) == (values[row, s] < 0):
                nearest = min(nearest, length[there, to])
        a, b, c = (nearest, a, b) if nearest < a else (a, nearest, b) if nearest < b else (a, b, nearest)
    far = a + np.float32(1)
    if far > b:
        far = (a + b + np.sqrt(2 - (a - b) ** 2)) / 2
        if far > c:
            total = a + b + c
            far = (total + np.sqrt(total * total - 3 * (a * a + b * b + c * c - 1))) / 3
    return np.float32(far)
