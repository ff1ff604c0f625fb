"""Cleaning of the pieces of a surface in any order, each with its neighbours' triangles near the seams."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._native import touching
from .clean import cleaned
from .model import Mesh
from .pieces import seamed
from .quantisation import NO_PLANES, UNMOVED, Frame

WAITS, MENDS = 7.5, 3.0
"""Distances from a seam, voxels. Triangles with a vertex nearer than the first are those of the halo;
triangles are cleaned up to the second. An edit reaches three voxels at most, so that it never meets triangles
beyond the halo.
"""


@dataclass(frozen=True, eq=False)
class Finished:
    """Finished triangles as a file holds them, among neighbouring ones.

    Attributes
    ----------
    mesh : Mesh
        Finished triangles and neighbours, mm, quantised.
    suspects : ndarray of int64, shape (k,)
        Triangles that may intersect others, ascending.
    done : int
        Number of finished triangles; the first ones. Each triangle is finished once, in the
        order of the pieces.
    counted : ndarray of bool, shape (n,)
        Vertices with all their triangles in `mesh`. Each vertex is counted once.
    """

    mesh: Mesh
    suspects: NDArray[np.int64]
    done: int
    counted: NDArray[np.bool_]

    @classmethod
    def whole(cls, mesh: Mesh, suspects: NDArray[np.int64] | None = None) -> Finished:
        """A whole mesh as one piece.

        Parameters
        ----------
        mesh : Mesh
            Quantised mesh, mm.
        suspects : ndarray of int64, shape (k,), optional
            Triangles that may intersect others; all by default.

        Returns
        -------
        Finished
            All triangles and vertices of the mesh.
        """
        count = len(mesh.triangles)
        return cls(
            mesh, np.arange(count) if suspects is None else suspects, count, np.ones(len(mesh.vertices), bool)
        )

    @cached_property
    def passed(self) -> Mesh:
        """The finished triangles, among vertices of others too; open where their neighbours are."""
        mesh = self.mesh
        return mesh if self.done == len(mesh.triangles) else Mesh(mesh.vertices, mesh.triangles[: self.done])

    @cached_property
    def points(self) -> NDArray[np.float64]:
        """The counted vertices, float64 [k, 3]."""
        vertices = self.mesh.vertices
        return vertices if self.counted.all() else vertices[self.counted]


class Strip(NamedTuple):
    """Some triangles of a mesh.

    Attributes
    ----------
    mesh : Mesh
        The triangles and their vertices.
    numbers : ndarray of int64, shape (n,)
        Indices of the vertices in the mesh, ascending.
    rows : ndarray of int64, shape (k,)
        Indices of the triangles, ascending.
    """

    mesh: Mesh
    numbers: NDArray[np.int64]
    rows: NDArray[np.int64]


def strip(mesh: Mesh, vertices: NDArray[np.bool_], threads: int = 0) -> Strip:
    """Triangles that use some vertices.

    Parameters
    ----------
    mesh : Mesh
        The mesh.
    vertices : ndarray of bool, shape (n,)
        The vertices.
    threads : int, optional
        Threads; 0 for all cores.
    """
    rows = touching(mesh.triangles, vertices, threads)
    triangles, used = mesh.triangles[rows], np.zeros(len(mesh.vertices), bool)
    used[triangles] = True
    numbers, place = np.flatnonzero(used), np.cumsum(used, dtype=np.int32) - 1
    return Strip(Mesh(mesh.vertices[numbers], place[triangles]), numbers, rows)


@dataclass(frozen=True, eq=False)
class SelectedPiece:
    """A piece with the choice of its bodies.

    Attributes
    ----------
    mesh : Mesh
        The piece, scene units.
    keep : ndarray of bool, shape (n,)
        Vertices of the connected components that stay.
    fresh : ndarray of int64, shape (k,)
        Triangles that were not made by contouring, ascending.
    """

    mesh: Mesh
    keep: NDArray[np.bool_]
    fresh: NDArray[np.int64]

    def near(self, vertices: NDArray[np.bool_], threads: int) -> SelectedPiece:
        """Triangles that use some vertices.

        Parameters
        ----------
        vertices : ndarray of bool, shape (n,)
            The vertices.
        threads : int
            Threads; 0 for all cores.

        Returns
        -------
        SelectedPiece
            The triangles and their vertices.
        """
        part = strip(self.mesh, vertices, threads)
        fresh = np.flatnonzero(np.isin(part.rows, self.fresh))
        return SelectedPiece(part.mesh, self.keep[part.numbers], fresh)

    def then(self, other: SelectedPiece, seam: float, near: float) -> SelectedPiece:
        """Join the next piece; the triangles of this one come first.

        Parameters
        ----------
        other : SelectedPiece
            The next piece.
        seam, near : float
            As for `seamed`.

        Returns
        -------
        SelectedPiece
            Both.
        """
        mesh, number = seamed(self.mesh, other.mesh, seam, near)
        keep = np.concatenate([other.keep, self.keep])
        keep[number] |= keep  # a vertex of the seam may be unused in one of the pieces
        keep &= number == np.arange(len(number))
        return SelectedPiece(mesh, keep, np.concatenate([self.fresh, other.fresh + len(self.mesh.triangles)]))


def finished_piece(
    piece: SelectedPiece,
    before: SelectedPiece | None,
    after: SelectedPiece | None,
    ends: tuple[float, float],
    voxel: float,
    planes: NDArray[np.float64] = NO_PLANES,
    frame: Frame = UNMOVED,
    threads: int = 0,
) -> Finished:
    """Clean a piece.

    Every edit that changes a triangle of the piece is made, with all triangles that it depends on, in the
    order of the whole mesh. The neighbours make the same edits at the seams.

    Parameters
    ----------
    piece : SelectedPiece
        The piece, at least a brick thick.
    before, after : SelectedPiece or None
        Its neighbours; None at the ends of the surface.
    ends : tuple of float
        x at which it begins and ends; infinite at the ends of the surface.
    voxel : float
        Voxel, scene units.
    planes : ndarray of float64, shape (k, 3), optional
        Placed planes of the grid that the pieces were contoured on.
    frame : Frame, optional
        Placement; none by default.
    threads : int, optional
        Threads; 0 for all cores.

    Returns
    -------
    Finished
        Triangles of the piece, mm, quantised. A vertex counts in the piece in which it lies.
    """
    (start, end), whole, first, last = ends, piece, 0, len(piece.mesh.triangles)
    if before is not None:
        beside = before.near(before.mesh.vertices[:, 0] > start - WAITS * voxel, threads)
        first, last = (n + len(beside.mesh.triangles) for n in (first, last))
        whole = beside.then(whole, start, voxel / 2)
    if after is not None:
        beside = after.near(after.mesh.vertices[:, 0] < end + WAITS * voxel, threads)
        whole = whole.then(beside, end, voxel / 2)
    between = start - MENDS * voxel, end + MENDS * voxel
    mesh, keep = whole.mesh, whole.keep
    final, suspects, edits = cleaned(
        mesh, keep, whole.fresh, planes=planes, frame=frame, between=between, threads=threads
    )
    if before is None and after is None:
        return Finished.whole(final, suspects)
    triangles = mesh.triangles.copy()
    triangles[edits[0]] = edits[1]
    stays = keep[triangles[:, 0]] & (triangles[:, 0] >= 0)
    first, done = int(stays[:first].sum()), int(stays[first:last].sum())
    low, high = (frame[0] * x + frame[1][0] for x in ends)
    x = final.vertices[:, 0]
    own_first = Mesh(final.vertices, np.roll(final.triangles, -first, axis=0))
    moved = np.sort((suspects - first) % max(len(final.triangles), 1))
    return Finished(own_first, moved, done, (x >= low) & (x < high))
