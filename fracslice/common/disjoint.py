"""Disjoint sets as an array of parents: union by the smaller root, path halving (Tarjan, van Leeuwen 1984).

Importing this module imports Numba.
"""

from __future__ import annotations

import numpy as np

from .compiled import compiled


@compiled
def find(parent, i):  # type: ignore[no-untyped-def]
    """Return the root of element i; halve its path.

    Parameters
    ----------
    parent
        Parent of each element, int [n]; modified in place.
    i
        Element index.

    Returns
    -------
    int
        Root of the set of i.
    """
    while parent[i] != i:
        parent[i] = parent[parent[i]]
        i = parent[i]
    return i


@compiled
def unite(parent, a, b):  # type: ignore[no-untyped-def]
    """Merge the sets of a and b; the smaller root remains.

    Parameters
    ----------
    parent
        Parent of each element, int [n]; modified in place.
    a, b
        Element indices.
    """
    a, b = find(parent, a), find(parent, b)
    if a < b:
        parent[b] = a
    else:
        parent[a] = b


@compiled
def unite_all(parent, some, others):  # type: ignore[no-untyped-def]
    """Merge the sets of each pair.

    Parameters
    ----------
    parent
        Parent of each element, int [n]; modified in place.
    some, others
        Element indices of the pairs, int [k] each.
    """
    for i in range(len(some)):
        unite(parent, some[i], others[i])


@compiled
def numbered(parent):  # type: ignore[no-untyped-def]
    """Replace each parent by the number of its set, from 0 in the order of the smallest elements.

    Parameters
    ----------
    parent
        Parent of each element, int [n]; modified in place.

    Returns
    -------
    int
        Number of sets.
    """
    count = 0
    for i in range(len(parent)):  # a parent is a smaller element, which already has its number
        if parent[i] == i:
            parent[i] = count
            count += 1
        else:
            parent[i] = parent[parent[i]]
    return count


def grouped(count: int, some: np.ndarray, others: np.ndarray) -> tuple[np.ndarray, int]:
    """Number the connected components of a graph.

    Parameters
    ----------
    count
        Number of nodes.
    some, others
        Nodes at the ends of the edges, int [k] each.

    Returns
    -------
    numbers : ndarray of int64 [n]
        Component of each node, from 0 in the order of their smallest nodes.
    components : int
        Number of components.
    """
    parent = np.arange(count)
    unite_all(parent, some, others)
    components = numbered(parent)
    return parent, components
