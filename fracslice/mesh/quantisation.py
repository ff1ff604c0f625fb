"""The coordinates that a file can hold."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fracslice.errors import MeshError
from fracslice.mesh.model import Mesh


def quantised(mesh: Mesh) -> Mesh:
    """The mesh as a reader of its STL will see it: rounded to float32, equal positions made one vertex.

    Keeps every triangle, in order; unused vertices go. Do it once, before the check and the export, so that
    both speak of the same object. Raises MeshError if a coordinate is not finite or an index is out of range.
    """
    from fracslice.mesh.weld import weld

    points = float32_points(mesh)
    first, labels = weld(points)
    welded = Mesh(points[first].astype(np.float64), labels[mesh.triangles])
    used = np.zeros(len(first), dtype=bool)
    used[welded.triangles] = True
    return welded if used.all() else welded.selected(np.ones(len(welded.triangles), dtype=bool))


def float32_points(mesh: Mesh) -> NDArray[np.float32]:
    """The vertices as float32 [n, 3], without negative zeros. Raises MeshError as `quantised` does."""
    with np.errstate(over="ignore"):
        points = mesh.vertices.astype(np.float32) + np.float32(0)  # -0 becomes 0
    if len(mesh.triangles) and not 0 <= mesh.triangles.min() <= mesh.triangles.max() < len(points):
        raise MeshError("a triangle names a vertex that does not exist")
    if not np.isfinite(points).all():
        raise MeshError("the mesh has a coordinate that is not a finite number")
    return points
