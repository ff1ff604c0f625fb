"""A tree of boxes over the triangles of a mesh, for questions about neighbours in space.

Triangles are put in Morton order (G. M. Morton, 1966) and cut into runs of `LEAF`; a complete binary tree of
boxes stands on the runs, stored as a heap: node i has the children 2i and 2i + 1.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fracslice._native import tree as _tree
from fracslice.mesh.model import Mesh

LEAF = 8
"""As in `fracslice/native/mesh/triangles.h`."""


class Tree(NamedTuple):
    """order: int64 [m], triangles in Morton order; low, high: float64 [nodes, 3], boxes; 1 is the root."""

    order: NDArray[np.int64]
    low: NDArray[np.float64]
    high: NDArray[np.float64]


def build(mesh: Mesh, threads: int = 0) -> Tree:
    """The tree of a mesh with at least one triangle; O(m)."""
    return Tree(*_tree(mesh.vertices, mesh.triangles, threads))
