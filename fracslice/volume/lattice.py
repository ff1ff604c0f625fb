"""The grid a scene is sampled on."""

from __future__ import annotations

import math
from dataclasses import dataclass

from ..errors import VolumeError
from ..formulas.box import Box, Triple

BRICK = 8
PADDING = 2.5
"""Voxels between the object's box and the first grid point: the outermost layer of samples is outside."""

BESIDE = 0.1
"""Voxels."""

MOST_BRICKS = 512**3


@dataclass(frozen=True)
class Lattice:
    """Grid points at ``origin + voxel * (i, j, k)``, in `bricks` bricks of 8 along each axis."""

    origin: Triple
    voxel: float
    bricks: tuple[int, int, int]

    @classmethod
    def around(cls, box: Box, voxel: float, solid: Box | None = None) -> Lattice:
        """The lattice around the box' middle; solid: of what is to be sampled, whose faces shall not be
        beside planes of grid points.

        Raises `VolumeError` if it would have too many points.
        """
        if not (math.isfinite(voxel) and voxel > 0):
            raise VolumeError(f"voxel size {voxel!r}: expected a length > 0")
        counts = [math.ceil((s / voxel + 2 * PADDING + 1) / BRICK) for s in box.size]
        if math.prod(counts) > MOST_BRICKS:
            fits = voxel * (math.prod(counts) / MOST_BRICKS) ** (1 / 3)
            raise VolumeError(
                f"a voxel of {voxel:.4g} makes a grid of {_shape(counts)} bricks; "
                f"the finest that fits is {fits:.4g}"
            )
        start = [
            c - voxel * ((n * BRICK - 1) / 2 + (_aside((high - c) / voxel) if solid else 0))
            for c, n, high in zip(box.centre, counts, (solid or box).hi, strict=True)
        ]
        return cls((start[0], start[1], start[2]), voxel, (counts[0], counts[1], counts[2]))


def _aside(half: float) -> float:
    """How far the middle of a solid is from the middle between two grid points, in voxels, if its faces are
    so many from it: half a voxel where these would be beside planes of grid points. Just inside of one, a
    face is known from samples a voxel away, and what ends at its edges is cut off."""
    return 0.5 if abs(half - 0.5 - round(half - 0.5)) < BESIDE else 0.0


def _shape(counts: list[int]) -> str:
    return " x ".join(str(c) for c in counts)
