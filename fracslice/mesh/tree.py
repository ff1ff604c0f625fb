# mypy: allow-untyped-defs, allow-untyped-calls, allow-untyped-decorators
"""A tree of boxes over the triangles of a mesh, for questions about neighbours in space.

Triangles are put in Morton order (G. M. Morton, 1966) and cut into runs of `LEAF`; a complete binary tree of
boxes stands on the runs, stored as a heap: node i has the children 2i and 2i + 1. Importing this module
imports Numba.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fracslice.mesh.model import Mesh

LEAF = 8


class Tree(NamedTuple):
    """order: int64 [m], triangles in Morton order; low, high: float64 [nodes, 3], boxes; 1 is the root."""

    order: NDArray[np.int64]
    low: NDArray[np.float64]
    high: NDArray[np.float64]


def build(mesh: Mesh) -> Tree:
    """The tree of a mesh with at least one triangle; O(m log m)."""
    low, size = mesh.bounds[0], float(mesh.size.max())
    scale = (2**21 - 1) / size if size > 0 else 0.0
    order = np.argsort(_morton(mesh.vertices, mesh.triangles, low, scale), kind="stable")
    return Tree(order, *_boxes(mesh.vertices, mesh.triangles, order))


@njit(cache=True, nogil=True)
def _spread(x):
    """Put two empty bits between the 21 bits of x."""
    x &= np.uint64(0x1FFFFF)
    x = (x | (x << np.uint64(32))) & np.uint64(0x1F00000000FFFF)
    x = (x | (x << np.uint64(16))) & np.uint64(0x1F0000FF0000FF)
    x = (x | (x << np.uint64(8))) & np.uint64(0x100F00F00F00F00F)
    x = (x | (x << np.uint64(4))) & np.uint64(0x10C30C30C30C30C3)
    return (x | (x << np.uint64(2))) & np.uint64(0x1249249249249249)


@njit(cache=True, nogil=True)
def _morton(vertices, triangles, low, scale):
    codes = np.empty(len(triangles), np.uint64)
    for t in range(len(triangles)):
        code = np.uint64(0)
        for k in range(3):
            middle = (
                vertices[triangles[t, 0], k] + vertices[triangles[t, 1], k] + vertices[triangles[t, 2], k]
            ) / 3
            code |= _spread(np.uint64(max(0.0, (middle - low[k]) * scale))) << np.uint64(k)
        codes[t] = code
    return codes


@njit(cache=True, nogil=True)
def _boxes(vertices, triangles, order):
    leaves = 1
    while leaves * LEAF < len(order):
        leaves *= 2
    low = np.full((2 * leaves, 3), np.inf)
    high = np.full((2 * leaves, 3), -np.inf)
    for i in range(len(order)):
        node = leaves + i // LEAF
        for corner in triangles[order[i]]:
            for k in range(3):
                low[node, k] = min(low[node, k], vertices[corner, k])
                high[node, k] = max(high[node, k], vertices[corner, k])
    for node in range(leaves - 1, 0, -1):
        for k in range(3):
            low[node, k] = min(low[2 * node, k], low[2 * node + 1, k])
            high[node, k] = max(high[2 * node, k], high[2 * node + 1, k])
    return low, high
