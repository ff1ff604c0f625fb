"""What a mesh lacks of the surface it stands for: from the surface to the mesh."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np
from numpy.typing import NDArray

from fracslice.mesh.model import Mesh
from fracslice.mesh.nearest import Nearest
from fracslice.mesh.pieces import Around
from fracslice.volume import Plan
from fracslice.volume.accuracy import NEAR, surface_error, surface_points
from fracslice.work import Work

POINTS = 256
"""Of the field's own surface, besides its outermost ones."""

CELL = 3.0
"""Voxels along a cell in which triangles near a point are looked for."""


def surface_to_mesh(
    planned: Plan, pieces: Callable[[], Iterable[Mesh]], scale: float, work: Work
) -> NDArray[np.float64]:
    """Distances from the outermost points of a field, and from others found on its surface, to the mesh, mm.

    pieces: of the mesh with all bodies, scene units, as often as asked for. scale: mm per scene unit.
    """
    tips = planned.tips.T  # without those that were cut off or built over
    tips = tips[surface_error(planned.root, tips, planned.voxel, work) < NEAR * planned.voxel]
    found = surface_points(planned.root, planned.outer, planned.voxel, POINTS, work)
    return scale * distances(pieces, np.concatenate([tips, found]), planned.voxel, work)


def distances(
    pieces: Callable[[], Iterable[Mesh]], points: NDArray[np.float64], voxel: float, work: Work
) -> NDArray[np.float64]:
    """How far points are from a mesh that was made of samples a voxel apart, float64 [n].

    pieces: of the mesh, as often as asked for. Of each the triangles around the points are looked at, and for
    points that are not near any of these, all triangles. Raises `Cancelled`.
    """
    around = Around(points, CELL * voxel)
    near = (Mesh(mesh.vertices, mesh.triangles[around.triangles(mesh)]) for mesh in pieces())
    found = _least(near, points, work)
    # Triangles lie within a grid cell: one nearer than this has a corner that was seen.
    far = np.flatnonzero(found > (CELL - np.sqrt(3)) * voxel)
    if len(far):
        found[far] = _least(pieces(), points[far], work)
    return found


def _least(meshes: Iterable[Mesh], points: NDArray[np.float64], work: Work) -> NDArray[np.float64]:
    """The distances of points to the nearest of some meshes; infinite without triangles."""
    numbers = np.arange(len(points), dtype=np.int32)
    spots, found = Mesh(points, np.stack([numbers] * 3, 1)), np.full(len(points), np.inf)
    for mesh in meshes:
        if len(mesh.triangles):
            found = np.minimum(found, Nearest(mesh).samples(spots, 1.0, work))
    return found
