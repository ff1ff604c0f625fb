"""Nesting of the shells of a mesh, by vertical rays and exact predicates."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._native import nesting as _nesting
from .model import Mesh


class Nesting(NamedTuple):
    """Position of each shell among the others.

    Attributes
    ----------
    winding : ndarray of int64, shape (s,)
        Winding number of the other shells around each shell.
    parent : ndarray of int64, shape (s,)
        Smallest surrounding shell, or -1.
    """

    winding: NDArray[np.int64]
    parent: NDArray[np.int64]


def nesting(
    mesh: Mesh,
    labels: NDArray[np.int32],
    volumes: NDArray[np.float64],
    first: NDArray[np.int64] | None = None,
    threads: int = 0,
) -> Nesting:
    """Find the shells around each closed shell of a mesh.

    A ray from one vertex of each shell goes up and adds the winding of every triangle it passes; edges and
    vertices on the ray count once (half-open edges). The mesh need only be complete along these rays.

    Parameters
    ----------
    mesh : Mesh
        The mesh.
    labels : ndarray of int32, shape (n,)
        Shell of each vertex.
    volumes : ndarray of float64, shape (s,)
        Signed volumes.
    first : ndarray of int64, shape (s,), optional
        Start vertex of each shell's ray; -1 to skip a shell. Any vertex by default.
    threads : int, optional
        Threads; 0 for all cores.

    Returns
    -------
    Nesting
        Winding numbers and parents.

    Raises
    ------
    ValueError
        For inconsistent arrays.
    """
    count = len(volumes)
    if count < 2:
        return Nesting(np.zeros(count, np.int64), np.full(count, -1, np.int64))
    if first is None:
        first = np.zeros(count, np.int64)
        first[labels[mesh.triangles[::-1, 0]]] = mesh.triangles[::-1, 0]
    return Nesting(*_nesting(mesh.vertices, mesh.triangles, labels, np.abs(volumes), first, threads))
