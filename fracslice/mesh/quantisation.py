"""Quantisation of coordinates to float32, and welding."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .. import _native
from ..errors import MeshError
from ..volume.bricks import SignBricks
from ..volume.lattice import BRICK
from .model import Mesh

Frame = tuple[float, tuple[float, float, float], float]
"""Placement of vertices: scale, translation, and height below which they are moved to the bed, z = 0."""

UNMOVED: Frame = (1.0, (0.0, 0.0, 0.0), -np.inf)

NO_PLANES = np.empty((0, 3))

Edits = tuple[NDArray[np.int64], NDArray[np.int32]]
"""Edited triangles, ascending, and their corners, [k, 3]; -1 for removed ones."""

NO_EDITS: Edits = np.empty(0, np.int64), np.empty((0, 3), np.int32)


def grid_planes(signs: SignBricks) -> NDArray[np.float64]:
    """Planes of the grid that a mesh was contoured on.

    Contoured triangles do not intersect (`fracslice/native/mesh/contour.h`), nor do quantised ones if no
    vertex changes its position relative to these planes (`quantise.h`).

    Returns float64 (k, 3), scene units.
    """
    steps = np.arange(-BRICK, BRICK * (max(signs.index.shape) + 1) + 1)
    return np.array(signs.origin) + signs.voxel * steps[:, None]


class Quantised(NamedTuple):
    """Result of `quantise`."""

    mesh: Mesh  # quantised mesh
    displaced: NDArray[np.bool_]  # true for each displaced vertex: only these can coincide with others
    places: NDArray[np.int64]  # indices of the edited triangles; -1 for removed ones


def quantise_mesh(mesh: Mesh, threads: int = 0) -> Mesh:
    """Quantise and weld a mesh, as a reader of its STL does.

    Every triangle is kept, in order; unused vertices are removed. Quantise once, before the check and the
    export, so that both treat the same mesh.

    The coordinates are rounded to float32.
    """
    return weld(quantise(mesh, used_vertices(mesh), threads=threads).mesh)


def used_vertices(mesh: Mesh) -> NDArray[np.bool_]:
    """Vertices of triangles.

    Returns bool (n,).
    """
    if len(mesh.triangles) and not 0 <= mesh.triangles.min() <= mesh.triangles.max() < len(mesh.vertices):
        raise MeshError("a triangle names a vertex that does not exist")
    result = np.zeros(len(mesh.vertices), bool)
    result[mesh.triangles] = True
    return result


def quantise(
    mesh: Mesh,
    keep: NDArray[np.bool_],
    displaced: NDArray[np.bool_] | None = None,
    edits: Edits = NO_EDITS,
    planes: NDArray[np.float64] = NO_PLANES,
    frame: Frame = UNMOVED,
    threads: int = 0,
) -> Quantised:
    """Place the vertices of a mesh and round them to float32, without negative zeros.

    `keep`, `displaced`: bool (n,); `planes`: float64 (k, 3).
    """
    if displaced is None:
        displaced = np.zeros(len(keep), bool)
    try:
        vertices, triangles, moved, places = _native.quantise(
            mesh.vertices, mesh.triangles, keep, displaced, *edits, planes, frame, threads
        )
    except ValueError as error:
        raise MeshError(str(error)) from None
    return Quantised(Mesh(vertices, triangles), moved, places)


def place_and_round(points: NDArray[np.float64], frame: Frame) -> NDArray[np.float64]:
    """Place points and round them, as `quantise` does.

    `points`: float64 (n, 3). Returns float64 (n, 3).
    """
    scale, offset, bed = frame
    result = points * scale + np.array(offset)
    result[result[:, 2] < bed, 2] = 0
    rounded: NDArray[np.float64] = result.astype(np.float32).astype(np.float64) + 0.0
    return rounded


def weld(mesh: Mesh) -> Mesh:
    """Weld equal positions.

    `mesh`: mesh with float32 coordinates.
    """
    first, labels = _native.weld(mesh.vertices.astype(np.float32))
    return Mesh(mesh.vertices[first], labels[mesh.triangles]) if len(first) < len(mesh.vertices) else mesh
