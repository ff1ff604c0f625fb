"""Shells of a surface in pieces, with one piece in memory at a time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import MeshError
from .components import PIECES, Shells
from .model import Mesh
from .pieces import Pieces, beside, rows


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
    found = _Survey(voxel, threads)
    for number, mesh in enumerate(pieces.meshes()):
        pieces.label(number, found.add(mesh, pieces.ends[number]))
    return found.shells()


class _Survey:
    """Sums over the components of pieces, in order. Labels count from the first piece on."""

    def __init__(self, voxel: float, threads: int) -> None:
        self.voxel, self.threads, self.end = voxel, threads, -np.inf
        self.starts = [0]
        self.volumes: list[NDArray[np.float64]] = []
        self.vectors: list[NDArray[np.float64]] = []
        self.areas: list[NDArray[np.float64]] = []
        self.extremes: list[NDArray[np.float64]] = []
        self.first: list[NDArray[np.int32]] = []
        self.same: list[NDArray[np.int32]] = []
        self.border: tuple[NDArray[np.void], NDArray[np.int32]] = (
            rows(np.empty((0, 3))),
            np.empty(0, np.int32),
        )

    def add(self, mesh: Mesh, end: float) -> NDArray[np.int32]:
        """Add a piece that ends at x = `end`; returns the label of each of its vertices, int32 [n]."""
        from .topology import component_sizes, connected_components

        labels, count = connected_components(mesh.triangles, len(mesh.vertices), self.threads)
        found = component_sizes(mesh.vertices, mesh.triangles, labels, count, self.threads)
        self.volumes.append(found.volumes)
        self.areas.append(found.areas)
        self.vectors.append(found.vectors)
        self.extremes.append(mesh.vertices[found.outermost])
        self.first.append(found.outermost[:, 0])
        labels = labels + np.int32(self.starts[-1])
        self.starts.append(self.starts[-1] + count)
        self._join_to_last(mesh, labels, end)
        return labels

    def _join_to_last(self, mesh: Mesh, labels: NDArray[np.int32], end: float) -> None:
        """Unite components that share a vertex with the previous piece: no surface crosses a seam without
        one.
        """
        here, there = (beside(mesh.vertices, seam, self.voxel / 2) for seam in (self.end, end))
        points, before = self.border
        _, theirs, mine = np.intersect1d(points, rows(mesh.vertices[here]), return_indices=True)
        if len(mine):
            pairs = np.stack([before[theirs], labels[here[mine]]], axis=1)
            self.same.append(np.unique(pairs, axis=0))
        self.border = rows(mesh.vertices[there]), labels[there]
        self.end = end

    def shells(self) -> WholeShells:
        """Shells of all pieces together."""
        from .topology import connected_components

        own = np.arange(self.starts[-1], dtype=np.int32)
        pairs = np.concatenate([np.stack([own, own], axis=1), *self.same])
        of_label, count = connected_components(pairs[:, [0, 1, 1]], len(own))
        extremes = np.concatenate(self.extremes)
        outermost = np.empty((count, 6), np.int64)
        for side in range(6):
            height: NDArray[np.float64] = extremes[:, side, side % 3] * (1 if side < 3 else -1)
            order = np.lexsort((height, of_label))
            outermost[:, side] = order[np.searchsorted(of_label[order], np.arange(count))]
        # Cones over a component's own vertex, moved to one of its shell: precise even for dust.
        tips = extremes[outermost[:, 0], 0]
        moved = ((extremes[:, 0] - tips[of_label]) * np.concatenate(self.vectors)).sum(axis=1) / 3
        volumes = np.bincount(of_label, np.concatenate(self.volumes) + moved).astype(np.float64)
        areas = np.bincount(of_label, np.concatenate(self.areas)).astype(np.float64)
        return WholeShells(
            of_label,
            volumes,
            areas,
            extremes[outermost, np.arange(6)],
            np.concatenate(self.first)[outermost[:, 0]],
            np.searchsorted(self.starts, outermost[:, 0], side="right") - 1,
        )


@dataclass(frozen=True, eq=False)
class WholeShells:
    """Shells of all pieces together.

    Attributes
    ----------
    of_label : ndarray of int32, shape (l,)
        Shell of each label.
    volumes : ndarray of float64, shape (s,)
        Signed volumes, negative for cavities.
    areas : ndarray of float64, shape (s,)
        Areas.
    outermost : ndarray of float64, shape (s, 6, 3)
        Vertices farthest out along -x, -y, -z, x, y and z.
    first : ndarray of int32, shape (s,)
        Index of the vertex of least x in its piece.
    piece : ndarray of int64, shape (s,)
        Index of that piece.
    """

    of_label: NDArray[np.int32]
    volumes: NDArray[np.float64]
    areas: NDArray[np.float64]
    outermost: NDArray[np.float64]
    first: NDArray[np.int32]
    piece: NDArray[np.int64]

    def tips(self, which: NDArray[np.bool_] | slice = slice(None)) -> NDArray[np.float64]:
        """Outermost vertices of some or all shells.

        Parameters
        ----------
        which : ndarray of bool, shape (s,), or slice, optional
            Shells; all by default.

        Returns
        -------
        ndarray of float64, shape (6, 3)
            Vertices farthest out along -x, -y, -z, x, y and z.
        """
        of, axes = self.outermost[which], np.arange(3)
        low, high = of[:, axes, axes].argmin(axis=0), of[:, axes + 3, axes].argmax(axis=0)
        return of[[*low, *high], np.arange(6)]

    def bounds(self, which: NDArray[np.bool_] | slice = slice(None)) -> NDArray[np.float64]:
        """Bounding box of some or all shells.

        Parameters
        ----------
        which : ndarray of bool, shape (s,), or slice, optional
            Shells; all by default.

        Returns
        -------
        ndarray of float64, shape (2, 3)
            Low and high corner.
        """
        return self.tips(which).reshape(2, 3, 3).diagonal(axis1=1, axis2=2)

    def nested(self, pieces: Pieces, bodies: bool = True, threads: int = 0) -> tuple[Shells, int]:
        """Nesting of the shells, by rays.

        The ray of each shell starts at its point of least x. This point lies within a cell, so that a ray
        across x stays in one piece.

        Parameters
        ----------
        pieces : Pieces
            Labelled pieces.
        bodies : bool, optional
            False for the nesting of cavities only. By the signs of the samples no body is in the material of
            another one.
        threads : int, optional
            Threads; 0 for all cores.

        Returns
        -------
        Shells
            Volumes and parents of the shells.
        int
            Number of misplaced shells.

        Raises
        ------
        MeshError
            For a cavity without a body around it.
        """
        from .nesting import nesting

        count, hollow = len(self.volumes), self.volumes < 0
        parent, winding = np.full(count, -1, np.int64), np.zeros(count, np.int64)
        searched = hollow | (bodies and count > 1)
        for number in sorted(set(self.piece[searched].tolist())):
            mesh, own = pieces.mesh(number), searched & (self.piece == number)
            first = np.where(own, self.first, -1)
            shell = self.of_label[pieces.labels(number)]
            found = nesting(mesh, shell, self.volumes, first, threads)
            parent[own], winding[own] = found.parent[own], found.winding[own]
        if (parent[hollow] < 0).any() or hollow[parent[hollow]].any():
            raise MeshError("a shell of the mesh is inside out: it looks inwards and no body is around it")
        return Shells(self.volumes, parent), int((winding != hollow)[searched].sum())

    def thin_walls(self, voxel: float) -> str:
        """Note on walls thinner than a voxel; empty if there are none.

        Such walls fall between samples: they have holes or break into pieces. A body counts if its average
        thickness is below a voxel. The dust around a fractal also counts, but is less than `PIECES` of the
        material.

        Parameters
        ----------
        voxel : float
            Voxel, in the units of the shells.

        Returns
        -------
        str
            The note.
        """
        whole, bodies = self.volumes.sum(), self.volumes > 0
        thin = bodies & (2 * self.volumes < voxel * self.areas)
        share, many = float(self.volumes[thin].sum() / whole), int(bodies.sum())
        holes = "have holes" if many == 1 else f"fell to pieces: {thin.sum()} of {many} bodies"
        return f"walls thinner than a voxel {holes}, {share:.0%} of the material" if share >= PIECES else ""
