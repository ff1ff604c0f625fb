"""Layers as runs of pixels: connected components and overlaps, in time linear in the outline."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .. import _slices
from ..common.arrays import Rows


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
        return Runs(*_slices.gaps(self), self.width)


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
    label, *nodes = _slices.components(runs, reach)
    return LayerComponents(runs, label, Nodes(*nodes))


def overlaps(below: LayerComponents, above: LayerComponents) -> np.ndarray:
    """Pairs of components of two layers that share a pixel.

    Returns int64 [n, 2].
    """
    return _slices.overlaps(below.runs, below.label, above.runs, above.label)
