"""Shells of a surface in pieces, with one piece in memory at a time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..errors import MeshError
from .components import PIECES, Shells
from .model import Mesh
from .pieces import Pieces, rows


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
        self.voxel, self.threads, self.count, self.end = voxel, threads, 0, -np.inf
        self.sizes: list[NDArray[np.float64]] = []
        self.cones: list[NDArray[np.float64]] = []
        self.areas: list[NDArray[np.float64]] = []
        self.low: list[NDArray[np.float64]] = []
        self.high: list[NDArray[np.float64]] = []
        self.same: list[NDArray[np.int64]] = []
        self.border: tuple[NDArray[np.void], NDArray[np.int64]] = rows(np.empty((0, 3))), np.empty(0, int)

    def add(self, mesh: Mesh, end: float) -> NDArray[np.int64]:
        """Add a piece that ends at x = `end`; returns the label of each of its triangles, int64 [m]."""
        from .topology import component_sizes, connected_components

        local, count = connected_components(mesh.triangles, len(mesh.vertices), self.threads)
        of_vertex = np.empty(len(mesh.vertices), np.int64)
        of_vertex[mesh.triangles] = local[:, None]
        low, high = _boxes(mesh.vertices, mesh.vertices, of_vertex, count)
        whole = not np.isfinite([self.end, end]).any()
        areas = np.zeros((count, 3)) if whole else _areas(mesh, local, count)
        # Cones over a component's first corner, moved to the corner of its box: precise even for dust.
        first = np.searchsorted(np.maximum.accumulate(local), np.arange(count))
        tips = mesh.vertices[mesh.triangles[first, 0]]
        cones, sizes = component_sizes(mesh.vertices, mesh.triangles, local, count, self.threads)
        self.cones.append(cones + ((tips - low) * areas).sum(axis=1) / 3)
        self.areas.append(areas)
        self.low.append(low)
        self.high.append(high)
        self.sizes.append(sizes)
        self._join_to_last(mesh, of_vertex + self.count, end)
        self.count += count
        return local + np.int64(self.count - count)

    def _join_to_last(self, mesh: Mesh, labels: NDArray[np.int64], end: float) -> None:
        """Unite components that share a vertex with the previous piece: no surface crosses a seam without
        one.
        """
        x = mesh.vertices[:, 0]
        here, there = (np.flatnonzero(np.abs(x - seam) < self.voxel / 2) for seam in (self.end, end))
        points, before = self.border
        _, theirs, mine = np.intersect1d(points, rows(mesh.vertices[here]), return_indices=True)
        pairs = np.stack([before[theirs], labels[here[mine]]], axis=1)
        self.same.append(np.unique(pairs, axis=0))
        self.border = rows(mesh.vertices[there]), labels[there]
        self.end = end

    def shells(self) -> WholeShells:
        """Shells of all pieces together."""
        of_label, count = self._united()
        lows, areas = np.concatenate(self.low), np.concatenate(self.areas)
        low, high = _boxes(lows, np.concatenate(self.high), of_label, count)
        # Cones over the corner of a component's box, moved to the corner of its shell's box.
        cones = np.concatenate(self.cones) + np.einsum("ij,ij->i", lows - low[of_label], areas) / 3
        volumes = np.bincount(of_label, cones, minlength=count).astype(np.float64)
        sizes = np.bincount(of_label, np.concatenate(self.sizes), minlength=count).astype(np.float64)
        return WholeShells(of_label, volumes, sizes, low, high)

    def _united(self) -> tuple[NDArray[np.int32], int]:
        """Shell of each label, and the number of shells."""
        from .topology import unite

        parent: NDArray[np.int64] = np.arange(self.count)
        for a, b in np.concatenate(self.same).tolist():
            unite(parent, a, b)
        while (parent != parent[parent]).any():
            parent = parent[parent]
        roots, shell = np.unique(parent, return_inverse=True)
        return shell.astype(np.int32), len(roots)


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
    low, high : ndarray of float64, shape (s, 3)
        Corners of the bounding boxes.
    """

    of_label: NDArray[np.int32]
    volumes: NDArray[np.float64]
    areas: NDArray[np.float64]
    low: NDArray[np.float64]
    high: NDArray[np.float64]

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
        return np.stack([self.low[which].min(axis=0), self.high[which].max(axis=0)])

    def nested(self, pieces: Pieces, threads: int = 0) -> tuple[Shells, int]:
        """Nesting of the shells, by rays.

        The ray of each shell starts at its point of least x. This point lies within a cell, so that a ray
        across x stays in one piece.

        Parameters
        ----------
        pieces : Pieces
            Labelled pieces.
        threads : int, optional
            Threads; 0 for all cores.

        Returns
        -------
        Shells
            Volumes and parents of the shells, without labels of triangles.
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
        for mesh, labels in pieces.labelled() if count > 1 else ():
            shell = self.of_label[labels]
            first = np.full(count, -1, np.int64)
            of_vertex = np.empty(len(mesh.vertices), np.int64)
            of_vertex[mesh.triangles] = shell[:, None]
            here = np.flatnonzero(mesh.vertices[:, 0] == self.low[of_vertex, 0])
            first[of_vertex[here]] = here
            if (first >= 0).any():
                found = nesting(mesh, shell, self.volumes, first, threads)
                parent = np.where(first >= 0, found.parent, parent)
                winding = np.where(first >= 0, found.winding, winding)
        if (parent[hollow] < 0).any() or hollow[parent[hollow]].any():
            raise MeshError("a shell of the mesh is inside out: it looks inwards and no body is around it")
        return Shells(np.empty(0, np.int32), self.volumes, parent), int((winding != hollow).sum())

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


def _boxes(
    lows: NDArray[np.float64], highs: NDArray[np.float64], group: NDArray[np.integer], count: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Bounding boxes of groups of boxes: low and high corners, float64 [count, 3] each."""
    low, high = np.full((3, count), np.inf), np.full((3, count), -np.inf)
    for k in range(3):  # axis by axis: `ufunc.at` is fast in one dimension only
        np.minimum.at(low[k], group, lows[:, k])
        np.maximum.at(high[k], group, highs[:, k])
    return low.T.copy(), high.T.copy()


def _areas(mesh: Mesh, labels: NDArray[np.int32], count: int) -> NDArray[np.float64]:
    """Vector area of each component, float64 [count, 3]: the sum of the vector areas of its triangles."""
    normals = mesh.normals / 2
    return np.stack([np.bincount(labels, normals[:, k], minlength=count) for k in range(3)], axis=1)
