"""Shells of a surface in pieces, with one piece in memory at a time."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..work import ahead
from .gathering import gathered
from .model import Mesh
from .pieces import Pieces, near_plane, rows
from .whole_shells import WholeShells


def survey(pieces: Pieces, voxel: float, threads: int = 0) -> WholeShells:
    """Find the shells of a surface in pieces, and label the pieces.

    Each connected component of a piece has one label.

    Parameters
    ----------
    pieces : Pieces
        Pieces of a closed surface; their labels are stored.
    voxel : float
        Voxel, in the units of the pieces.
    threads : int, optional
        Threads; 0 for all cores.

    Returns
    -------
    WholeShells
        The shells.
    """
    joined, ends = Survey(), [-np.inf, *pieces.ends]
    parts = (
        components(mesh, ends[number], ends[number + 1], voxel, threads)
        for number, mesh in enumerate(pieces.meshes())
    )
    for number, (labels, sums) in enumerate(ahead(parts)):
        first = joined.add(sums)
        pieces.label(number, labels + np.int32(first) if first else labels)
    return joined.shells()


@dataclass(frozen=True, eq=False)
class PieceComponents:
    """Connected components of a piece.

    Attributes
    ----------
    volumes, areas : ndarray of float64, shape (c,)
        Sizes; see `topology.Sizes`.
    vectors : ndarray of float64, shape (c, 3)
        Area vectors.
    extremes : ndarray of float64, shape (c, 6, 3)
        Vertices farthest out along -x, -y, -z, x, y and z.
    first : ndarray of int32, shape (c,)
        Vertex of least x.
    points, after : ndarray of float64, shape (k, 3)
        Vertices at the seams at the begin and at the end.
    labels, labels_after : ndarray of int32, shape (k,)
        Their components.
    """

    volumes: NDArray[np.float64]
    areas: NDArray[np.float64]
    vectors: NDArray[np.float64]
    extremes: NDArray[np.float64]
    first: NDArray[np.int32]
    points: NDArray[np.float64]
    labels: NDArray[np.int32]
    after: NDArray[np.float64]
    labels_after: NDArray[np.int32]


def components(
    mesh: Mesh, start: float, end: float, voxel: float, threads: int = 0
) -> tuple[NDArray[np.int32], PieceComponents]:
    """Find the connected components of a piece.

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
    ndarray of int32, shape (n,)
        Component of each vertex, from 0.
    Components
        The components.
    """
    from .topology import component_sizes, connected_components

    labels, count = connected_components(mesh.triangles, len(mesh.vertices), threads)
    sizes = component_sizes(mesh.vertices, mesh.triangles, labels, count, threads)
    here, there = (near_plane(mesh.vertices, seam, voxel / 2) for seam in (start, end))
    return labels, PieceComponents(
        sizes.volumes,
        sizes.areas,
        sizes.vectors,
        gathered(mesh.vertices, sizes.outermost, threads),
        sizes.outermost[:, 0],
        mesh.vertices[here],
        labels[here],
        mesh.vertices[there],
        labels[there],
    )


NO_BORDER: dict[str, NDArray[Any]] = {
    "points": np.empty((0, 3)),
    "labels": np.empty(0, np.int32),
    "after": np.empty((0, 3)),
    "labels_after": np.empty(0, np.int32),
}
"""Fields of `PieceComponents` that only the next piece needs."""


class Survey:
    """Sums over the components of pieces, in order. Labels count from the first piece on."""

    def __init__(self) -> None:
        self.starts = [0]
        self.pieces: list[PieceComponents] = []
        self.same: list[NDArray[np.int32]] = []

    def add(self, piece: PieceComponents) -> int:
        """Add the next piece.

        Components that share a vertex with the piece before are united: no surface crosses a seam without
        one.

        Parameters
        ----------
        piece : PieceComponents
            Its components.

        Returns
        -------
        int
            Label of its first component.
        """
        start = self.starts[-1]
        if self.pieces:
            before = self.pieces.pop()
            _, theirs, mine = np.intersect1d(rows(before.after), rows(piece.points), return_indices=True)
            pairs = before.labels_after[theirs] + np.int32(self.starts[-2]), piece.labels[mine]
            if len(mine):
                both = np.stack([pairs[0], pairs[1] + np.int32(start)], axis=1)
                self.same.append(np.unique(both, axis=0))
            self.pieces.append(replace(before, **NO_BORDER))
        self.pieces.append(piece)
        self.starts.append(start + len(piece.volumes))
        return start

    def _all(self, name: str) -> NDArray[Any]:
        return np.concatenate([getattr(piece, name) for piece in self.pieces])

    def shells(self) -> WholeShells:
        """Shells of all pieces together.

        Returns
        -------
        WholeShells
            Numbered by their first labels.
        """
        if len(self.pieces) == 1:
            (one,) = self.pieces
            own = np.arange(len(one.volumes), dtype=np.int32)
            piece = np.zeros(len(own), np.int64)
            return WholeShells(own, one.volumes, one.areas, one.extremes, one.first, piece)
        return self._united()

    def _united(self) -> WholeShells:
        """Shells of several pieces."""
        from .topology import connected_components

        own = np.arange(self.starts[-1], dtype=np.int32)
        pairs = np.concatenate([np.stack([own, own], axis=1), *self.same])
        of_label, count = connected_components(pairs[:, [0, 1, 1]], len(own))
        extremes, volumes = self._all("extremes"), self._all("volumes")
        outermost = np.empty((count, 6), np.int64)
        outermost[of_label] = own[:, None]
        (several,) = np.nonzero((np.bincount(of_label) > 1)[of_label])  # mostly few: dust is within a piece
        for side in range(6):
            height: NDArray[np.float64] = extremes[several, side, side % 3] * (1 if side < 3 else -1)
            order = several[np.lexsort((height, of_label[several]))[::-1]]
            outermost[of_label[order], side] = order  # the last one stays: the lowest, the first of equals
        # Cones over a component's own vertex, moved to one of its shell: precise even for dust.
        tips = extremes[outermost[of_label[several], 0], 0]
        volumes[several] += ((extremes[several, 0] - tips) * self._all("vectors")[several]).sum(axis=1) / 3
        volumes = np.bincount(of_label, volumes).astype(np.float64)
        areas = np.bincount(of_label, self._all("areas")).astype(np.float64)
        return WholeShells(
            of_label,
            volumes,
            areas,
            extremes[outermost, np.arange(6)],
            self._all("first")[outermost[:, 0]],
            np.searchsorted(self.starts, outermost[:, 0], side="right") - 1,
        )
