"""Pointed vertices of a surface in pieces: those from which all edges descend."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._native import pointed, touching
from .contouring import Piece
from .model import Mesh
from .pieces import NOTHING, joined, near_plane

POINTED = 0.15
"""Minimum sine of the angle by which all edges descend from a pointed vertex."""

MANY = 512
"""Pointed vertices above which a surface is rough: it has any number of tips."""

NEAR_SEAM, AT_SEAM = 2.0, 5.0
"""Distances from a seam, voxels: vertices within the first are examined with the triangles of both pieces
within the second.
"""


class PointedPiece(NamedTuple):
    """Pointed vertices of a piece.

    Attributes
    ----------
    points : ndarray of float64, shape (n, 3)
        Pointed vertices away from the seams; more than `MANY` on a rough surface.
    head, tail : Mesh
        Triangles at its begin and at its end.
    """

    points: NDArray[np.float64]
    head: Mesh
    tail: Mesh


def pointed_in(mesh: Mesh, start: float, end: float, voxel: float, threads: int = 0) -> PointedPiece:
    """Find the pointed vertices of a piece.

    Parameters
    ----------
    mesh : Mesh
        The piece.
    start, end : float
        x of its seams; infinite at the ends of the surface.
    voxel : float
        Voxel, in the units of the piece.
    threads : int, optional
        Threads; 0 for all cores.

    Returns
    -------
    PointedPiece
        The vertices, and the triangles by which the neighbours find those at the seams.
    """
    points = _pointed(mesh, start + NEAR_SEAM * voxel, end - NEAR_SEAM * voxel, threads)
    head, tail = _at_seam(mesh, start, voxel, threads), _at_seam(mesh, end, voxel, threads)
    return PointedPiece(points, head, tail)


def _at_seam(mesh: Mesh, seam: float, voxel: float, threads: int) -> Mesh:
    """Triangles at a seam; none at an end of the surface."""
    near = np.zeros(len(mesh.vertices), bool)
    near[near_plane(mesh.vertices, seam, AT_SEAM * voxel)] = True
    if not near.any():
        return NOTHING
    return Mesh(mesh.vertices, mesh.triangles[touching(mesh.triangles, near, threads)]).compact()


def _pointed(mesh: Mesh, low: float, high: float, threads: int) -> NDArray[np.float64]:
    """Pointed vertices with low <= x < high; more than `MANY` on a rough surface."""
    at = mesh.vertices[pointed(mesh.vertices, mesh.triangles, POINTED, MANY, threads)]
    return at if len(at) > MANY else at[(low <= at[:, 0]) & (at[:, 0] < high)]


class Pointed:
    """Collects the pointed vertices of a surface in pieces.

    Parameters
    ----------
    voxel : float
        Voxel, in the units of the pieces.
    threads : int, optional
        Threads; 0 for all cores.
    """

    def __init__(self, voxel: float, threads: int = 0) -> None:
        self._voxel, self._threads, self._points = voxel, threads, [np.empty((0, 3))]
        self._tail, self._seam = NOTHING, -np.inf

    def add(self, piece: Piece) -> None:
        """Add a piece.

        Parameters
        ----------
        piece : Piece
            Pieces, by ascending x.
        """
        if not self.rough:
            pointed = pointed_in(piece.mesh, self._seam, piece.end, self._voxel, self._threads)
            self.join(pointed, piece.end)

    def join(self, piece: PointedPiece, end: float) -> None:
        """Add the pointed vertices of a piece, or of consecutive ones, and those at its seam with the piece
        before.

        Parameters
        ----------
        piece : PointedPiece
            Pieces, by ascending x.
        end : float
            x at which the piece ends.
        """
        if self.rough:
            return
        seam, voxel = self._seam, self._voxel
        if len(self._tail.triangles):
            both = joined(self._tail, piece.head, seam, voxel / 2)
            reach = NEAR_SEAM * voxel
            self._points.append(_pointed(both, seam - reach, seam + reach, self._threads))
        self._points.append(piece.points)
        self._tail, self._seam = piece.tail, end

    def before(self, head: Mesh) -> PointedPiece:
        """Pointed vertices of the pieces so far.

        Parameters
        ----------
        head : Mesh
            Triangles at the begin of the first piece.
        """
        if self.rough:
            return PointedPiece(np.concatenate(self._points)[: MANY + 1], NOTHING, NOTHING)
        return PointedPiece(self.points, head, self._tail)

    @property
    def rough(self) -> bool:
        """True for a surface with more pointed vertices than tips are searched at."""
        return sum(map(len, self._points)) > MANY

    @property
    def points(self) -> NDArray[np.float64]:
        """Pointed vertices, float64 [n, 3]; none for a rough surface."""
        points = np.concatenate(self._points)
        return points[:0] if self.rough else points
