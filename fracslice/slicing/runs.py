"""Layers as runs of pixels: connected components, overlaps, thickness of walls and width of gaps, in time
linear in the outline.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from .. import _slices
from .._slices import count_pixels, distances, narrow_pixels, painted
from ..common.arrays import Rows
from ..printing.walls import BINS


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


WIDE = float(BINS[-1])
"""mm; in layers with many pixels, greater widths are measured on coarser pixels."""

COARSE, LAYER = 4, 512
"""Minimum numbers of coarse pixels across `WIDE`, and along the layer."""

WINDOW = 1024
"""Approximate size of the windows that are measured at a time, without their halo, pixels."""

AROUND = 3
"""Halo in pixels, besides half of `WIDE`: wider than the stencil of a distance's slope."""

Pair = tuple[float, float]
Window = tuple[slice, slice]


def widths(solid: Runs, pixel: Pair) -> tuple[np.ndarray, np.ndarray]:
    """Measure walls and gaps on their medial axes.

    A width is twice the distance to the outline where that distance has no slope (Blum 1967, "A
    transformation for extracting new descriptors of shape"). Axes into right-angled corners are excluded:
    their slope is 0.7, and in the last pixel of a corner the distance is lower than beside it. The outline
    lies at half coverage, so widths are accurate to one pixel. In large layers, widths above `WIDE` are
    accurate to one coarse pixel: time and memory follow the outline, not the area.

    `solid`: solid pixels of a layer; `pixel`: width and height of a pixel, mm. Returns walls, gaps float64
    [n, 2], widths in mm, and the number of pixels of the medial axis at each.
    """
    if not len(solid.begin):
        return np.empty((0, 2)), np.empty((0, 2))
    times = max(int(min(WIDE / COARSE / max(pixel), max(solid.height, solid.width) / LAYER)), 1)
    count = count_pixels(solid, times)
    return _measure_widths(solid, count, times, pixel, False), _measure_widths(
        solid, count, times, pixel, True
    )


def _measure_widths(solid: Runs, count: np.ndarray, times: int, pixel: Pair, gaps: bool) -> np.ndarray:
    """Widths of walls or gaps. count: solid pixels in each coarse one, which is `times` pixels across."""
    coarse, narrow = (pixel[0] * times, pixel[1] * times), np.zeros(count.shape, np.bool_)
    if times > 1:
        # Whatever the tilt of a wall, a row or a column through it is at most this long.
        x, y = np.ceil(2**0.5 * WIDE / np.array(pixel)).astype(np.int64).tolist()
        narrow = narrow_pixels(solid, gaps, times, (x, y))
    width, middle = _across((2 * np.pad(count, 2) >= times**2) != gaps, coarse)
    far = width[2:-2, 2:-2][middle[2:-2, 2:-2] & ~narrow]
    result = [np.column_stack([far, np.full(len(far), times)])]
    halo = int(np.ceil(WIDE / 2 / min(pixel))) + AROUND
    for rows, columns in _windows(narrow, max(WINDOW // times, 1)):
        chosen = narrow[rows, columns].repeat(times, 0).repeat(times, 1)
        at = times * rows.start - halo, times * columns.start - halo
        image = painted(solid, at, (chosen.shape[0] + 2 * halo, chosen.shape[1] + 2 * halo))
        width, middle = _across(image != gaps, pixel)
        near = width[halo:-halo, halo:-halo][middle[halo:-halo, halo:-halo] & chosen]
        result.append(np.column_stack([near, np.ones(len(near))]))
    return np.concatenate(result)


def _windows(chosen: np.ndarray, side: int) -> Iterator[Window]:
    """Windows of an image, at most `side` pixels along a side, that contain all chosen pixels."""
    for y in range(0, chosen.shape[0], side):
        for x in range(0, chosen.shape[1], side):
            rows, columns = np.nonzero(chosen[y : y + side, x : x + side])
            if len(rows):
                low, high = (y + int(rows[0]), x + int(columns.min())), (int(rows[-1]), int(columns.max()))
                yield slice(low[0], y + high[0] + 1), slice(low[1], x + high[1] + 1)


def _across(region: np.ndarray, pixel: Pair) -> tuple[np.ndarray, np.ndarray]:
    """Width of a region at each pixel of its medial axis, and a mask of these pixels."""
    if region.all():
        return np.zeros(region.shape), np.zeros(region.shape, bool)
    unit = min(pixel)
    # The centre of the nearest pixel is half a pixel beyond the outline.
    distance = np.maximum(distances(region, pixel) - unit / 2, 0)
    slope = np.hypot(*np.gradient(distance, *pixel[::-1]))
    middle = (slope < 0.6) & region & (distance > _largest_near(distance) - 0.4 * unit)
    # Where two pixels are next to the axis, the axis lies between them.
    return 2 * distance + unit * (slope > 0.25), middle


def _largest_near(image: np.ndarray) -> np.ndarray:
    """Maximum of each pixel and the eight around it."""
    padded = np.pad(image, 1, mode="edge")
    rows = np.maximum(np.maximum(padded[:-2], padded[1:-1]), padded[2:])
    return np.asarray(np.maximum(np.maximum(rows[:, :-2], rows[:, 1:-1]), rows[:, 2:]))
