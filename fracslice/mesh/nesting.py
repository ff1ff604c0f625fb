# mypy: allow-untyped-defs, allow-untyped-calls, allow-untyped-decorators
"""Which shell of a mesh lies inside which: rays straight up, decided by exact predicates.

Importing this module imports Numba.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fracslice.mesh.model import Mesh
from fracslice.mesh.predicates import side_of_line, side_of_plane
from fracslice.mesh.tree import LEAF, Tree, build


class Nesting(NamedTuple):
    """winding: int64 [s], how often others surround each shell; parent: int64 [s], the smallest, or -1."""

    winding: NDArray[np.int64]
    parent: NDArray[np.int64]


def nesting(
    mesh: Mesh,
    labels: NDArray[np.int32],
    volumes: NDArray[np.float64],
    tree: Tree | None = None,
    first: NDArray[np.int64] | None = None,
) -> Nesting:
    """Where each closed shell of a mesh lies.

    labels: int32 [m], the shell of each triangle; volumes: float64 [s], signed. A ray from one vertex of each
    shell goes up and adds the winding of every triangle it passes; edges and vertices on the ray count once
    (half-open edges). first: int64 [s], that vertex, if it matters which; -1 for a shell not to be looked at.
    The mesh need only be whole where these rays pass.
    """
    count = len(volumes)
    if count < 2:
        return Nesting(np.zeros(count, np.int64), np.full(count, -1, np.int64))
    if first is None:
        first = np.zeros(count, np.int64)
        first[labels[::-1]] = mesh.triangles[::-1, 0]
    sizes = np.abs(volumes)
    return Nesting(*_nesting(mesh.vertices, mesh.triangles, labels, sizes, first, *(tree or build(mesh))))


@njit(cache=True, nogil=True)
def _nesting(vertices, triangles, labels, sizes, first, order, low, high):
    winding = np.zeros(len(first), np.int64)
    parent = np.full(len(first), -1, np.int64)
    around = np.zeros(len(first), np.int64)
    seen = np.empty(len(first), np.int64)
    for shell in range(len(first)):
        if first[shell] < 0:
            continue
        count = _around(vertices, triangles, labels, first[shell], order, low, high, around, seen)
        for i in range(count):
            other = seen[i]
            if other != shell and around[other] != 0:
                winding[shell] += around[other]
                if parent[shell] < 0 or sizes[other] < sizes[parent[shell]]:
                    parent[shell] = other
            around[other] = 0
    return winding, parent


@njit(cache=True, nogil=True)
def _around(vertices, triangles, labels, vertex, order, low, high, around, seen):
    """Add to `around` the winding of every shell about a vertex; the shells met go to `seen`, each once."""
    x, y, z = vertices[vertex, 0], vertices[vertex, 1], vertices[vertex, 2]
    leaves, count = len(low) // 2, 0
    stack = np.empty(128, np.int64)
    stack[0], height = 1, 1
    while height > 0:
        height -= 1
        node = stack[height]
        if (
            x < low[node, 0]
            or x > high[node, 0]
            or y < low[node, 1]
            or y > high[node, 1]
            or z > high[node, 2]
        ):
            continue
        if node < leaves:
            stack[height], stack[height + 1] = 2 * node, 2 * node + 1
            height += 2
            continue
        begin = (node - leaves) * LEAF
        for i in range(begin, min(len(order), begin + LEAF)):
            turn = _winding(vertices, triangles, order[i], (x, y, z))
            if turn != 0:
                shell = labels[order[i]]
                if not _contains(seen, count, shell):
                    seen[count] = shell
                    count += 1
                around[shell] += turn
    return count


@njit(cache=True, nogil=True)
def _contains(values, count, value):
    return (values[:count] == value).any()


@njit(cache=True, nogil=True)
def _winding(vertices, triangles, t, p):
    """1 if the ray up from p leaves through the triangle, -1 if it enters, else 0."""
    turn = 0
    for k in range(3):
        a, b = triangles[t, k], triangles[t, (k + 1) % 3]
        up = vertices[a, 1] <= p[1] < vertices[b, 1]
        down = vertices[b, 1] <= p[1] < vertices[a, 1]
        if up or down:
            side = side_of_line(vertices[a, 0], vertices[a, 1], vertices[b, 0], vertices[b, 1], p[0], p[1])
            turn += (side > 0) * up - (side < 0) * down
    if turn == 0:
        return 0
    a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
    side = side_of_plane(
        (vertices[a, 0], vertices[a, 1], vertices[a, 2]),
        (vertices[b, 0], vertices[b, 1], vertices[b, 2]),
        (vertices[c, 0], vertices[c, 1], vertices[c, 2]),
        p,
    )
    return turn if side * turn > 0 else 0
