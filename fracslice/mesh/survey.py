"""The shells of a surface that comes in pieces: what the whole must be known for, found without having it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .components import Shells
from .extract import Piece
from .model import Mesh


class Survey:
    """Adds up pieces, in turn. A label is the number of a connected part of one piece, counted from the first
    piece on; `shells` tells which parts are one shell.
    """

    def __init__(self) -> None:
        self.cones: list[NDArray[np.float64]] = []
        self.areas: list[NDArray[np.float64]] = []
        self.low: list[NDArray[np.float64]] = []
        self.high: list[NDArray[np.float64]] = []
        self.same: list[NDArray[np.int64]] = []
        self.count = 0
        self.border: tuple[NDArray[np.int64], NDArray[np.int64]] = (np.empty(0, int), np.empty(0, int))

    def add(self, piece: Piece) -> NDArray[np.int64]:
        """Takes in a piece. Returns the label of each of its triangles, int64 [m]."""
        from .topology import connected_components

        mesh = piece.mesh
        local, count = connected_components(mesh.triangles, len(mesh.vertices))
        labels = local.astype(np.int64) + self.count
        of_vertex = np.empty(len(mesh.vertices), np.int64)
        of_vertex[mesh.triangles] = labels[:, None]
        low, high = _boxes(mesh.vertices, mesh.vertices, of_vertex - self.count, count)
        near = Mesh(mesh.vertices - low[of_vertex - self.count], mesh.triangles)
        cones, areas = _cones(near, local, count)
        self.cones.append(cones)
        self.areas.append(areas)
        self.low.append(low)
        self.high.append(high)
        self._join_to_last(piece.crossings, of_vertex)
        self.count += count
        return labels

    def _join_to_last(self, crossings: NDArray[np.int64], labels: NDArray[np.int64]) -> None:
        """Parts that share a crossing with the piece before are one; the surface passes no seam without."""
        numbers, before = self.border
        _, theirs, mine = np.intersect1d(numbers, crossings, assume_unique=True, return_indices=True)
        pairs = np.stack([before[theirs], labels[mine]], axis=1)
        self.same.append(np.unique(pairs, axis=0))
        self.border = crossings, labels[: len(crossings)]

    def shells(self) -> WholeShells:
        """What all pieces together are made of."""
        of_label, count = self._united()
        lows, areas = np.concatenate(self.low), np.concatenate(self.areas)
        low, high = _boxes(lows, np.concatenate(self.high), of_label, count)
        # Cones over the corner of a part, moved to the corner of its shell.
        cones = np.concatenate(self.cones) + np.einsum("ij,ij->i", lows - low[of_label], areas) / 3
        volumes = np.bincount(of_label, cones, minlength=count).astype(np.float64)
        return WholeShells(of_label, volumes, low, high)

    def _united(self) -> tuple[NDArray[np.int32], int]:
        """The shell of each label."""
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
    """The shells of all pieces together.

    of_label: int32, the shell of each label. volumes: float64 [s], signed. low, high: float64 [s, 3], the
    corners of their bounding boxes.
    """

    of_label: NDArray[np.int32]
    volumes: NDArray[np.float64]
    low: NDArray[np.float64]
    high: NDArray[np.float64]

    def nested(self, pieces: Iterable[tuple[Mesh, NDArray[np.int64]]]) -> tuple[Shells, int]:
        """Which shell is in which, and how many are where they should not be.

        pieces: the same once more, with their labels. Each shell is looked up from where its x is least: that
        point lies within a cell, so that a ray across x from it stays in one piece.
        """
        from .nesting import nesting

        count = len(self.volumes)
        parent, winding = np.full(count, -1, np.int64), np.zeros(count, np.int64)
        for mesh, labels in pieces if count > 1 else ():
            shell = self.of_label[labels]
            first = np.full(count, -1, np.int64)
            of_vertex = np.empty(len(mesh.vertices), np.int64)
            of_vertex[mesh.triangles] = shell[:, None]
            here = np.flatnonzero(mesh.vertices[:, 0] == self.low[of_vertex, 0])
            first[of_vertex[here]] = here
            if (first >= 0).any():
                found = nesting(mesh, shell, self.volumes, first=first)
                parent = np.where(first >= 0, found.parent, parent)
                winding = np.where(first >= 0, found.winding, winding)
        misplaced = int((winding != (self.volumes < 0)).sum())
        return Shells(np.empty(0, np.int32), self.volumes, parent), misplaced


def _boxes(
    lows: NDArray[np.float64], highs: NDArray[np.float64], group: NDArray[np.integer], count: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The low and high corners of groups of boxes, float64 [count, 3] each."""
    low, high = np.full((3, count), np.inf), np.full((3, count), -np.inf)
    for k in range(3):  # one axis after the other: NumPy is quick at one dimension only
        np.minimum.at(low[k], group, lows[:, k])
        np.maximum.at(high[k], group, highs[:, k])
    return low.T.copy(), high.T.copy()


def _cones(
    mesh: Mesh, labels: NDArray[np.int32], count: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Of each part, float64 [s]: the signed volume between its triangles and the origin, which is near by, so
    that dust keeps its digits; and the sum of its normals, each as long as its triangle's area, [s, 3].
    """
    normals = mesh.normals / 2
    tips = mesh.vertices[mesh.triangles[:, 0]]
    cones = np.bincount(labels, np.einsum("ij,ij->i", tips, normals), minlength=count) / 3
    areas = [np.bincount(labels, normals[:, k], minlength=count) for k in range(3)]
    return cones, np.stack(areas, axis=1)
