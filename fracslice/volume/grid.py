"""Bricks as OpenVDB grids: sparse level sets that other programs read."""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from ..errors import VolumeError
from .bricks import Bricks

if TYPE_CHECKING:
    from .._native import Grid

NAME = "surface"
"""The name of the grid in a file: what OpenVDB calls a level set of a solid."""


def to_grid(bricks: Bricks) -> Grid:
    """The bricks as an OpenVDB level set: active where sampled, the inside filled with tiles.

    Its background is the largest sample. Raises `VolumeError` if the arrays contradict each other.
    """
    from .._native import Grid

    x, y, z = (float(v) for v in bricks.origin)
    try:
        grid = Grid.from_bricks(bricks.ijk, bricks.values, bricks.index, (x, y, z), bricks.voxel)
    except ValueError as error:
        raise VolumeError(f"cannot make a grid of the samples: {error}") from None
    grid.name = NAME
    return grid


def from_grid(grid: Grid) -> Bricks:
    """The bricks of an OpenVDB grid, one for each of its leaf nodes.

    Raises `VolumeError` if its voxels are not cubes along the axes, or a sample is not a number.
    """
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
    """Writes a .vdb file with one grid, `NAME`, and text beside it. Raises `VolumeError` if not all could be
    written.
    """
    grid = to_grid(bricks)
    try:
        grid.write(os.fspath(path), dict(metadata or {}))
    except RuntimeError as error:
        raise VolumeError(f"cannot write {error}") from None


def read_vdb(path: str | os.PathLike[str], name: str = "") -> Bricks:
    """The bricks of the float grid `name` in a .vdb file, or of the first one. Raises `VolumeError`."""
    from .._native import Grid

    try:
        grid = Grid.read(os.fspath(path), name)
    except RuntimeError as error:
        raise VolumeError(f"cannot read {error}") from None
    return from_grid(grid)
