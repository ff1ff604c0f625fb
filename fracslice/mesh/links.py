# mypy: allow-untyped-defs, allow-untyped-calls, allow-untyped-decorators
"""How triangles hang together: the edges and fans around every vertex, and the parts they form.

Around vertex v each triangle is an arrow from its next corner to the one before. On a closed, oriented
surface every neighbour of v then has one arrow in and one out, and all arrows form one ring. Importing this
module imports Numba.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray


class Links(NamedTuple):
    """Counts over a mesh; all but `edges` are zero for a closed, oriented 2-manifold."""

    edges: int
    open_edges: int
    crowded_edges: int
    misoriented_edges: int
    extra_fans: int


def links(triangles: NDArray[np.int32], vertices: int) -> Links:
    """Edges of one triangle, of more than two, of two that run the same way; vertices that join fans.

    triangles: int32 [m, 3], each with three different indices below `vertices`. O(m), or O(m log d) at
    vertices of degree d.
    """
    ends = edge_ends(triangles, np.ones(vertices, dtype=np.bool_))
    edges, opened, crowded, misoriented = (n // 2 for n in ends[:4])
    return Links(edges, opened, crowded, misoriented, ends.extra_fans)


def edge_ends(triangles: NDArray[np.int32], counted: NDArray[np.bool_]) -> Links:
    """The same counts at some vertices only, bool [vertices]; of edges, their ends there."""
    return Links(*(int(n) for n in _links(triangles, counted, *corners_by_vertex(triangles, len(counted)))))


def parts(triangles: NDArray[np.int32], vertices: int) -> tuple[NDArray[np.int32], int]:
    """The connected part of each triangle (int32 [m], numbered by first appearance), and how many there are.

    Triangles with a common vertex are connected. Union by lowest index with path halving (Tarjan, van
    Leeuwen, 1984).
    """
    labels, count = _parts(triangles, vertices)
    return labels, int(count)


def shell_volumes(
    vertices: NDArray[np.float64], triangles: NDArray[np.int32], labels: NDArray[np.int32], count: int
) -> NDArray[np.float64]:
    """Signed volume of each part, float64 [count], from a vertex of its own: dust keeps its digits."""
    volumes: NDArray[np.float64] = _shell_volumes(vertices, triangles, labels, count)
    return volumes


@njit(cache=True, nogil=True)
def _shell_volumes(vertices, triangles, labels, count):
    volumes = np.zeros(count)
    origin = np.full(count, -1, np.int64)
    for t in range(len(triangles)):
        part = labels[t]
        if origin[part] < 0:
            origin[part] = triangles[t, 0]
        o, a, b, c = (
            vertices[origin[part]],
            vertices[triangles[t, 0]],
            vertices[triangles[t, 1]],
            vertices[triangles[t, 2]],
        )
        ax, ay, az = a[0] - o[0], a[1] - o[1], a[2] - o[2]
        bx, by, bz = b[0] - o[0], b[1] - o[1], b[2] - o[2]
        cx, cy, cz = c[0] - o[0], c[1] - o[1], c[2] - o[2]
        volumes[part] += (ay * bz - az * by) * cx + (az * bx - ax * bz) * cy + (ax * by - ay * bx) * cz
    return volumes / 6


@njit(cache=True, nogil=True)
def corners_by_vertex(triangles, vertices):
    """Corners grouped by vertex: start int64 [n + 1], corner int64 [3 m]."""
    start = np.zeros(vertices + 1, np.int64)
    for t in range(len(triangles)):
        for k in range(3):
            start[triangles[t, k] + 1] += 1
    for v in range(vertices):
        start[v + 1] += start[v]
    at = start[:-1].copy()
    corner = np.empty(3 * len(triangles), np.int64)
    for t in range(len(triangles)):
        for k in range(3):
            v = triangles[t, k]
            corner[at[v]] = 3 * t + k
            at[v] += 1
    return start, corner


@njit(cache=True, nogil=True)
def _links(triangles, counted, start, corner):
    """The counts of `Links`; edges are counted at both ends."""
    edges, opened, crowded, misoriented, extra_fans = 0, 0, 0, 0, 0
    widest = 1
    for v in range(len(start) - 1):
        widest = max(widest, start[v + 1] - start[v])
    spokes = np.empty(2 * widest, np.int64)
    fan = np.empty(widest, np.int64)
    for v in range(len(start) - 1):
        degree = start[v + 1] - start[v]
        if degree == 0 or not counted[v]:
            continue
        _set_spokes(triangles, corner, start[v], degree, spokes, fan)
        fans, i = degree, 0
        while i < 2 * degree:  # one neighbour after the other
            neighbour, j, outward = spokes[i] // (2 * degree), i, 0
            while j < 2 * degree and spokes[j] // (2 * degree) == neighbour:
                outward += 1 - spokes[j] % 2
                fans -= unite(fan, spokes[i] % (2 * degree) // 2, spokes[j] % (2 * degree) // 2)
                j += 1
            edges += 1
            opened += j - i == 1
            crowded += j - i > 2
            misoriented += j - i > 1 and 2 * outward != j - i
            i = j
        extra_fans += fans - 1
    return edges, opened, crowded, misoriented, extra_fans


@njit(cache=True, nogil=True)
def _set_spokes(triangles, corner, begin, degree, spokes, fan):
    """Sort the spokes of the corners at a vertex: (neighbour, corner, inward), each as one number."""
    for i in range(degree):
        t, k = corner[begin + i] // 3, corner[begin + i] % 3
        spokes[2 * i] = np.int64(triangles[t, (k + 1) % 3]) * (2 * degree) + 2 * i
        spokes[2 * i + 1] = np.int64(triangles[t, (k + 2) % 3]) * (2 * degree) + 2 * i + 1
        fan[i] = i
    if degree > 16:
        spokes[: 2 * degree].sort()
        return
    for i in range(1, 2 * degree):
        value, j = spokes[i], i
        while j > 0 and spokes[j - 1] > value:
            spokes[j] = spokes[j - 1]
            j -= 1
        spokes[j] = value


@njit(cache=True, nogil=True)
def unite(parent, a, b):
    """Join two sets; 1 if they were apart."""
    while parent[a] != a:
        parent[a] = parent[parent[a]]
        a = parent[a]
    while parent[b] != b:
        parent[b] = parent[parent[b]]
        b = parent[b]
    if a == b:
        return 0
    parent[max(a, b)] = min(a, b)
    return 1


@njit(cache=True, nogil=True)
def _parts(triangles, vertices):
    parent = np.arange(vertices)
    for t in range(len(triangles)):
        unite(parent, triangles[t, 0], triangles[t, 1])
        unite(parent, triangles[t, 0], triangles[t, 2])
    for v in range(vertices):
        parent[v] = parent[parent[v]]
    number = np.full(vertices, -1, np.int32)
    labels = np.empty(len(triangles), np.int32)
    count = 0
    for t in range(len(triangles)):
        root = parent[triangles[t, 0]]
        if number[root] < 0:
            number[root] = count
            count += 1
        labels[t] = number[root]
    return labels, count
