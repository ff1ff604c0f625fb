"""Bodies of a mesh that nearly touch."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from .._native import near_bodies
from ..kernel.depth import WIDE
from ..records import JOINING
from .shells import WholeShells

REACH = 2
"""Edge length of the cubes in which bodies meet, voxels."""


class NearBodies:
    """Bodies of a surface in pieces that have another one within reach.

    Vertices are sorted into the cubes of two lattices; bodies with vertices in one cube are near. Bodies that
    are nearer than half the reach share one, but for a few.

    `stays`: bool (s,).
    """

    def __init__(self, shells: WholeShells, stays: NDArray[np.bool_], voxel: float, threads: int = 0) -> None:
        body = stays & (shells.volumes > 0)
        self._several = body.sum() > 1
        self._body = np.where(body, np.arange(len(body)), -1).astype(np.int32)[shells.of_label]
        self._largest = int(np.argmax(np.where(body, shells.areas, 0)))
        x, y, z = shells.bounds()[0].tolist()
        self._origin, self._edge, self._threads = (x, y, z), REACH * voxel, threads
        self._near = np.zeros(len(body), bool)
        self._end = -np.inf
        self._before = np.empty((0, 3)), np.empty(0, np.int32)

    @property
    def count(self) -> int:
        """Number of near bodies of the pieces so far; cavities are none."""
        return int(self._near.sum())

    @property
    def bodies(self) -> NDArray[np.int64]:
        """Shells of the near bodies of the pieces so far, ascending."""
        return np.flatnonzero(self._near)

    def include(self, bodies: NDArray[np.int64]) -> None:
        """Add near bodies that another process searched.

        `bodies`: int64 (k,).
        """
        self._near[bodies] = True

    def add(self, points: NDArray[np.float64], labels: NDArray[np.int32], end: float) -> None:
        """Add the next piece.

        `points`: float64 (n, 3); `labels`: int32 (n,).
        """
        if not self._several:
            return
        self._meet(points, labels)
        if np.isfinite(self._end):
            first = points[:, 0] < self._end + self._edge
            others, theirs = self._before
            self._meet(np.concatenate([others, points[first]]), np.concatenate([theirs, labels[first]]))
        if np.isfinite(end):
            last = points[:, 0] > end - self._edge
            self._end, self._before = end, (points[last], labels[last])

    def _meet(self, points: NDArray[np.float64], labels: NDArray[np.int32]) -> None:
        at = self._origin, self._edge, self._threads
        self._near[near_bodies(points, labels, self._body, len(self._near), self._largest, *at)] = True


def touching_note(near: int, voxel: float, settings: Sequence[str], off: Sequence[str]) -> tuple[str, ...]:
    """Describe the bodies that touch at points or edges only, and the options that help.

    `voxel` in mm; `settings`: whose bodies are several voxels wide.
    """
    if not near:
        return tuple(off)
    whole = (
        [f"--set {' --set '.join(settings)} makes them about {WIDE} voxels wide or more"] if settings else []
    )
    width = f"{JOINING * voxel:.2g}mm"
    options = [*whole, f"--thickness {width} or --bridge {width} joins them", "--keep largest leaves one"]
    line = (
        f"{near} bodies come within two voxels of another: they touch at corners or edges only, or are tips "
        f"and walls thinner than the voxel of {voxel:.2g}mm; {', '.join(options)}"
    )
    return ("; ".join([line, *off]),)
