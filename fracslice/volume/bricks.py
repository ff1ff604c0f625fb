"""Bricks of samples around a surface: the output of the sampler, the input of the mesher; OpenVDB grids."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any
from uuid import UUID

import numpy as np

from ..errors import VolumeError

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
    grid = to_grid(bricks)
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
