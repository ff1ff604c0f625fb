"""Meshes as solids: proof by manifold3d, flat base, place on the bed."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fracslice.errors import MeshError
from fracslice.mesh.model import Mesh

if TYPE_CHECKING:
    from manifold3d import Manifold

_REASONS = {
    "NonFiniteVertex": "a coordinate is not a finite number",
    "NotManifold": "it is not closed, or an edge does not join exactly two triangles of the same sense",
    "VertexOutOfBounds": "a triangle names a vertex that does not exist",
    "ResultTooLarge": "it has too many triangles",
}


def to_manifold(mesh: Mesh) -> Manifold:
    """The mesh as a manifold3d solid, taken as it is, in double precision.

    Raises MeshError in plain words when manifold3d refuses it or it has no triangles.
    """
    import manifold3d

    if not len(mesh.triangles):
        raise MeshError("the mesh has no triangles")
    corners = np.ascontiguousarray(mesh.vertices, dtype=np.float64)
    solid = manifold3d.Manifold(manifold3d.Mesh64(corners, mesh.triangles.astype(np.uint64)))
    status = solid.status().name
    if status != "NoError":
        raise MeshError(f"the mesh is not a solid: {_REASONS.get(status, status)}")
    return solid


def from_manifold(solid: Manifold) -> Mesh:
    """The boundary of a manifold3d solid; raises MeshError when it is empty or in error."""
    status = solid.status().name
    if status != "NoError":
        raise MeshError(f"the solid could not be built: {_REASONS.get(status, status)}")
    if solid.is_empty():
        raise MeshError("the solid is empty")
    boundary = solid.to_mesh64()
    return Mesh(
        np.ascontiguousarray(boundary.vert_properties[:, :3]),
        np.ascontiguousarray(boundary.tri_verts, dtype=np.int32),
    )


def cut_base(mesh: Mesh, height: float) -> Mesh:
    """Cut off what lies less than `height` mm above the lowest point, so that the solid stands flat.

    Raises MeshError if the mesh is not a solid or nothing is left.
    """
    low, high = mesh.bounds[:, 2]
    if not 0 <= height < high - low:
        raise MeshError(
            f"a base cut of {height:g} mm does not leave anything of a solid {high - low:g} mm high"
        )
    return from_manifold(to_manifold(mesh).trim_by_plane((0.0, 0.0, 1.0), low + height))


def place_on_bed(mesh: Mesh) -> Mesh:
    """Move the mesh to stand on z = 0 with the middle of its bounds over the origin."""
    low, high = mesh.bounds
    return mesh.translated((-(low[0] + high[0]) / 2, -(low[1] + high[1]) / 2, -low[2]))
