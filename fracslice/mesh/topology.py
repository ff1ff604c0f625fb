"""Topology of triangles: edges, fans around vertices, and connected components."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._native import component_sizes as _component_sizes
from .._native import edge_topology as _edge_topology


class EdgeTopology(NamedTuple):
    """Counts of edges and vertices of a mesh; all but `edges` are zero for a closed, oriented 2-manifold.

    Attributes
    ----------
    edges : int
        Edges.
    open_edges : int
        Edges of one triangle.
    non_manifold_edges : int
        Edges of more than two triangles.
    misoriented_edges : int
        Edges of two triangles that traverse them in the same direction.
    non_manifold_vertices : int
        Vertices that join several fans.
    """

    edges: int
    open_edges: int
    non_manifold_edges: int
    misoriented_edges: int
    non_manifold_vertices: int


def edge_topology(triangles: NDArray[np.int32], vertices: int, threads: int = 0) -> EdgeTopology:
    """Count open, non-manifold and misoriented edges, and non-manifold vertices.

    O(m), or O(m log d) at vertices of degree d.

    Parameters
    ----------
    triangles : ndarray of int32, shape (m, 3)
        Triangles; the three indices of each differ and are below `vertices`.
    vertices : int
        Number of vertices.
    threads : int, optional
        Threads; 0 for all cores.

    Raises
    ------
    ValueError
        For other indices, as all functions of this module.
    """
    ends = edge_ends(triangles, np.ones(vertices, dtype=np.bool_), threads)
    edges, opened, non_manifold, misoriented = (n // 2 for n in ends[:4])
    return EdgeTopology(edges, opened, non_manifold, misoriented, ends.non_manifold_vertices)


def edge_ends(triangles: NDArray[np.int32], counted: NDArray[np.bool_], threads: int = 0) -> EdgeTopology:
    """Counts of `edge_topology` at some vertices; edges are counted by their ends.

    An edge with both ends at these vertices counts twice.

    Parameters
    ----------
    triangles : ndarray of int32, shape (m, 3)
        Triangles.
    counted : ndarray of bool, shape (n,)
        True for each counted vertex.
    threads : int, optional
        Threads; 0 for all cores.

    Returns
    -------
    EdgeTopology
        Counts of edge ends and of non-manifold vertices.
    """
    return EdgeTopology(*_edge_topology(triangles, counted, threads))


class Sizes(NamedTuple):
    """Sizes of connected components.

    Attributes
    ----------
    volumes : ndarray of float64, shape (count,)
        Signed volumes, measured from `outermost[:, 0]`, which keeps the precision of small components.
    areas : ndarray of float64, shape (count,)
        Areas.
    vectors : ndarray of float64, shape (count, 3)
        Vector areas; zero for closed components.
    outermost : ndarray of int32, shape (count, 6)
        First vertices farthest out along -x, -y, -z, x, y and z.
    flat : ndarray of int64, shape (count,)
        Triangles without area.
    """

    volumes: NDArray[np.float64]
    areas: NDArray[np.float64]
    vectors: NDArray[np.float64]
    outermost: NDArray[np.int32]
    flat: NDArray[np.int64]


def component_sizes(
    vertices: NDArray[np.float64],
    triangles: NDArray[np.int32],
    labels: NDArray[np.int32],
    count: int,
    threads: int = 0,
) -> Sizes:
    """Sizes of connected components.

    Parameters
    ----------
    vertices : ndarray of float64, shape (n, 3)
        Vertices.
    triangles : ndarray of int32, shape (m, 3)
        Triangles.
    labels : ndarray of int32, shape (n,)
        Component of each vertex; -1 for unused vertices.
    count : int
        Number of components.
    threads : int, optional
        Threads; 0 for all cores.

    Returns
    -------
    Sizes
        Their sizes.
    """
    return Sizes(*_component_sizes(vertices, triangles, labels, count, threads))
