"""Layers as runs of pixels: connected components and overlaps, in time linear in the outline."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..common.arrays import Rows
from ..common.compiled import compiled, connected_components


@dataclass(frozen=True, eq=False)
class Runs:
    """Solid pixels of a layer."""

    rows: np.ndarray  # row y has the runs ``rows[y]:rows[y + 1]``
    begin: np.ndarray  # pixels of each run, end excluded
    end: np.ndarray
    width: int  # pixels in a row

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
    """Connected components as nodes of a graph."""

    area: np.ndarray  # area, pixels
    middle: np.ndarray  # centroid (x, y), pixels
    open: np.ndarray  # true if it reaches the border of the window


@dataclass(frozen=True, eq=False)
class LayerComponents:
    """Connected components of one layer, solid or empty."""

    runs: Runs  # pixels of the layer
    label: np.ndarray  # component of each run
    nodes: Nodes  # the components

    def __len__(self) -> int:
        return len(self.nodes.area)


def layer_components(solid: Runs) -> tuple[LayerComponents, LayerComponents]:
    """Label the components of a layer: solid ones 8-connected, empty ones 4-connected.

    `solid`: the solid pixels.
    """
    return _label_runs(solid, 1), _label_runs(solid.gaps, 0)


def _label_runs(runs: Runs, reach: int) -> LayerComponents:
    """Label runs that overlap, or at `reach` 1 touch at a corner."""
    rows, begin, end = runs.rows, runs.begin, runs.end
    pairs = _touching(rows[:-1], begin, end, rows[1:], begin, end, reach)
    label, count = connected_components(len(begin), *pairs)
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

    Returns int64 [n, 2].
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
