"""How far other meshes are from one: proved, or sampled."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fracslice._native import Nearest as _Nearest
from fracslice.mesh.model import Mesh
from fracslice.mesh.tree import Tree, build
from fracslice.work import Work, chunks

CHUNK = 1 << 17
"""Triangles between two looks at whether to stop."""

UNKNOWN = np.empty((0, 3), np.int32)


class Nearest:
    """A mesh that tells how far others are from it.

    tree: built if None. closed: the mesh is a closed, oriented 2-manifold, on which near things are found
    faster. Raises ValueError for indices out of range, the tree of another mesh, or no triangles.
    """

    def __init__(self, mesh: Mesh, tree: Tree | None = None, closed: bool = False) -> None:
        self._native = _Nearest(mesh.vertices, mesh.triangles, *(tree or build(mesh)), closed)

    def bounds(
        self, mesh: Mesh, tolerance: float, work: Work, hints: NDArray[np.int32] = UNKNOWN
    ) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
        """For each triangle of `mesh` a proved bound on how far its points are, float64 [m].

        Infinite where a point is farther than `tolerance`, or that could not be excluded. hints: int32
        [m, 3], for each corner a triangle here that may be near it. What a bound depends on besides comes
        second: int32 [k, 2], a triangle of `mesh` and one here. The distance to one triangle is a convex
        function: a piece whose corners all are within a distance of the same triangle is so as a whole; other
        pieces are cut (the idea of Tang, Lee and Kim, "Interactive Hausdorff distance computation for general
        polygonal models", 2009). Raises `Cancelled`.
        """
        found, beyond = np.empty(len(mesh.triangles)), [UNKNOWN[:, :2]]
        for part in chunks(len(found), CHUNK):
            work.check()
            found[part], pairs = self._native.bounds(
                mesh.vertices, mesh.triangles[part], hints[part], tolerance, work.threads
            )
            beyond.append(pairs + np.array([part.start, 0], np.int32))
        return found, np.concatenate(beyond)

    def samples(self, mesh: Mesh, spacing: float, work: Work, enough: float = 0.0) -> NDArray[np.float64]:
        """For each triangle of `mesh` the greatest distance of its samples, float64 [m].

        Samples are `spacing` apart, corners and edges included, so that no point is more than
        spacing / sqrt(3) farther. No distance is too small; one below `enough` may be too great, but not
        above it. Raises `Cancelled`.
        """
        found = np.empty(len(mesh.triangles))
        for part in chunks(len(found), CHUNK):
            work.check()
            found[part] = self._native.samples(
                mesh.vertices, mesh.triangles[part], spacing, enough, work.threads
            )
        return found
