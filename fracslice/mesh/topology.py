"""How triangles hang together: the edges and fans around every vertex, and the parts they form."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fracslice._native import component_sizes as _component_sizes
from fracslice._native import connected_components as _connected_components
from fracslice._native import corners_by_vertex as _corners_by_vertex
from fracslice._native import edge_topology as _edge_topology


class EdgeTopology(NamedTuple):
    """Counts over a mesh; all but `edges` are zero for a closed, oriented 2-manifold."""

    edges: int
    open_edges: int
    non_manifold_edges: int
    misoriented_edges: int
    non_manifold_vertices: int


def edge_topology(triangles: NDArray[np.int32], vertices: int, threads: int = 0) -> EdgeTopology:
    """Edges of one triangle, of more than two, of two that run the same way; vertices that join fans.

    triangles: int32 [m, 3], each with three different indices below `vertices`. O(m), or O(m log d) at
    vertices of degree d. Raises ValueError for other indices, as everything here does.
    """
    ends = edge_ends(triangles, np.ones(vertices, dtype=np.bool_), threads)
    edges, opened, non_manifold, misoriented = (n // 2 for n in ends[:4])
    return EdgeTopology(edges, opened, non_manifold, misoriented, ends.non_manifold_vertices)


def edge_ends(triangles: NDArray[np.int32], counted: NDArray[np.bool_], threads: int = 0) -> EdgeTopology:
    """The same counts at some vertices only, bool [vertices]; of edges, their ends there."""
    return EdgeTopology(*_edge_topology(triangles, counted, threads))


def corners_by_vertex(
    triangles: NDArray[np.int32], vertices: int, threads: int = 0
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Corners, 3 t + k for corner k of triangle t, by vertex: start int64 [n + 1], corner int64 [3 m]."""
    return _corners_by_vertex(triangles, vertices, threads)


def connected_components(
    triangles: NDArray[np.int32], vertices: int, threads: int = 0
) -> tuple[NDArray[np.int32], int]:
    """The connected part of each triangle (int32 [m], numbered by first appearance), and how many there are.

    Triangles with a common vertex are connected.
    """
    return _connected_components(triangles, vertices, threads)


def component_sizes(
    vertices: NDArray[np.float64],
    triangles: NDArray[np.int32],
    labels: NDArray[np.int32],
    count: int,
    threads: int = 0,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Signed volume and area of each part, float64 [count].

    Volumes are measured from a vertex of the part's own: dust keeps its digits.
    """
    return _component_sizes(vertices, triangles, labels, count, threads)


def shell_volumes(
    vertices: NDArray[np.float64], triangles: NDArray[np.int32], labels: NDArray[np.int32], count: int
) -> NDArray[np.float64]:
    """The first of these."""
    return component_sizes(vertices, triangles, labels, count)[0]


def unite(parent: NDArray[np.int64], a: int, b: int) -> None:
    """Join the sets of a and b in a forest where parents have lower indices, halving paths."""
    roots = []
    for node in (a, b):
        while parent[node] != node:
            parent[node] = parent[parent[node]]
            node = int(parent[node])
        roots.append(node)
    parent[max(roots)] = min(roots)
