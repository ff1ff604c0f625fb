"""Sampling grid of a scene, and bricks of samples around a surface: the output of the sampler, the input of
the mesher; OpenVDB grids.
"""

from __future__ import annotations

import hashlib
import math
import os
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any
from uuid import UUID

import numpy as np

from ..common.memory import available_bytes
from ..common.messages import significant
from ..errors import GridError, TooLargeError, VolumeError
from ..fields.box import Box, Triple
from ..fields.field import Kernel
from ..work import Work, chunks

if TYPE_CHECKING:
    from .._vdb import Grid


OUTSIDE, INSIDE = -1, -2


@dataclass(frozen=True, eq=False, kw_only=True)
class SamplingCounts:
    """Counts of what a sampling took.

    Attributes
    ----------
    evaluations
        Field evaluations, probing included.
    repaired
        Bricks that a violated bound would have lost, detected by the audit or the closure rule, and sampled.
    audited
        Points tested outside the samples to verify the bounds that pruning relies on.
    proved
        Share of the unsampled bricks whose sign is proved; None if it was not determined. The rest relies on
        a measured bound.
    """

    evaluations: int = 0
    repaired: int = 0
    audited: int = 0
    proved: float | None = None

    @property
    def counts(self) -> dict[str, Any]:
        """The counts by name."""
        return {f.name: getattr(self, f.name) for f in fields(SamplingCounts)}


@dataclass(frozen=True, eq=False)
class Bricks(SamplingCounts):
    """Samples of a signed field on the grid points near its zero set.

    No sign change crosses a face between a brick with samples and one without, or between two without;
    everything beyond `index` is outside. The surface is therefore closed and lies within the samples.

    Attributes
    ----------
    origin
        Position of grid point (0, 0, 0), scene units.
    voxel
        Grid spacing, scene units.
    ijk
        Grid index of each brick's first sample, int32 [n, 3], C-contiguous: multiples of 8, in lexicographic
        order.
    values
        Samples, float32 [n, 512], at offset x*64 + y*8 + z; negative inside, never NaN.
    index
        Row of each brick, int32 [bx, by, bz]; `OUTSIDE` or `INSIDE` where no samples are needed.
    """

    origin: tuple[float, float, float]
    voxel: float
    ijk: np.ndarray
    values: np.ndarray
    index: np.ndarray

    def __len__(self) -> int:
        return len(self.ijk)

    @property
    def signs(self) -> SignBricks:
        """Signs of the samples."""
        from .._native import signs

        return SignBricks(self.origin, self.voxel, self.ijk, signs(self.values), self.index, **self.counts)


@dataclass(frozen=True, eq=False)
class SignBricks(SamplingCounts):
    """Bricks with one bit per sample: enough to extract a known field's surface, in 1/32 of the memory.

    Attributes
    ----------
    signs
        Sign bits, uint8 [n, 8, 8]: bit z of byte (x, y) is set inside.
    origin, voxel, ijk, index
        As in `Bricks`.
    """

    origin: tuple[float, float, float]
    voxel: float
    ijk: np.ndarray
    signs: np.ndarray
    index: np.ndarray

    @classmethod
    def without(cls, lattice: Lattice, evaluations: int) -> SignBricks:
        """No bricks of a lattice, for a surface that is made without samples.

        Parameters
        ----------
        lattice
            The lattice.
        evaluations
            Evaluations that the surface took.

        Returns
        -------
        SignBricks
            No signs.
        """
        index = np.full(lattice.bricks, OUTSIDE, np.int32)
        bits, none = np.empty((0, 8, 8), np.uint8), np.empty((0, 3), np.int32)
        return cls(lattice.origin, lattice.voxel, none, bits, index, evaluations=evaluations)

    def __len__(self) -> int:
        return len(self.ijk)


NAME = "surface"
"""Grid name in a file: OpenVDB's name for the level set of a solid."""

UUID_AT, UUID_SIZE = 21, 36
"""Place of a file's identifier: after magic number, versions of file and library, and a flag."""


def to_grid(bricks: Bricks) -> Grid:
    """Convert bricks to an OpenVDB level set: sampled voxels are active, the interior is filled with tiles.

    The background value is the largest sample.
    """
    from .._vdb import Grid

    x, y, z = (float(v) for v in bricks.origin)
    try:
        grid = Grid.from_bricks(bricks.ijk, bricks.values, bricks.index, (x, y, z), bricks.voxel)
    except ValueError as error:
        raise VolumeError(f"cannot make a grid of the samples: {error}") from None
    grid.name = NAME
    return grid


def from_grid(grid: Grid) -> Bricks:
    """Convert an OpenVDB grid to bricks, one per leaf node."""
    try:
        origin, voxel, ijk, values, index = grid.to_bricks()
    except ValueError as error:
        raise VolumeError(f"grid {grid.name!r}: {error}") from None
    if np.isnan(values).any():
        raise VolumeError(f"grid {grid.name!r}: it holds samples that are not numbers")
    x, y, z = origin
    return Bricks((x, y, z), voxel, ijk, values, index)


def write_vdb(
    bricks: Bricks, path: str | os.PathLike[str], metadata: Mapping[str, str] | None = None
) -> None:
    """Write bricks to a .vdb file with one grid named `NAME`."""
    write_grid(to_grid(bricks), path, metadata)


def write_grid(grid: Grid, path: str | os.PathLike[str], metadata: Mapping[str, str] | None = None) -> None:
    """Write a grid to a .vdb file."""
    try:
        grid.write(os.fspath(path), dict(metadata or {}))
    except RuntimeError as error:
        raise VolumeError(f"cannot write {error}") from None
    _identify(path)


def _identify(path: str | os.PathLike[str]) -> None:
    """Make the identifier of a file follow from its contents; OpenVDB draws it at random."""
    with open(path, "r+b") as file:
        file.seek(UUID_AT + UUID_SIZE)
        digest = hashlib.file_digest(file, "sha256").digest()
        file.seek(UUID_AT)
        file.write(str(UUID(bytes=digest[:16], version=5)).encode())


def read_vdb(path: str | os.PathLike[str], name: str = "") -> Bricks:
    """Read bricks from a .vdb file."""
    from .._vdb import Grid

    try:
        grid = Grid.read(os.fspath(path), name)
    except RuntimeError as error:
        raise VolumeError(f"cannot read {error}") from None
    return from_grid(grid)


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
