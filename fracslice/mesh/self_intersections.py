"""Which triangles of a mesh cut, touch or cover others: exact, coplanar overlaps included.

Pairs come from a tree of boxes, each pair is decided by the signs of exact predicates alone (the idea of
Guigue and Devillers, "Fast and Robust Triangle-Triangle Overlap Test Using Orientation Predicates", 2003).
Neighbours may share what their shared vertices span and nothing else.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fracslice._native import self_intersecting_triangles as _self_intersecting_triangles
from fracslice._native import surroundings
from fracslice.mesh.model import Mesh
from fracslice.mesh.tree import Tree, build


def self_intersecting_triangles(
    mesh: Mesh,
    tree: Tree | None = None,
    threads: int | None = None,
    among: NDArray[np.bool_] | None = None,
) -> NDArray[np.bool_]:
    """Which triangles meet another one in more than the vertices both have by index, bool [m].

    Triangles without area are passed over. Vertices must be finite, with equal positions welded to one index.
    threads: all cores if None; the result is the same for any number. among: bool [m], only pairs with one of
    these are looked at. Raises ValueError for indices out of range and for the tree of another mesh.
    """
    vertices, triangles, threads = mesh.vertices, mesh.triangles, threads or 0
    if among is None or tree is not None:
        return _self_intersecting_triangles(
            vertices, triangles, *(tree or build(mesh, threads)), threads, among
        )
    found, near = np.zeros(len(triangles), bool), surroundings(vertices, triangles, among, threads)
    if len(near):
        part = Mesh(vertices, triangles[near])
        found[near] = self_intersecting_triangles(part, build(part, threads), threads, among[near])
    return found
