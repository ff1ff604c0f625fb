"""Search for the crossings of grid edges on a GPU: edges go there, roots and normals come back."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, cast

import numpy as np

from .._native import Cells
from ..expr.cuda_driver import device_array, pinned_array, require, to_device
from ..expr.graph import NOTHING
from ..fields.cuda import CudaFunction, CudaLoop, load_functions
from .roots import SURE, Roots, collect, lay, start

MOST_EDGES = 1 << 21
"""Grid edges of one round, which take 300 MB of GPU memory; a batch of a mesh on 16 cores has fewer."""


class Table:
    """Rows in GPU memory for the edges of one round. Slicing takes longer than launching: it happens once.

    `whole`: [count, MOST_EDGES].
    """

    def __init__(self, count: int, dtype: np.typing.DTypeLike) -> None:
        self.whole = device_array((count, MOST_EDGES), dtype)
        self.rows = [self.whole[k] for k in range(count)]


@dataclass(frozen=True, eq=False)
class Find:
    """Loop `find` of one precision."""

    launch: Any  # function that launches it, and its FRAME
    frame: Any
    segments: Table  # what it reads and writes
    roots: Any
    start: CudaFunction  # loops that start `polish` from its roots, and collect the results of that
    collect: CudaFunction


class CudaSearch:
    """Search of `crossings.Refiner` on a GPU, with a thread per edge.

    `fast`, `exact`: in float32 and float64; `origin`, `voxel` in scene units.
    """

    def __init__(
        self, fast: Roots, exact: Roots, cells: Cells, origin: tuple[float, float, float], voxel: float
    ) -> None:
        require()
        self._cells, self._placement = cells, (*origin, voxel)
        self._lay = load_functions(NOTHING, "float64", (lay,))["lay"]
        self._edges = device_array((MOST_EDGES, 4), np.int16)
        self._fast, self._exact = (
            Find(
                *self._loop(roots, "find"), Table(6, roots.dtype), self._row(roots.dtype),
                **load_functions(NOTHING, roots.precision, (start, collect)),
            )
            for roots in (fast, exact)
        )  # fmt: skip
        self._polish = self._loop(exact, "polish")
        self._roots, self._polished = self._row(np.float64), Table(4, np.float64)
        self._normals, self._unsure = Table(3, np.float32), self._row(np.uint8)
        self._memories = [(np.empty(0), np.empty((3, 0), np.float32))] * 2

    def _loop(self, roots: Roots, name: str) -> tuple[Any, Any]:
        """Function that launches a loop, and its FRAME."""
        return cast(CudaLoop, roots.runs[name]).launch, to_device(roots.frame)

    def _row(self, dtype: np.typing.DTypeLike) -> Any:
        return device_array(MOST_EDGES, dtype)

    def memory(self, size: int) -> tuple[np.ndarray, np.ndarray]:
        """See `Search.memory`. It alternates between two: the caller still reads the other."""
        self._memories.reverse()
        if size > len(self._memories[0][0]):
            of = pinned_array(size, np.float64), pinned_array((3, size), np.float32)
            self._memories[0] = of  # the GPU copies faster into page-locked memory
        return self._memories[0]

    def find(self, begin: int, end: int, t: np.ndarray, normals: np.ndarray) -> None:
        """See `Search.find`."""
        for first in range(begin, end, MOST_EDGES):
            last = min(first + MOST_EDGES, end)
            part = slice(first - begin, last - begin)
            self._round(self._cells.edges(first, last), t[part], normals[:, part])

    def _round(self, edges: np.ndarray, t: np.ndarray, normals: np.ndarray) -> None:
        """Find roots in float32 and polish them in float64; find them in float64 where that is not exact."""
        unsure = np.flatnonzero(self._searched(self._fast, edges, t, normals))
        if len(unsure):
            few = np.empty(len(unsure)), np.empty((3, len(unsure)), np.float32)
            self._searched(self._exact, edges[unsure], *few)
            for row, new in zip((t, *normals), (few[0], *few[1]), strict=True):
                row[unsure] = new

    def _searched(self, find: Find, edges: np.ndarray, t: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """Find and polish roots; return a mask of those that are not exact."""
        n, (polish, frame) = len(edges), self._polish
        segments, polished = self._exact.segments, self._polished
        self._edges[:n].copy_to_device(edges)
        rows = segments.whole, self._fast.segments.whole, MOST_EDGES
        self._lay.launch(n, self._edges, *self._placement, *rows, n)
        find.launch(n, find.frame, *find.segments.rows, find.roots)
        find.start.launch(n, find.roots, self._roots, n)
        polish(n, frame, *segments.rows, self._roots, *polished.rows)
        results = self._roots, polished.whole, self._normals.whole, self._unsure
        find.collect.launch(n, find.roots, *results, SURE, MOST_EDGES, n)
        for row, to in zip((self._roots, *self._normals.rows), (t, *normals), strict=True):
            row[:n].copy_to_host(to)
        flags: np.ndarray = self._unsure[:n].copy_to_host()
        return flags.view(np.bool_)  # NumPy finds flags twenty times faster than other numbers
