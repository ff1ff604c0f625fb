"""Spatial queries on the triangles of a mesh by a tree of boxes: distances and exact self-intersections.

Triangles are sorted in Morton order (G. M. Morton, 1966) and split into runs of `LEAF`. A complete binary
tree of boxes over the runs is stored as a heap: node i has the children 2i and 2i + 1.

Candidate pairs come from a tree of boxes; each pair is decided by the signs of exact predicates alone (the
idea of Guigue and Devillers, "Fast and Robust Triangle-Triangle Overlap Test Using Orientation Predicates",
2003). Adjacent triangles may meet only in the span of their shared vertices.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._native import Nearest as _Nearest
from .._native import self_intersecting_triangles as _self_intersecting_triangles
from .._native import surroundings
from .._native import tree as _tree
from ..work import Work, chunks
from .model import Mesh

LEAF = 8
"""Triangles per leaf; equal to the constant in `fracslice/native/mesh/triangles.h`."""


class Tree(NamedTuple):
    """Tree of bounding boxes; node 1 is the root."""

    order: NDArray[np.int64]  # triangles in Morton order
    low: NDArray[np.float64]  # corners of the boxes
    high: NDArray[np.float64]


def build(mesh: Mesh, threads: int = 0, halved: bool = False) -> Tree:
    """Build the tree of a mesh, in O(m); in O(m log m) in halves of boxes, which makes searches faster."""
    return Tree(*_tree(mesh.vertices, mesh.triangles, threads, halved))


CHUNK = 1 << 17
"""Triangles between two checks for cancellation."""

UNKNOWN = np.empty((0, 3), np.int32)


class Nearest:
    """Distance queries to a mesh."""

    def __init__(self, mesh: Mesh, tree: Tree | None = None, closed: bool = False) -> None:
        self._native = _Nearest(mesh.vertices, mesh.triangles, *(tree or build(mesh)), closed)

    def bounds(
        self, mesh: Mesh, tolerance: float, work: Work, hints: NDArray[np.int32] = UNKNOWN
    ) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
        """Proved bounds on the distances of triangles from this mesh.

        The distance to one triangle is a convex function: a piece whose corners are all within a distance of
        the same triangle lies within it as a whole. Other pieces are subdivided (the idea of Tang, Lee and
        Kim, "Interactive Hausdorff distance computation for general polygonal models", 2009).

        `hints`: int32 (m, 3). Returns float64 (m,); int32 (k, 2).
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

        `points`: float64 (n, 3). Returns float64 (n,).
        """
        return self._native.points(points, threads)

    def samples(self, mesh: Mesh, spacing: float, work: Work, enough: float = 0.0) -> NDArray[np.float64]:
        """Greatest distance of the samples of each triangle from this mesh.

        Samples are `spacing` apart and include corners and edges: no point is more than spacing / sqrt(3)
        farther. No distance is underestimated; one below `enough` may be overestimated, up to `enough`.

        Returns float64 (m,).
        """
        distances = np.empty(len(mesh.triangles))
        for part in chunks(len(distances), CHUNK):
            work.check()
            distances[part] = self._native.samples(
                mesh.vertices, mesh.triangles[part], spacing, enough, work.threads
            )
        return distances


def self_intersecting_triangles(
    mesh: Mesh,
    tree: Tree | None = None,
    threads: int | None = None,
    among: NDArray[np.bool_] | None = None,
) -> NDArray[np.bool_]:
    """Triangles that meet another one in more than their shared vertices and edges.

    Triangles without area are skipped. Vertices are shared by index.

    `among`: bool (m,). Returns bool (m,).
    """
    vertices, triangles, threads = mesh.vertices, mesh.triangles, threads or 0
    if among is None or tree is not None:
        return _self_intersecting_triangles(
            vertices, triangles, *(tree or build(mesh, threads)), threads, among
        )
    result, near = np.zeros(len(triangles), bool), surroundings(vertices, triangles, among, threads)
    if len(near):
        part = Mesh(vertices, triangles[near])
        result[near] = self_intersecting_triangles(part, build(part, threads), threads, among[near])
    return result
