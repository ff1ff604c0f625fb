"""The grid a scene is sampled on."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ..errors import VolumeError
from ..formulas.box import Box, Triple

BRICK = 8
PADDING = 2.5
"""Voxels between the object's box and the first grid point: the outermost layer of samples is outside."""

MOST_BRICKS = 512**3


@dataclass(frozen=True)
class Lattice:
    """Grid points at ``origin + voxel * (i, j, k)``, in `bricks` bricks of 8 along each axis."""

    origin: Triple
    voxel: float
    bricks: tuple[int, int, int]

    @classmethod
    def around(cls, box: Box, voxel: float) -> Lattice:
        """The lattice around the box' middle. Raises `VolumeError` if it would have too many points."""
        if not (math.isfinite(voxel) and voxel > 0):
            raise VolumeError(f"voxel size {voxel!r}: expected a length > 0")
        counts = [math.ceil((s / voxel + 2 * PADDING + 1) / BRICK) for s in box.size]
        if math.prod(counts) > MOST_BRICKS:
            fits = voxel * (math.prod(counts) / MOST_BRICKS) ** (1 / 3)
            raise VolumeError(
                f"a voxel of {voxel:.4g} makes a grid of {_shape(counts)} bricks; "
                f"the finest that fits is {fits:.4g}"
            )
        start = [c - voxel * (n * BRICK - 1) / 2 for c, n in zip(box.centre, counts, strict=True)]
        return cls((start[0], start[1], start[2]), voxel, (counts[0], counts[1], counts[2]))


def _shape(counts: list[int]) -> str:
    return " x ".join(str(c) for c in counts)
