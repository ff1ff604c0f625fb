"""The coordinates that a file can hold."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fracslice.errors import MeshError
from fracslice.mesh.model import Mesh

NO_PLANES = np.empty((0, 3))


def quantised(mesh: Mesh, threads: int = 0) -> Mesh:
    """The mesh as a reader of its STL will see it: rounded to float32, equal positions made one vertex.

    Keeps every triangle, in order; unused vertices go. Do it once, before the check and the export, so that
    both speak of the same object. Raises MeshError if a coordinate is not finite or an index is out of range.
    """
    points, _ = quantise(mesh, NO_PLANES, threads)
    return welded(Mesh(points, mesh.triangles), threads)


def quantise(
    mesh: Mesh, planes: NDArray[np.float64] = NO_PLANES, threads: int = 0
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """The vertices rounded to float32, without negative zeros, float64 [n, 3], and which are displaced.

    A vertex is displaced, bool [n], if it is not in the same planes and strictly between the same ones as
    before. planes: of a grid, across each axis, float64 [k, 3], ascending; without them, all vertices are.
    Raises MeshError as `quantised` does.
    """
    from fracslice._native import quantise

    if len(mesh.triangles) and not 0 <= mesh.triangles.min() <= mesh.triangles.max() < len(mesh.vertices):
        raise MeshError("a triangle names a vertex that does not exist")
    try:
        return quantise(mesh.vertices, planes, threads)
    except ValueError as error:
        raise MeshError(str(error)) from None


def welded(mesh: Mesh, threads: int = 0) -> Mesh:
    """A mesh of float32 coordinates with equal positions made one vertex, and no others than are used."""
    from fracslice.mesh.weld import weld

    first, labels = weld(mesh.vertices.astype(np.float32))
    if len(first) < len(mesh.vertices):
        mesh = Mesh(mesh.vertices[first], labels[mesh.triangles])
    return mesh.selected(np.ones(len(mesh.triangles), bool), threads)
