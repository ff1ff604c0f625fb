"""A coarse copy of a mesh, made at once, for pictures that must not wait: vertex clustering (Rossignac and
Borrel 1993). It may meet itself; `simplify` makes meshes to keep.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .model import Mesh


@dataclass(frozen=True, eq=False)
class Clusters:
    """Vertices of a mesh that share a cell of a grid."""

    of: NDArray[np.int64]  # number of each vertex's cluster, [n]
    size: NDArray[np.int64]  # vertices of each cluster, [m]
    triangles: NDArray[np.int32]  # those between three clusters, [k, 3]

    @classmethod
    def within(cls, mesh: Mesh, cell: float) -> Clusters:
        """Clusters in cells of a side, in lengths of the mesh."""
        places = ((mesh.vertices - mesh.vertices.min(0)) / cell).astype(np.int64)
        x, y, _ = places.max(0) + 1
        keys = places[:, 0] + x * (places[:, 1] + y * places[:, 2])
        _, of, size = np.unique(keys, return_inverse=True, return_counts=True)
        corners = of[mesh.triangles]
        first, second, third = corners.T
        apart = (first != second) & (second != third) & (third != first)
        return cls(of, size, np.ascontiguousarray(corners[apart], np.int32))

    def means(self, values: NDArray[np.generic]) -> NDArray[np.float64]:
        """Mean value of each cluster's vertices, [m, c]; `values`: of the vertices, [n, c]."""
        sums = [np.bincount(self.of, column, len(self.size)) for column in values.T]
        return np.stack(sums, 1) / self.size[:, None]

    def mesh(self, fine: Mesh) -> Mesh:
        """The mesh between the means of the clusters of a fine one, in their colours."""
        colours = None if fine.colours is None else (self.means(fine.colours) + 0.5).astype(np.uint8)
        return Mesh(self.means(fine.vertices), self.triangles, colours)
