"""Walls thinner than the minimum thickness, of a mesh by rays from its triangles, and a note on them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._native import graph_components
from .._native import thin_walls as _thin_walls
from ..common.arrays import Rows
from ..common.messages import format_count, place
from ..records import Print

SLACK = 0.01
"""Part of the minimum thickness by which a wall may be thinner."""

ENOUGH = 4
"""Voxels across the minimum thickness from which on triangles cut little off round walls."""


@dataclass(frozen=True, eq=False)
class ThinWalls(Rows):
    """Walls that are thinner than the minimum thickness, mm."""

    width: np.ndarray
    area: np.ndarray  # surface that each represents
    middle: (
        np.ndarray
    )  # float64 [n, 3], from the middle of the object along x and y, and above its lowest point

    def note(self, least: float, spot: float) -> tuple[str, ...]:
        """A note on them: the number of places, and the thinnest one.

        Walls are one place where they are in cubes of the minimum thickness that touch. Those of less area
        than a square of side `spot`, such as creases, are counted apart.

        `least`: minimum thickness, mm.
        """
        if not len(self.width):
            return ()
        areas = np.bincount(_clusters(self.middle, least), self.area)
        places, spots = int((areas >= spot**2).sum()), int((areas < spot**2).sum())
        first, thinner = int(self.width.argmin()), f" thinner than the thickness of {least:g} mm"
        counts = [f"{format_count(places, 'place')}{thinner}"] if places else []
        if spots:
            small = f"{format_count(spots, 'spot')} smaller than {spot:.2g} mm"
            counts.append(small if places else f"{small},{thinner}")
        at = place(self.middle[first].tolist())
        return (f"{', and '.join(counts)}; the thinnest, {self.width[first]:.2g} mm, at {at} mm",)


def _clusters(points: np.ndarray, side: float) -> np.ndarray:
    """Number points [n, 3] by groups of cubes of a side that touch, int64 [n]."""
    cells, which = np.unique(np.floor(points / side).astype(np.int64), axis=0, return_inverse=True)
    shape = tuple((np.ptp(cells, axis=0) + 3).tolist())
    number = np.ravel_multi_index(tuple((cells - cells.min(0) + 1).T), shape)
    steps = np.ravel_multi_index(tuple(np.array(list(product((0, 1, 2), repeat=3)))[14:].T), shape)
    near = number[:, None] + steps - np.ravel_multi_index((1, 1, 1), shape)
    at = np.minimum(np.searchsorted(number, near), len(number) - 1)
    some, step = np.nonzero(number[at] == near)
    return np.asarray(graph_components(len(cells), some, at[some, step])[0][which.reshape(-1)])


class MeshSurface(NamedTuple):
    """Triangles of a mesh, mm, and the tree of their boxes in halves; see `fracslice.mesh.spatial`."""

    vertices: NDArray[np.float64]
    triangles: NDArray[np.int32]
    order: NDArray[np.int64]
    low: NDArray[np.float64]
    high: NDArray[np.float64]


def thin_walls(of: MeshSurface, count: int, least: float, threads: int = 0) -> ThinWalls:
    """Walls of the first triangles of a mesh that are thinner than `least` mm.

    Rays have the length of a wall where the face that they meet looks away from their own, as for
    `fracslice.printing.walls`. A ray that leaves through a neighbour of its triangle, beside a sharp edge,
    measures none; nor does one that leaves a mesh that is open.
    """
    found = _thin_walls(*of, count, (1 - SLACK) * least, threads)
    return ThinWalls(found[:, 0], found[:, 1], found[:, 2:])


def thickness_note(found: Sequence[ThinWalls], how: Print, voxel: float) -> tuple[str, ...]:
    """A note on the walls of a mesh, but those of the raft, which has a height of its own.

    `voxel` in mm.
    """
    if not found:
        return ()
    thin, finer = ThinWalls.joined(found), how.thickness / ENOUGH
    notes = thin.chosen(thin.middle[:, 2] > how.raft).note(how.thickness, voxel)
    advice = f"; expected a voxel of {finer:.2g} mm" if voxel > 1.01 * finer else ""
    return tuple(note + advice for note in notes)
