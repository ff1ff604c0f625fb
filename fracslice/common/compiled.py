"""Loops over arrays, compiled by Numba; disjoint sets among them.

Importing this module imports Numba.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numba
import numpy as np

from .cache import PACKAGE, Kept, cache_folder, texts

CONFIG: Any = numba.config


def compiled(function: Callable[..., Any]) -> Any:
    """Compile a function with Numba at its first call; it runs without the GIL.

    Machine code is cached in the folder of the kernels unless other users can write there: Numba would load
    any file.
    """
    folder = _folder()
    if folder is None:
        return numba.njit(nogil=True)(function)
    before, CONFIG.CACHE_DIR = CONFIG.CACHE_DIR, str(folder)
    try:
        return numba.njit(nogil=True, cache=True)(function)
    finally:
        CONFIG.CACHE_DIR = before


@cache
def _folder() -> Path | None:
    """Cache folder of all compiled loops, keyed by their joint text: they call each other, and Numba checks
    only the file of the function itself. None if the folder cannot be trusted.
    """
    own = [path for path in sorted(PACKAGE.rglob("*.py")) if b"@compiled\n" in path.read_bytes()]
    return Kept(cache_folder() / "loops" / texts(*own)).place()


@compiled
def find(parent, i):  # type: ignore[no-untyped-def]
    """Return the root of element i; halve its path.

    `parent`: int [n]; `i`: element index.
    """
    while parent[i] != i:
        parent[i] = parent[parent[i]]
        i = parent[i]
    return i


@compiled
def unite(parent, a, b):  # type: ignore[no-untyped-def]
    """Merge the sets of a and b; the smaller root remains.

    `parent`: int [n]; `a`, `b`: element indices.
    """
    a, b = find(parent, a), find(parent, b)
    if a < b:
        parent[b] = a
    else:
        parent[a] = b


@compiled
def unite_all(parent, some, others):  # type: ignore[no-untyped-def]
    """Merge the sets of each pair.

    `parent`: int [n]; `some`, `others`: int [k] each.
    """
    for i in range(len(some)):
        unite(parent, some[i], others[i])


@compiled
def number_sets(parent):  # type: ignore[no-untyped-def]
    """Replace each parent by the number of its set, from 0 in the order of the smallest elements.

    `parent`: int [n].
    """
    count = 0
    for i in range(len(parent)):  # a parent is a smaller element, which already has its number
        if parent[i] == i:
            parent[i] = count
            count += 1
        else:
            parent[i] = parent[parent[i]]
    return count


def connected_components(count: int, some: np.ndarray, others: np.ndarray) -> tuple[np.ndarray, int]:
    """Number the connected components of a graph.

    `some`, `others`: int [k] each.
    """
    parent = np.arange(count)
    unite_all(parent, some, others)
    components = number_sets(parent)
    return parent, components
