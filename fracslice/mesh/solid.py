"""Meshes as solids: proof by manifold3d, place on the bed."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from fracslice.errors import MeshError
from fracslice.extras import lacking
from fracslice.mesh.certificate import Certificate
from fracslice.mesh.model import Mesh

if TYPE_CHECKING:
    from manifold3d import Manifold

FLAT = 1e-6
"""Of the mesh's size: what is not higher than this above the bed lies on it, so that a flat base is flat."""

_REASONS = {
    "NonFiniteVertex": "a coordinate is not a finite number",
    "NotManifold": "it is not closed, or an edge does not join exactly two triangles of the same sense",
    "VertexOutOfBounds": "a triangle names a vertex that does not exist",
    "ResultTooLarge": "it has too many triangles",
}


def to_manifold(mesh: Mesh) -> Manifold:
    """The mesh as a manifold3d solid, taken as it is, in double precision.

    Raises MeshError in plain words when manifold3d is not installed or refuses it, or it has no triangles.
    """
    if reason := lacking("manifold3d", "solids need"):
        raise MeshError(reason)
    import manifold3d

    if not len(mesh.triangles):
        raise MeshError("the mesh has no triangles")
    corners = np.array(mesh.vertices, np.float64)  # a copy: manifold3d takes none that is read-only
    solid = manifold3d.Manifold(manifold3d.Mesh64(corners, mesh.triangles.astype(np.uint64)))
    status = solid.status().name
    if status != "NoError":
        raise MeshError(f"the mesh is not a solid: {_REASONS.get(status, status)}")
    return solid


def place_on_bed(
    mesh: Mesh, middle: tuple[float, float], certificate: Certificate
) -> tuple[Mesh, Certificate]:
    """Move the mesh to stand on z = 0 with a point (x, y) over the origin, and what is known of it."""
    low, high = mesh.bounds
    offset, flat = np.array([-middle[0], -middle[1], -low[2]]), FLAT * (high - low).max()
    vertices, moved = mesh.vertices + offset, certificate.translated(offset)
    vertices[vertices[:, 2] < flat, 2] = 0
    if ((moved.planes[:, 2] >= 0) & (moved.planes[:, 2] < flat)).any():  # some are below it now
        moved = replace(moved, holds=moved.holds & (vertices[:, 2] > 0)[mesh.triangles].all(axis=1))
    return Mesh(vertices, mesh.triangles), moved
