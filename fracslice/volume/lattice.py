"""Sampling grid of a scene, and parallel evaluation of a field."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..common.memory import available_bytes
from ..common.messages import significant
from ..errors import GridError, TooLargeError, VolumeError
from ..fields.box import Box, Triple
from ..fields.field import Kernel
from ..work import Work, chunks

BRICK = 8
"""Grid points along the side of a brick."""

PADDING = 2.5
"""Voxels between the object's box and the first grid point, so that the outermost layer of samples is
outside.
"""

BESIDE = 0.1
"""Distance in voxels at which a face counts as next to a plane of grid points."""

MOST_BRICKS = 1024**3
"""Largest number of bricks in a lattice: 8192 voxels along each side."""

LARGE = 1 << 30
"""Memory that any machine has, bytes."""

BYTES_A_BRICK = 12
"""Memory of states and index for each brick of a lattice, sampled or not, bytes."""


@dataclass(frozen=True)
class Lattice:
    """Grid points at ``origin + voxel * (i, j, k)``.

    Attributes
    ----------
    origin
        Position of grid point (0, 0, 0), scene units.
    voxel
        Grid spacing, scene units.
    bricks
        Number of bricks of 8 grid points along each axis.
    """

    origin: Triple
    voxel: float
    bricks: tuple[int, int, int]

    @classmethod
    def around(cls, box: Box, voxel: float, solid: Box | None = None) -> Lattice:
        """Centre a lattice on a box.

        Parameters
        ----------
        box
            Box to cover, scene units.
        voxel
            Grid spacing, scene units.
        solid
            Bounds of the sampled solid, scene units. The grid is shifted so that its faces do not lie next to
            planes of grid points.

        Returns
        -------
        Lattice
            Lattice that covers the box and its padding.

        Raises
        ------
        VolumeError
            If `voxel` is no positive length, or the lattice would have too many points; `TooLargeError`
            where memory is too small for it.
        """
        if not (math.isfinite(voxel) and voxel > 0):
            raise VolumeError(f"voxel size {voxel!r}: expected a length > 0")
        counts = [math.ceil((s / voxel + 2 * PADDING + 1) / BRICK) for s in box.size]
        if math.prod(counts) > MOST_BRICKS:
            voxels = max(box.size) / voxel
            most = voxels * (MOST_BRICKS / math.prod(counts)) ** (1 / 3) - 2 * BRICK
            error = GridError(
                f"{voxels:.0f} voxels along the longest side make a grid of {_shape(counts)} bricks: "
                f"expected at most {most:.0f} voxels, or a voxel {significant(voxels / most)} times as large"
            )
            error.most = most
            raise error
        if (needed := math.prod(counts) * BYTES_A_BRICK) > LARGE and needed > (free := available_bytes()):
            raise TooLargeError(
                f"{max(box.size) / voxel:.0f} voxels along the longest side make a grid of {_shape(counts)} "
                f"bricks, which needs "
                f"{needed / 1e9:.1f} GB of memory, and {free / 1e9:.1f} GB are free"
            )
        start = [
            c - voxel * ((n * BRICK - 1) / 2 + (_aside((high - c) / voxel) if solid else 0))
            for c, n, high in zip(box.centre, counts, (solid or box).hi, strict=True)
        ]
        return cls((start[0], start[1], start[2]), voxel, (counts[0], counts[1], counts[2]))


def _aside(half: float) -> float:
    """Shift in voxels of a solid's centre from the middle between two grid points, given the distance of its
    faces from it: half a voxel where a face would lie next to a plane of grid points, else 0. A face just
    inside such a plane is known only from samples a voxel away, and features that end at its edges are cut
    off.
    """
    return 0.5 if abs(half - 0.5 - round(half - 0.5)) < BESIDE else 0.0


def _shape(counts: list[int]) -> str:
    return " x ".join(str(c) for c in counts)


def values_at(kernel: Kernel, points: np.ndarray, work: Work) -> np.ndarray:
    """Evaluate a field at many points on all threads.

    `points`: [3, n], scene units. Returns [n].
    """
    f = np.empty(points.shape[1], kernel.dtype)

    def task(part: slice) -> None:
        f[part] = kernel.points(*points[:, part])

    work.map(task, chunks(len(f), kernel.batch // 8))
    return f
