"""Tree of bounding boxes over the triangles of a mesh, for spatial queries.

Triangles are sorted in Morton order (G. M. Morton, 1966) and split into runs of `LEAF`. A complete binary
tree of boxes over the runs is stored as a heap: node i has the children 2i and 2i + 1.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._native import tree as _tree
from .model import Mesh

LEAF = 8
"""Triangles per leaf; equal to the constant in `fracslice/native/mesh/triangles.h`."""


class Tree(NamedTuple):
    """Tree of bounding boxes; node 1 is the root.

    Attributes
    ----------
    order : ndarray of int64, shape (m,)
        Triangles in Morton order.
    low, high : ndarray of float64, shape (nodes, 3)
        Corners of the boxes.
    """

    order: NDArray[np.int64]
    low: NDArray[np.float64]
    high: NDArray[np.float64]


def build(mesh: Mesh, threads: int = 0) -> Tree:
    """Build the tree of a mesh, in O(m).

    Parameters
    ----------
    mesh : Mesh
        Mesh with at least one triangle.
    threads : int, optional
        Threads; 0 for all cores.
    """
    return Tree(*_tree(mesh.vertices, mesh.triangles, threads))
