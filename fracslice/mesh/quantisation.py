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

    Parameters
    ----------
    signs : SignBricks
        Samples.

    Returns
    -------
    ndarray of float64, shape (k, 3)
        Planes across each axis, ascending, scene units.
    """
    steps = np.arange(-BRICK, BRICK * (max(signs.index.shape) + 1) + 1)
    return np.array(signs.origin) + signs.voxel * steps[:, None]


class Quantised(NamedTuple):
    """Result of `quantise`.

    Attributes
    ----------
    mesh : Mesh
        Quantised mesh.
    displaced : ndarray of bool, shape (n,)
        True for each displaced vertex: only these can coincide with others.
    places : ndarray of int64, shape (k,)
        Indices of the edited triangles; -1 for removed ones.
    """

    mesh: Mesh
    displaced: NDArray[np.bool_]
    places: NDArray[np.int64]


def quantised(mesh: Mesh, threads: int = 0) -> Mesh:
    """Quantise and weld a mesh, as a reader of its STL does.

    Every triangle is kept, in order; unused vertices are removed. Quantise once, before the check and the
    export, so that both treat the same mesh.

    Returns
    -------
    Mesh
        Coordinates rounded to float32, equal positions welded.

    Raises
    ------
    MeshError
        If a coordinate is not finite or an index is out of range.
    """
    return welded(quantise(mesh, used(mesh), threads=threads).mesh)


def used(mesh: Mesh) -> NDArray[np.bool_]:
    """Vertices of triangles.

    Returns
    -------
    ndarray of bool, shape (n,)
        True for each used vertex.

    Raises
    ------
    MeshError
        If an index is out of range.
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

    Parameters
    ----------
    mesh : Mesh
        The mesh.
    keep : ndarray of bool, shape (n,)
        Vertices of the triangles that stay.
    displaced : ndarray of bool, shape (n,), optional
        Vertices that count as displaced.
    edits : Edits, optional
        Triangles with other corners, or removed ones.
    planes : ndarray of float64, shape (k, 3), optional
        Placed planes of a grid across each axis, ascending. A vertex that is no longer in the same planes and
        strictly between the same ones is displaced; without planes all are.
    frame : Frame, optional
        Placement; none by default.
    threads : int, optional
        Threads; 0 for all cores.

    Returns
    -------
    Quantised
        The triangles that stay, in order.

    Raises
    ------
    MeshError
        If a coordinate is not finite.
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


def placed(points: NDArray[np.float64], frame: Frame) -> NDArray[np.float64]:
    """Place points and round them, as `quantise` does.

    Parameters
    ----------
    points : ndarray of float64, shape (n, 3)
        Points.
    frame : Frame
        Placement.

    Returns
    -------
    ndarray of float64, shape (n, 3)
        Rounded points.
    """
    scale, offset, bed = frame
    result = points * scale + np.array(offset)
    result[result[:, 2] < bed, 2] = 0
    rounded: NDArray[np.float64] = result.astype(np.float32).astype(np.float64) + 0.0
    return rounded


def welded(mesh: Mesh) -> Mesh:
    """Weld equal positions.

    Parameters
    ----------
    mesh : Mesh
        Mesh with float32 coordinates.
    """
    first, labels = _native.weld(mesh.vertices.astype(np.float32))
    return Mesh(mesh.vertices[first], labels[mesh.triangles]) if len(first) < len(mesh.vertices) else mesh
