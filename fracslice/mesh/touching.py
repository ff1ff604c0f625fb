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

    def __init__(self, shells: WholeShells, stays: NDArray[np.bool_], voxel: float) -> None:
        body = stays & (shells.volumes > 0)
        self.several = bool(body.sum() > 1)
        """False for a single body, which is near none."""
        self._body = np.where(body, np.arange(len(body)), -1).astype(np.int32)[shells.of_label]
        self._largest, self._count = int(np.argmax(np.where(body, shells.areas, 0))), len(body)
        x, y, z = shells.bounds()[0].tolist()
        self._origin, self._edge = (x, y, z), REACH * voxel

    def within(
        self, points: NDArray[np.float64], labels: NDArray[np.int32], threads: int = 0
    ) -> NDArray[np.int64]:
        """Near bodies of a piece; cavities are none.

        `points`: float64 (n, 3); `labels`: int32 (n,). Returns int64 (k,), ascending.
        """
        at = self._origin, self._edge, threads
        return near_bodies(points, labels, self._body, self._count, self._largest, *at)

    def across(
        self,
        seam: float,
        one: tuple[NDArray[np.float64], NDArray[np.int32]],
        other: tuple[NDArray[np.float64], NDArray[np.int32]],
        threads: int = 0,
    ) -> NDArray[np.int64]:
        """Near bodies at the seam x = `seam` of two pieces, given as for `within`.

        Returns int64 (k,), ascending.
        """
        last, first = one[0][:, 0] > seam - self._edge, other[0][:, 0] < seam + self._edge
        points = np.concatenate([one[0][last], other[0][first]])
        labels = np.concatenate([one[1][last], other[1][first]])
        return self.within(points, labels, threads)


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
