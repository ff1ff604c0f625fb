"""Which shell of a mesh lies inside which: rays straight up, decided by exact predicates."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fracslice._native import nesting as _nesting
from fracslice.mesh.model import Mesh


class Nesting(NamedTuple):
    """winding: int64 [s], how often others surround each shell; parent: int64 [s], the smallest, or -1."""

    winding: NDArray[np.int64]
    parent: NDArray[np.int64]


def nesting(
    mesh: Mesh,
    labels: NDArray[np.int32],
    volumes: NDArray[np.float64],
    first: NDArray[np.int64] | None = None,
    threads: int = 0,
) -> Nesting:
    """Where each closed shell of a mesh lies.

    labels: int32 [m], the shell of each triangle; volumes: float64 [s], signed. A ray from one vertex of each
    shell goes up and adds the winding of every triangle it passes; edges and vertices on the ray count once
    (half-open edges). first: int64 [s], that vertex, if it matters which; -1 for a shell not to be looked at.
    The mesh need only be whole where these rays pass. Raises ValueError for arrays that contradict each
    other.
    """
    count = len(volumes)
    if count < 2:
        return Nesting(np.zeros(count, np.int64), np.full(count, -1, np.int64))
    if first is None:
        first = np.zeros(count, np.int64)
        first[labels[::-1]] = mesh.triangles[::-1, 0]
    return Nesting(*_nesting(mesh.vertices, mesh.triangles, labels, np.abs(volumes), first, threads))
