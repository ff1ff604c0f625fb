"""Disjoint sets as an array of parents: union by the smaller root, paths halved (Tarjan, van Leeuwen 1984).

Importing this module imports Numba.
"""

from __future__ import annotations

import numpy as np

from .compiled import compiled


@compiled
def find(parent, i):  # type: ignore[no-untyped-def]
    """The root of i."""
    while parent[i] != i:
        parent[i] = parent[parent[i]]
        i = parent[i]
    return i


@compiled
def unite(parent, a, b):  # type: ignore[no-untyped-def]
    """One set from two; the smaller root stays."""
    a, b = find(parent, a), find(parent, b)
    if a < b:
        parent[b] = a
    else:
        parent[a] = b


@compiled
def unite_all(parent, some, others):  # type: ignore[no-untyped-def]
    """The sets of each pair become one."""
    for i in range(len(some)):
        unite(parent, some[i], others[i])


@compiled
def roots(parent):  # type: ignore[no-untyped-def]
    """The root of each."""
    root = np.empty_like(parent)
    for i in range(len(parent)):
        root[i] = find(parent, i)
    return root
