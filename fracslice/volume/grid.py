"""Conversion of bricks to and from OpenVDB grids, sparse level sets that other programs read."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Mapping
from typing import TYPE_CHECKING
from uuid import UUID

import numpy as np

from ..errors import VolumeError
from .bricks import Bricks

if TYPE_CHECKING:
    from .._vdb import Grid

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
