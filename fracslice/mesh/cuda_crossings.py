"""Search for the crossings of grid edges on a GPU: edges go there, roots and normals come back."""

from __future__ import annotations

from typing import Any, cast

import numpy as np

from .._native import Cells
from ..kernel.cuda_driver import require
from ..kernel.cuda_launching import CudaLoop, launched, load_loops
from ..kernel.linker import Linked
from .cuda_segment_loops import LOOPS
from .roots import MOST, SURE, Roots

MOST_EDGES = 1 << 20
"""Grid edges of one round, which take 140 MB of GPU memory."""


class CudaSearch:
    """Search of `crossings.Refiner` on a GPU, with a thread per edge.

    Parameters
    ----------
    fast, exact
        Loops of a field on the GPU, in float32 and float64.
    cells
        Grid cells with sign changes.
    origin, voxel
        First grid point and spacing, scene units.
    """

    def __init__(
        self, fast: Roots, exact: Roots, cells: Cells, origin: tuple[float, float, float], voxel: float
    ) -> None:
        self._cuda, self._cells, self._placement = require(), cells, (*origin, voxel)
        self._loops = load_loops(Linked("", np.zeros(1)), "float64", LOOPS)
        loops: list[tuple[Roots, str]] = [(fast, "find"), (exact, "find"), (exact, "polish")]
        self._find_fast, self._find, self._polish = (
            (cast(CudaLoop, roots.runs[name]).launch, self._cuda.to_device(roots.frame))
            for roots, name in loops
        )
        self._narrow, self._guesses = self._rows(6, np.float32), self._rows(1, np.float32)
        self._segments, self._found = self._rows(6, np.float64), self._rows(1, np.float64)
        self._roots, self._polished = self._rows(1, np.float64), self._rows(4, np.float64)
        self._normals, self._unsure = self._rows(3, np.float32), self._rows(1, np.uint8)
        self._memories = [(np.empty(0), np.empty((3, 0), np.float32))] * 2

    def _rows(self, count: int, dtype: type) -> Any:
        """Allocate GPU memory for the segments of one round, [count, MOST_EDGES]."""
        return self._cuda.device_array((count, MOST_EDGES), dtype)

    def memory(self, size: int) -> tuple[np.ndarray, np.ndarray]:
        """See `Search.memory`. It alternates between two: the caller still reads the other."""
        self._memories.reverse()
        if size > len(self._memories[0][0]):
            pinned = self._cuda.pinned_array  # the GPU copies faster into page-locked memory
            self._memories[0] = pinned(size, np.float64), pinned((3, size), np.float32)
        return self._memories[0]

    def find(self, begin: int, end: int, t: np.ndarray, normals: np.ndarray) -> None:
        """See `Search.find`."""
        for first in range(begin, end, MOST_EDGES):
            last = min(first + MOST_EDGES, end)
            part = slice(first - begin, last - begin)
            self._round(self._cells.edges(first, last), t[part], normals[:, part])

    def _round(self, edges: np.ndarray, t: np.ndarray, normals: np.ndarray) -> None:
        """Find roots in float32 and polish them in float64; find them in float64 where that is not exact."""
        unsure = np.flatnonzero(
            self._searched(self._find_fast, self._narrow, self._guesses, edges, t, normals)
        )
        if len(unsure):
            few = np.empty(len(unsure)), np.empty((3, len(unsure)), np.float32)
            self._searched(self._find, self._segments, self._found, edges[unsure], *few)
            for row, new in zip((t, *normals), (few[0], *few[1]), strict=True):
                row[unsure] = new

    def _searched(
        self,
        find: tuple[Any, Any],
        segments: Any,
        found: Any,
        edges: np.ndarray,
        t: np.ndarray,
        normals: np.ndarray,
    ) -> np.ndarray:
        """Find and polish roots; return flags of those that are not exact."""
        n, (run, frame), (polish, exact_frame) = len(edges), find, self._polish
        placed = self._cuda.to_device(edges)
        launched(self._loops.lay, n, placed, *self._placement, self._segments, self._narrow)
        run(n, frame, *segments, found[0], MOST)
        launched(self._loops.start, n, found[0], self._roots[0], n)
        polish(n, exact_frame, *self._segments, self._roots[0], *self._polished)
        results = self._roots[0], self._polished, SURE, self._normals, self._unsure[0]
        launched(self._loops.collect, n, found[0], *results, n)
        self._roots[0, :n].copy_to_host(t)
        for k in range(3):
            self._normals[k, :n].copy_to_host(normals[k])
        flags: np.ndarray = self._unsure[0, :n].copy_to_host()
        return flags
