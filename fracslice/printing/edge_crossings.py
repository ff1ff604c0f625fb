"""Crossings of a sampled surface with grid edges, and normals."""

from __future__ import annotations

import numpy as np

from ..common.compiled import compiled
from ..kernel import Kernel
from ..volume.evaluation import values_at
from ..work import Work
from .interpolation import SIDE, gather
from .samples import Samples

FIRST_SIZE = 8
"""Samples per crossing in the first allocation."""

ALONG = 0.999
"""Fraction of a normal's largest component above which another component ties with it."""


def edge_crossings(solid: Samples, rows: slice) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Crossings of the surface with grid edges that begin in some bricks.

    A smooth surface has one crossing for each grid line along the axis nearest to its normal.

    Returns
    -------
    points, normals : float64 [n, 3]
        Crossings, scene units, and unit normals.
    area : float64 [n]
        Surface that each crossing represents, squared scene units.
    """
    begin, end, _ = rows.indices(len(solid.bricks))
    n, size = (end - begin) * 512 // FIRST_SIZE, -1
    while n > size:
        size = n
        points, normals = np.empty((2, size, 3))
        area = np.empty(size)
        n = _cross(begin, end, solid.grid, points, normals, area)
    return points[:n].copy(), normals[:n].copy(), area[:n].copy()


def slopes(kernel: Kernel, points: np.ndarray, step: float, work: Work) -> tuple[np.ndarray, np.ndarray]:
    """Gradient of a field by central differences.

    Parameters
    ----------
    kernel : Kernel
        Kernel of the field.
    points : float64 [3, n]
        Points, scene units.
    step : float
        Distance from a point to either side, scene units.
    work : Work
        Threads and cancellation.

    Returns
    -------
    length, normals : [n], [3, n]
        Magnitude of the gradient, and unit normals.

    Raises
    ------
    Cancelled
        When the work is cancelled.
    """
    shifts = step * np.eye(3)[:, :, None]
    slope = np.stack(
        [values_at(kernel, points + s, work) - values_at(kernel, points - s, work) for s in shifts]
    )
    length = np.maximum(np.linalg.norm(slope, axis=0), 1e-30)
    return length / (2 * step), slope / length


@compiled
def _cross(begin, end, grid, points, normals, area):  # type: ignore[no-untyped-def]
    """Write the results of `crossed` as far as the arrays reach; return the number of crossings."""
    n, f = 0, np.empty(SIDE**3, np.float32)
    ijk, voxel = grid.ijk, grid.voxel
    for row in range(begin, end):
        gather(grid, row, f)
        for s in range(512):
            u, v, w = s >> 6, (s >> 3) & 7, s & 7
            at = (u + 1) * SIDE * SIDE + (v + 1) * SIDE + w + 1
            for axis in range(3):
                step = (SIDE * SIDE, SIDE, 1)[axis]
                if (f[at] < 0) == (f[at + step] < 0):
                    continue
                if n < len(area):
                    share = float(f[at]) / (float(f[at]) - float(f[at + step]))
                    points[n, 0] = grid.x0 + voxel * (ijk[row, 0] + u)
                    points[n, 1] = grid.y0 + voxel * (ijk[row, 1] + v)
                    points[n, 2] = grid.z0 + voxel * (ijk[row, 2] + w)
                    points[n, axis] += voxel * share
                    _across(f, at, axis, share, normals[n])
                    along = abs(normals[n, axis])
                    if along < ALONG * np.abs(normals[n]).max():
                        continue
                    area[n] = voxel * voxel / along
                n += 1
    return n


@compiled
def _across(f, at, axis, share, normal):  # type: ignore[no-untyped-def]
    """Write the unit normal at `share` along an edge, by interpolated central differences over a voxel."""
    along = (SIDE * SIDE, SIDE, 1)[axis]
    total = 0.0
    for k in range(3):
        step = (SIDE * SIDE, SIDE, 1)[k]
        if k != axis:
            here, there = f[at + step] - f[at - step], f[at + along + step] - f[at + along - step]
            slope = ((1 - share) * here + share * there) / 2
        elif share < 0.5:
            middle = f[at] + (share + 0.5) * (f[at + along] - f[at])
            slope = middle - f[at - along] - (share + 0.5) * (f[at] - f[at - along])
        else:
            middle = f[at] + (share - 0.5) * (f[at + along] - f[at])
            slope = f[at + along] + (share - 0.5) * (f[at + 2 * along] - f[at + along]) - middle
        normal[k] = slope
        total += slope * slope
    normal /= max(np.sqrt(total), 1e-30)
