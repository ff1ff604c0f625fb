"""Self-intersections of a mesh, exact, coplanar overlaps included.

Candidate pairs come from a tree of boxes; each pair is decided by the signs of exact predicates alone (the
idea of Guigue and Devillers, "Fast and Robust Triangle-Triangle Overlap Test Using Orientation Predicates",
2003). Adjacent triangles may meet only in the span of their shared vertices.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .._native import self_intersecting_triangles as _self_intersecting_triangles
from .._native import surroundings
from .model import Mesh
from .tree import Tree, build


def self_intersecting_triangles(
    mesh: Mesh,
    tree: Tree | None = None,
    threads: int | None = None,
    among: NDArray[np.bool_] | None = None,
) -> NDArray[np.bool_]:
    """Triangles that meet another one in more than their shared vertices and edges.

    Triangles without area are skipped. Vertices are shared by index.

    Parameters
    ----------
    mesh : Mesh
        Mesh with finite vertices, equal positions welded.
    tree : Tree, optional
        Its tree of boxes; built by default.
    threads : int, optional
        Threads; all cores by default. The result does not depend on it.
    among : ndarray of bool, shape (m,), optional
        Search only pairs with one of these triangles.

    Returns
    -------
    ndarray of bool, shape (m,)
        True for each self-intersecting triangle.

    Raises
    ------
    ValueError
        For indices out of range, or the tree of another mesh.
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
