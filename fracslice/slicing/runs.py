"""Layers as runs of pixels: connected components and overlaps, in time linear in the outline."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..common.compiled import compiled
from ..common.disjoint import grouped
from ..common.rows import Rows


@dataclass(frozen=True, eq=False)
class Runs:
    """Solid pixels of a layer.

    Attributes
    ----------
    rows : int32 [ny + 1]
        Row y has the runs ``rows[y]:rows[y + 1]``.
    begin, end : int32 [r]
        Pixels of each run, end excluded.
    width : int
        Pixels in a row.
    """

    rows: np.ndarray
    begin: np.ndarray
    end: np.ndarray
    width: int

    @property
    def height(self) -> int:
        """Number of rows."""
        return len(self.rows) - 1

    @property
    def none(self) -> Runs:
        """No pixels, in the same window."""
        return Runs(np.zeros_like(self.rows), self.begin[:0], self.end[:0], self.width)

    @property
    def gaps(self) -> Runs:
        """Runs of the empty pixels."""
        rows = np.zeros(len(self.rows), np.int32)
        begin, end = (np.empty(len(self.begin) + self.height, np.int32) for _ in range(2))
        count = _gaps(self.rows, self.begin, self.end, self.width, rows, begin, end)
        return Runs(rows, begin[:count], end[:count], self.width)


@dataclass(frozen=True, eq=False)
class Nodes(Rows):
    """Connected components as nodes of a graph.

    Attributes
    ----------
    area : int64 [n]
        Area, pixels.
    middle : float64 [n, 2]
        Centroid (x, y), pixels.
    open : bool [n]
        True if it reaches the border of the window.
    """

    area: np.ndarray
    middle: np.ndarray
    open: np.ndarray


@dataclass(frozen=True, eq=False)
class LayerComponents:
    """Connected components of one layer, solid or empty.

    Attributes
    ----------
    runs : Runs
        Pixels of the layer.
    label : int64 [r]
        Component of each run.
    nodes : Nodes
        The components.
    """

    runs: Runs
    label: np.ndarray
    nodes: Nodes

    def __len__(self) -> int:
        return len(self.nodes.area)


def layer_components(solid: Runs) -> tuple[LayerComponents, LayerComponents]:
    """Label the components of a layer: solid ones 8-connected, empty ones 4-connected.

    Parameters
    ----------
    solid : Runs
        The solid pixels.

    Returns
    -------
    solid, empty : LayerComponents
        The components.
    """
    return _labelled(solid, 1), _labelled(solid.gaps, 0)


def _labelled(runs: Runs, reach: int) -> LayerComponents:
    """Label runs that overlap, or at `reach` 1 touch at a corner."""
    rows, begin, end = runs.rows, runs.begin, runs.end
    pairs = _touching(rows[:-1], begin, end, rows[1:], begin, end, reach)
    label, count = grouped(len(begin), *pairs)
    row = np.repeat(np.arange(runs.height), np.diff(rows))
    length = end - begin
    area = np.bincount(label, length, count).astype(np.int64)
    x, y = (np.bincount(label, length * at, count) for at in ((begin + end) / 2, row + 0.5))
    rim = (begin == 0) | (end == runs.width) | (row == 0) | (row == runs.height - 1)
    opened = np.zeros(count, bool)
    opened[label[rim]] = True
    middle = np.stack([x, y], 1) / np.maximum(area, 1)[:, None]
    return LayerComponents(runs, label, Nodes(area, middle, opened))


@compiled
def _gaps(rows, begin, end, nx, gaps, gap_begin, gap_end):  # type: ignore[no-untyped-def]
    """Write the runs between runs; return their number."""
    n = 0
    for y in range(len(rows) - 1):
        x = 0
        for r in range(rows[y], rows[y + 1]):
            if begin[r] > x:
                gap_begin[n], gap_end[n] = x, begin[r]
                n += 1
            x = end[r]
        if x < nx:
            gap_begin[n], gap_end[n] = x, nx
            n += 1
        gaps[y + 1] = n
    return n


def overlaps(below: LayerComponents, above: LayerComponents) -> np.ndarray:
    """Pairs of components of two layers that share a pixel.

    Returns
    -------
    int64 [n, 2]
        Unique pairs (below, above), sorted.
    """
    a, b = below.runs, above.runs
    some, others = _touching(a.rows, a.begin, a.end, b.rows, b.begin, b.end, 0)
    # Sorting numbers is several times faster than sorting rows.
    numbers = np.unique(below.label[some] * len(above) + above.label[others])
    return np.column_stack(np.divmod(numbers, max(len(above), 1)))


@compiled
def _touching(rows_a, begin_a, end_a, rows_b, begin_b, end_b, reach):  # type: ignore[no-untyped-def]
    """Runs of corresponding rows that overlap, or at `reach` 1 touch: their numbers, int64 [n] each."""
    some, others = np.empty((2, len(begin_a) + len(begin_b)), np.int64)
    n = 0
    for y in range(len(rows_a) - 1):
        a, b = rows_a[y], rows_b[y]
        while a < rows_a[y + 1] and b < rows_b[y + 1]:
            if begin_a[a] < end_b[b] + reach and begin_b[b] < end_a[a] + reach:
                some[n], others[n] = a, b
                n += 1
            if end_a[a] < end_b[b]:
                a += 1
            else:
                b += 1
    return some[:n], others[:n]
