"""Distance from the surface to the mesh: parts of the surface that the mesh lacks."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np
from numpy.typing import NDArray

from .._native import near
from ..volume import Plan
from ..volume.accuracy import NEAR, surface_error, surface_points
from ..work import Work
from .model import Mesh
from .nearest import Nearest

POINTS = 256
"""Random points on the field's surface, besides its extreme points."""

NEARBY, FARTHER = 2.5, 2.0
"""First distance within which triangles are searched, voxels, and its growth."""


def surface_to_mesh(
    planned: Plan, pieces: Callable[[], Iterable[Mesh]], scale: float, work: Work
) -> NDArray[np.float64]:
    """Distances from the extreme points of a field, and from other points on its surface, to the mesh.

    Parameters
    ----------
    planned : Plan
        Sampled field.
    pieces : callable
        Iterates over the pieces of the mesh with all bodies, scene units; called repeatedly.
    scale : float
        mm per scene unit.
    work : Work
        Threads and cancellation.

    Returns
    -------
    ndarray of float64, shape (n,)
        Distances, mm.

    Raises
    ------
    Cancelled
        If the work is cancelled.
    """

    def search(points: NDArray[np.float64], reach: float) -> NDArray[np.float64]:
        return nearest(pieces(), points, reach, work)

    points, voxel = surface_samples(planned, work), planned.voxel
    return scale * distances(search, points, voxel, search(points, NEARBY * voxel))


def surface_samples(planned: Plan, work: Work) -> NDArray[np.float64]:
    """Extreme points of a field and other points on its surface, found without a mesh.

    Returns
    -------
    ndarray of float64, shape (n, 3)
        Points, scene units.
    """
    tips = planned.tips.T  # only extreme points that are still on the surface
    tips = tips[surface_error(planned.root, tips, planned.voxel, work) < NEAR * planned.voxel]
    samples = surface_points(planned.root, planned.outer, planned.voxel, POINTS, work)
    return np.concatenate([tips, samples])


def distances(
    search: Callable[[NDArray[np.float64], float], NDArray[np.float64]],
    points: NDArray[np.float64],
    voxel: float,
    nearby: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Distances from points to a mesh.

    For points without a triangle nearby, those farther away are searched.

    Parameters
    ----------
    search : callable
        Distances from points to the triangles within reach; see `nearest`.
    points : ndarray of float64, shape (n, 3)
        Points, in the units of the mesh.
    voxel : float
        Spacing of the samples that the mesh was made from.
    nearby : ndarray of float64, shape (n,)
        Distances to the triangles within `NEARBY` voxels.

    Returns
    -------
    ndarray of float64, shape (n,)
        Distances.
    """
    result, reach = nearby.copy(), NEARBY * voxel
    # Triangles lie within a grid cell: any nearer one has its corners in reach.
    while (far := result > reach - np.sqrt(3) * voxel).any():
        reach *= FARTHER
        result[far] = search(points[far], reach)
    return result


def nearest(
    pieces: Iterable[Mesh], points: NDArray[np.float64], reach: float, work: Work
) -> NDArray[np.float64]:
    """Distances from points to the triangles of a mesh within reach.

    Parameters
    ----------
    pieces : iterable of Mesh
        Pieces of the mesh.
    points : ndarray of float64, shape (n, 3)
        Points, in the units of the mesh.
    reach : float
        Triangles with a corner within this distance along each axis of a point are searched.
    work : Work
        Threads and cancellation.

    Returns
    -------
    ndarray of float64, shape (n,)
        Distances; infinite where no triangle is within reach of any point.
    """
    return _least((_near(mesh, points, reach, work) for mesh in pieces), points, work)


def _near(mesh: Mesh, points: NDArray[np.float64], reach: float, work: Work) -> Mesh:
    """Triangles with a corner near points."""
    chosen = near(mesh.vertices, mesh.triangles, points, reach, work.threads)
    return Mesh(mesh.vertices, mesh.triangles[chosen])


def _least(meshes: Iterable[Mesh], points: NDArray[np.float64], work: Work) -> NDArray[np.float64]:
    """Distance from each point to the nearest of several meshes; infinite without triangles."""
    numbers = np.arange(len(points), dtype=np.int32)
    spots, least = Mesh(points, np.stack([numbers] * 3, 1)), np.full(len(points), np.inf)
    for mesh in meshes:
        if len(mesh.triangles):
            least = np.minimum(least, Nearest(mesh).samples(spots, 1.0, work))
    return least
