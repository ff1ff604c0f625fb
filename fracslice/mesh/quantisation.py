"""Quantisation of coordinates to float32, and welding."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fracslice.errors import MeshError
from fracslice.mesh.model import Mesh

NO_PLANES = np.empty((0, 3))


def quantised(mesh: Mesh, threads: int = 0) -> Mesh:
    """Quantise and weld a mesh, as a reader of its STL does.

    Every triangle is kept, in order; unused vertices are removed. Quantise once, before the check and the
    export, so that both treat the same mesh.

    Parameters
    ----------
    mesh : Mesh
        The mesh.
    threads : int, optional
        Threads; 0 for all cores.

    Returns
    -------
    Mesh
        Coordinates rounded to float32, equal positions welded.

    Raises
    ------
    MeshError
        If a coordinate is not finite or an index is out of range.
    """
    points, _ = quantise(mesh, NO_PLANES, threads)
    return welded(Mesh(points, mesh.triangles), threads)


def quantise(
    mesh: Mesh, planes: NDArray[np.float64] = NO_PLANES, threads: int = 0
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Round vertices to float32, without negative zeros.

    Parameters
    ----------
    mesh : Mesh
        The mesh.
    planes : ndarray of float64, shape (k, 3), optional
        Planes of a grid across each axis, ascending.
    threads : int, optional
        Threads; 0 for all cores.

    Returns
    -------
    ndarray of float64, shape (n, 3)
        Rounded vertices.
    ndarray of bool, shape (n,)
        True for each displaced vertex: one that is no longer in the same planes and strictly between the same
        ones. Without planes all vertices are displaced.

    Raises
    ------
    MeshError
        If a coordinate is not finite or an index is out of range.
    """
    from fracslice._native import quantise

    if len(mesh.triangles) and not 0 <= mesh.triangles.min() <= mesh.triangles.max() < len(mesh.vertices):
        raise MeshError("a triangle names a vertex that does not exist")
    try:
        return quantise(mesh.vertices, planes, threads)
    except ValueError as error:
        raise MeshError(str(error)) from None


def welded(mesh: Mesh, threads: int = 0) -> Mesh:
    """Weld equal positions and remove unused vertices.

    Parameters
    ----------
    mesh : Mesh
        Mesh with float32 coordinates.
    threads : int, optional
        Threads; 0 for all cores.

    Returns
    -------
    Mesh
        The welded mesh.
    """
    from fracslice.mesh.weld import weld

    first, labels = weld(mesh.vertices.astype(np.float32))
    if len(first) < len(mesh.vertices):
        mesh = Mesh(mesh.vertices[first], labels[mesh.triangles])
    return mesh.selected(np.ones(len(mesh.triangles), bool), threads)
