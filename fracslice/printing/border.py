"""Where parts end and others begin, of those that touch as of those that are far apart."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..compiled import compiled
from ..volume import Bricks
from ..volume.bricks import INSIDE, OUTSIDE
from .components import Connected
from .samples import Samples

FAR = 255
"""Steps: more are not counted."""

REACH = 8
"""Voxels: samples farther from a border may have bricks without samples between, where it is not known."""


def nearer(found: Connected, these: np.ndarray, others: np.ndarray) -> Samples:
    """Negative where fewer samples are on the way to these parts than to the others: half the difference. So
    the border lies midway between them, and the surfaces of both stay as they are.
    """
    solid, components = found.solid, found.components
    rows, _ = components.samples(these)
    near, index = _around(solid, rows, np.isin(components.tiles, these))
    labels, ijk = components.labels[near], solid.ijk[near]
    to_these, to_others = (_steps(index, ijk, np.isin(labels, those)) for those in (these, others))
    half = np.clip((to_these.astype(np.float32) - to_others) / 2, -REACH, REACH)
    values = half * np.float32(solid.voxel)
    return Samples(replace(solid, ijk=ijk, values=values, index=index))


def _around(solid: Bricks, rows: np.ndarray, tiles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The rows of the bricks in and around some rows and some bricks without samples, and their index: these
    bricks are inside, all others outside.
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
    """From each sample to the nearest seed along edges of the grid, at most `FAR`: breadth first."""
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
            for way in (-1, 1):
                there, to = row, s + (way << shift)
                if not 0 <= at + way < 8:
                    there, to = beside(index, ijk, row, axis, way), to - (way << (shift + 3))
                if there >= 0 and steps[there, to] == FAR and steps[row, s] + 1 < FAR:
                    steps[there, to] = steps[row, s] + 1
                    queue[last] = 512 * there + to
                    last += 1
    return steps


@compiled
def beside(index, ijk, row, axis, way):  # type: ignore[no-untyped-def]
    """The row of the next brick along an axis, negative for none."""
    x, y, z = ijk[row, 0] >> 3, ijk[row, 1] >> 3, ijk[row, 2] >> 3
    x, y, z = x + way * (axis == 0), y + way * (axis == 1), z + way * (axis == 2)
    nx, ny, nz = index.shape
    return index[x, y, z] if 0 <= x < nx and 0 <= y < ny and 0 <= z < nz else -1
