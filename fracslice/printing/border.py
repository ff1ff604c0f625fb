"""Borders midway between connected components, touching or far apart."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..common.compiled import compiled
from ..volume import Bricks
from ..volume.bricks import INSIDE, OUTSIDE
from .samples import Samples
from .solid_components import SolidComponents

FAR = 255
"""Number of grid steps at which the search stops; unreached samples keep this value."""

REACH = 8
"""Largest distance from a border, voxels. Farther off, unsampled bricks may lie between, which the search
cannot cross.
"""


def nearer(components: SolidComponents, these: np.ndarray, others: np.ndarray) -> Samples:
    """A field that is negative nearer to some components than to others.

    The value is half the difference of the grid steps to either, so the border lies midway between them. The
    surfaces of both stay unchanged.

    Parameters
    ----------
    components : SolidComponents
        Components of a sampled solid.
    these, others : int64 [k]
        Numbers of the components on the negative and on the positive side.

    Returns
    -------
    Samples
        The field in scene units, at most `REACH` voxels in magnitude, on bricks in and around `these`.
    """
    solid, (samples, tiles) = components.solid, components.masks(these)
    near, index = _around(solid, np.any(samples, axis=1), tiles)
    labels, ijk = components.labels[near], solid.ijk[near]
    to_these, to_others = (_steps(index, ijk, np.isin(labels, those)) for those in (these, others))
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


@compiled
def _steps(index, ijk, seeds):  # type: ignore[no-untyped-def]
    """Grid steps from each sample to the nearest seed, at most `FAR`, by breadth-first search."""
    steps = np.full(seeds.shape, FAR, np.uint8)
    queue = np.empty(seeds.size, np.int32)
    first, last = 0, 0
    for row in range(len(seeds)):
        for s in range(512):
            if seeds[row, s]:
                steps[row, s] = 0
                queue[last] = 512 * row + s
                last += 1
    while first < last:
        row, s = queue[first] >> 9, queue[first] & 511
        first += 1
        for axis in range(3):
            shift = 6 - 3 * axis
            at = (s >> shift) & 7
            for sign in (-1, 1):
                there, to = row, s + (sign << shift)
                if not 0 <= at + sign < 8:
                    there, to = adjacent_row(index, ijk, row, axis, sign), to - (sign << (shift + 3))
                if there >= 0 and steps[there, to] == FAR and steps[row, s] + 1 < FAR:
                    steps[there, to] = steps[row, s] + 1
                    queue[last] = 512 * there + to
                    last += 1
    return steps


@compiled
def adjacent_row(index, ijk, row, axis, sign):  # type: ignore[no-untyped-def]
    """Row of the adjacent brick along an axis.

    Parameters
    ----------
    index, ijk : int32 [bx, by, bz], int32 [n, 3]
        As of `Bricks`.
    row, axis, sign : int
        Row of the brick, axis 0 to 2, and direction, -1 or 1.

    Returns
    -------
    int
        Negative if the adjacent brick has no samples or does not exist.
    """
    x, y, z = ijk[row, 0] >> 3, ijk[row, 1] >> 3, ijk[row, 2] >> 3
    x, y, z = x + sign * (axis == 0), y + sign * (axis == 1), z + sign * (axis == 2)
    nx, ny, nz = index.shape
    return index[x, y, z] if 0 <= x < nx and 0 <= y < ny and 0 <= z < nz else -1
