"""Half-edge collapses of a closed mesh under error control, with undo.

Klein, Liebich and Strasser, "Mesh Reduction with Error Control", 1996: each original vertex is assigned to a
triangle near it, and a collapse is refused if it would leave one of them farther off than the tolerance.
Adjacency is a corner table (Rossignac, 2001) with a history.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._native import Reduction
from ..work import Work, chunks
from .model import Mesh

STAGES = (1e-3, 0.25, 0.5, 0.75, 1.0)
"""Fractions of the tolerance, in the order in which they are spent: cheap collapses first."""

FIRST = 0.3
"""Approximate fraction of all the work that the first run takes."""

CHUNK = 1 << 16
"""Vertices between two checks for cancellation."""


class Collapsed(NamedTuple):
    """State of a simplification, over the triangles and vertices of the original mesh.

    Attributes
    ----------
    triangles : ndarray of int32, shape (m, 3)
        Current corners of each triangle.
    gone : ndarray of bool, shape (m,)
        True for each removed triangle.
    step : ndarray of int32, shape (m,)
        Number, from 1, of the last collapse that changed each triangle; 0 for an unchanged one.
    fresh : ndarray of bool, shape (m,)
        True for each triangle that changed since the previous state.
    owner : ndarray of int32, shape (n,)
        A triangle near each vertex.
    """

    triangles: NDArray[np.int32]
    gone: NDArray[np.bool_]
    step: NDArray[np.int32]
    fresh: NDArray[np.bool_]
    owner: NDArray[np.int32]

    @property
    def changed(self) -> NDArray[np.bool_]:
        """True for each changed triangle, bool [m]."""
        return self.step > 0


class Collapse:
    """Simplify a mesh by half-edge collapses within a tolerance.

    The topology of the manifold is preserved (the link condition of Dey, Edelsbrunner, Guha and Nekhayev,
    1999). Every original vertex stays within the tolerance; the points between them probably do, and
    triangles may intersect.

    Parameters
    ----------
    mesh : Mesh
        Closed, oriented 2-manifold, mm.
    tolerance : float
        Maximum distance of the original vertices, mm.
    """

    def __init__(self, mesh: Mesh, tolerance: float) -> None:
        self._mesh, self._native = mesh, Reduction(mesh.vertices, mesh.triangles, tolerance)
        self._stages: tuple[float, ...] = STAGES

    def run(self, work: Work) -> None:
        """Collapse all edges that the tolerance allows, at first and after each `undo`.

        Raises
        ------
        Cancelled
            If the work is cancelled.
        """
        for i, share in enumerate(self._stages):
            if len(self._stages) > 1:
                work.progress("simplifying", FIRST * i / len(self._stages))
                self._native.renew()
            while self._sweep(share, work):
                pass
        self._stages = STAGES[-1:]

    def state(self) -> Collapsed:
        """Current state.

        Returns
        -------
        Collapsed
            State of each triangle and vertex.
        """
        return Collapsed(*self._native.state())

    def _sweep(self, share: float, work: Work) -> int:
        """Sweep over all vertices at a fraction of the tolerance; returns the number of collapses."""
        done = 0
        for part in chunks(len(self._mesh.vertices), CHUNK):
            work.check()
            done += self._native.sweep(part.start, part.stop, share)
        return done

    def undo(self, faulty: NDArray[np.bool_]) -> None:
        """Undo the last collapse at each faulty triangle.

        `run` repeats such a collapse only within a quarter of the tolerance, and never after a second undo.

        Parameters
        ----------
        faulty : ndarray of bool, shape (m,)
            True for each faulty triangle.
        """
        self._native.undo(faulty)
