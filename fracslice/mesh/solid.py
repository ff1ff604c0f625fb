"""Solids of manifold3d."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..common.messages import lacking
from ..errors import MeshError
from .model import Mesh

if TYPE_CHECKING:
    from manifold3d import Manifold

_REASONS = {
    "NonFiniteVertex": "a coordinate is not a finite number",
    "NotManifold": "it is not closed, or an edge does not join exactly two triangles of the same sense",
    "VertexOutOfBounds": "a triangle names a vertex that does not exist",
    "ResultTooLarge": "it has too many triangles",
}


def to_manifold(mesh: Mesh) -> Manifold:
    """Convert a mesh to a manifold3d solid, in double precision, without repair."""
    if reason := lacking("manifold3d", "solids need"):
        raise MeshError(reason)
    import manifold3d

    if not len(mesh.triangles):
        raise MeshError("the mesh has no triangles")
    corners = np.array(mesh.vertices, np.float64)  # copy: manifold3d needs a writeable array
    solid = manifold3d.Manifold(manifold3d.Mesh64(corners, mesh.triangles.astype(np.uint64)))
    status = solid.status().name
    if status != "NoError":
        raise MeshError(f"the mesh is not a solid: {_REASONS.get(status, status)}")
    return solid
