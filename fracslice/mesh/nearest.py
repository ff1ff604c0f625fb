"""Distances of other meshes from a mesh: proved bounds, or samples."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .._native import Nearest as _Nearest
from ..work import Work, chunks
from .model import Mesh
from .tree import Tree, build

CHUNK = 1 << 17
"""Triangles between two checks for cancellation."""

UNKNOWN = np.empty((0, 3), np.int32)


class Nearest:
    """Distance queries to a mesh.

    Parameters
    ----------
    mesh : Mesh
        The mesh.
    tree : Tree, optional
        Its tree of boxes; built by default.
    closed : bool, optional
        True if the mesh is a closed, oriented 2-manifold; searches are then faster.

    Raises
    ------
    ValueError
        For indices out of range, the tree of another mesh, or no triangles.
    """

    def __init__(self, mesh: Mesh, tree: Tree | None = None, closed: bool = False) -> None:
        self._native = _Nearest(mesh.vertices, mesh.triangles, *(tree or build(mesh)), closed)

    def bounds(
        self, mesh: Mesh, tolerance: float, work: Work, hints: NDArray[np.int32] = UNKNOWN
    ) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
        """Proved bounds on the distances of triangles from this mesh.

        The distance to one triangle is a convex function: a piece whose corners are all within a distance of
        the same triangle lies within it as a whole. Other pieces are subdivided (the idea of Tang, Lee and
        Kim, "Interactive Hausdorff distance computation for general polygonal models", 2009).

        Parameters
        ----------
        mesh : Mesh
            Triangles to bound.
        tolerance : float
            Greatest distance of interest.
        work : Work
            Threads and cancellation.
        hints : ndarray of int32, shape (m, 3), optional
            For each corner a triangle of this mesh that may be near it.

        Returns
        -------
        ndarray of float64, shape (m,)
            Bounds; infinite where a point is, or may be, farther than the tolerance.
        ndarray of int32, shape (k, 2)
            Further dependencies of the bounds: a triangle of `mesh` and one of this mesh.

        Raises
        ------
        Cancelled
            If the work is cancelled.
        """
        bounds, beyond = np.empty(len(mesh.triangles)), [UNKNOWN[:, :2]]
        for part in chunks(len(bounds), CHUNK):
            work.check()
            bounds[part], pairs = self._native.bounds(
                mesh.vertices, mesh.triangles[part], hints[part], tolerance, work.threads
            )
            beyond.append(pairs + np.array([part.start, 0], np.int32))
        return bounds, np.concatenate(beyond)

    def points(self, points: NDArray[np.float64], threads: int = 0) -> NDArray[np.float64]:
        """Distances of points from this mesh; fast where consecutive points lie close together.

        Parameters
        ----------
        points : ndarray of float64, shape (n, 3)
            Points.
        threads : int, optional
            Threads; 0 for all cores.

        Returns
        -------
        ndarray of float64, shape (n,)
            Distances.
        """
        return self._native.points(points, threads)

    def samples(self, mesh: Mesh, spacing: float, work: Work, enough: float = 0.0) -> NDArray[np.float64]:
        """Greatest distance of the samples of each triangle from this mesh.

        Samples are `spacing` apart and include corners and edges: no point is more than spacing / sqrt(3)
        farther. No distance is underestimated; one below `enough` may be overestimated, up to `enough`.

        Parameters
        ----------
        mesh : Mesh
            Triangles to sample.
        spacing : float
            Spacing of the samples.
        work : Work
            Threads and cancellation.
        enough : float, optional
            Distance below which accuracy does not matter.

        Returns
        -------
        ndarray of float64, shape (m,)
            Distances.

        Raises
        ------
        Cancelled
            If the work is cancelled.
        """
        distances = np.empty(len(mesh.triangles))
        for part in chunks(len(distances), CHUNK):
            work.check()
            distances[part] = self._native.samples(
                mesh.vertices, mesh.triangles[part], spacing, enough, work.threads
            )
        return distances
