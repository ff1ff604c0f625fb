"""Components of all layers, as runs of pixels, and their overlaps: islands, bodies, cups, traps,
cavities, necks and overhangs; thickness of walls and width of gaps.

On a masked printer the object hangs from the plate, its first layer uppermost, and grows downwards into the
resin. A hollow without a way out through the layers printed so far is a suction cup, which sucks at the film.
One without a way out through the layers that follow is a resin trap, which keeps its resin when it is lifted.
One without any way out is a cavity.

A layer is peeled from the film of the resin by a force that grows with its area; every layer below has to
bear it. All parts of an object above a layer hang on those components of the layer that they touch, so each
connected component of the layers above is compared with its contact, from the top layer down (a merge tree,
Carr, Snoeyink and Axen 2003).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np

from .. import _slices
from .._native import graph_components
from .._slices import count_pixels, distances, narrow_pixels, painted
from ..common.arrays import Rows
from ..common.messages import format_count
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

    def __or__(self, other: Runs) -> Runs:
        """Pixels of either of two layers."""
        if not len(self.begin) or not len(other.begin):
            return other if not len(self.begin) else self
        step, rows = self.width + 1, np.arange(self.height)  # no run of a row touches one of the next row
        starts = [step * np.repeat(rows, np.diff(runs.rows)) for runs in (self, other)]
        first = np.concatenate([starts[0] + self.begin, starts[1] + other.begin])
        last = np.concatenate([starts[0] + self.end, starts[1] + other.end])
        order = np.argsort(first, kind="stable")
        first, last = first[order], np.maximum.accumulate(last[order])
        begins = np.flatnonzero(np.r_[True, first[1:] > last[:-1]])
        row, begin = np.divmod(first[begins], step)
        end = last[np.r_[begins[1:], len(first)] - 1] - step * row
        limits = np.searchsorted(row, np.arange(self.height + 1))
        kind = self.rows.dtype
        return Runs(limits.astype(kind), begin.astype(kind), end.astype(kind), self.width)

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


@dataclass(frozen=True)
class Feature:
    """A feature found by a check."""

    layers: tuple[int, int]  # first and last layer
    area: float  # maximum area in a layer, mm^2
    volume: float  # volume, mm^3
    at: tuple[float, float]  # centroid in its first layer, mm from the middle of the object


MARKS = {
    "island": (214, 60, 60),
    "suction cup": (220, 60, 170),
    "resin trap": (110, 60, 190),
    "sealed cavity": (20, 150, 90),
}
"""Colours of the boxes around features, by their kind, sRGB."""


class FeatureBox(NamedTuple):
    """A box around a feature of a kind of `MARKS`, for pictures; mm from the middle of the lower face."""

    kind: str
    low: tuple[float, float, float]
    high: tuple[float, float, float]

    @classmethod
    def around(cls, kind: str, feature: Feature, tops: np.ndarray) -> FeatureBox:
        """Box as wide as the largest area of a feature. `tops`: upper faces of all layers, mm, [l]."""
        (x, y), half, (first, last) = feature.at, math.sqrt(feature.area) / 2, feature.layers
        bottom = float(tops[first - 1]) if first else 0.0
        return cls(kind, (x - half, y - half, bottom), (x + half, y + half, float(tops[last])))


def counted(marks: Sequence[FeatureBox]) -> dict[str, str]:
    """How many boxes of each kind there are, as text."""
    number = {kind: sum(mark.kind == kind for mark in marks) for kind in MARKS}
    plurals = {"sealed cavity": "sealed cavities"}
    return {kind: format_count(n, kind, plurals.get(kind, "")) for kind, n in number.items() if n}


@dataclass(eq=False)
class Graph:
    """Components of layers as nodes, overlaps as edges. Layers are added in order."""

    layers: list[Nodes] = field(default_factory=list)  # nodes of each layer
    # overlapping nodes of successive layers, int64 [n, 2] each
    pairs: list[np.ndarray] = field(default_factory=list)
    last: LayerComponents | None = None  # components of the last layer
    count: int = 0  # number of nodes

    def add(self, components: LayerComponents) -> None:
        """Add the components of the next layer."""
        if self.last is not None:
            first = np.array([self.count - len(self.last), self.count])
            self.pairs.append(overlaps(self.last, components) + first)
        self.layers.append(components.nodes)
        self.last = components
        self.count += len(components)

    @cached_property
    def nodes(self) -> Nodes:
        """Nodes of all layers; no layer may be added after the first access, nor to those below."""
        return Nodes.joined(self.layers)

    @cached_property
    def layer(self) -> np.ndarray:
        """Layer of each node, int64 [n]."""
        return np.repeat(np.arange(len(self.layers)), [len(nodes.area) for nodes in self.layers])

    @cached_property
    def edges(self) -> np.ndarray:
        """Pairs of overlapping nodes (below, above), sorted by layer, int64 [e, 2]."""
        return np.concatenate([np.empty((0, 2), np.int64), *self.pairs])

    def islands(self) -> np.ndarray:
        """Nodes with nothing below them. The first layer lies on the plate.

        Returns bool [n].
        """
        held = self.layer == 0
        held[self.edges[:, 1]] = True
        return np.asarray(~held)

    def shut(self, backwards: bool) -> np.ndarray:
        """Empty nodes without a way out through the layers up to their own.

        The plate closes the first layer. Looking backwards, nodes that reach the last layer are open.

        Returns bool [n].
        """
        sign = -1 if backwards else 1
        free = self.nodes.open | (backwards & (self.layer == self.layer.max(initial=0)))
        later = np.max(sign * self.layer[self.edges], axis=1)
        order = np.argsort(later, kind="stable")
        return _slices.closed_nodes(self.edges[order], later[order], sign * self.layer, free)

    def sealed(self) -> np.ndarray:
        """Empty nodes without any way out, not even to the plate.

        Returns bool [n].
        """
        body, count = graph_components(self.count, *self.edges.T)
        free = np.zeros(count, bool)
        free[body[self.nodes.open | (self.layer == 0) | (self.layer == self.layer.max(initial=0))]] = True
        return np.asarray(~free[body])

    def groups(
        self, chosen: np.ndarray, heights: np.ndarray, pixel: tuple[float, float], shape: tuple[int, int]
    ) -> list[Feature]:
        """Group chosen nodes into connected components.

        `chosen`: bool [n]; `heights`: float64 [l], mm; `pixel`: width and height of a pixel, mm.
        """
        number, _ = graph_components(self.count, *self.edges[chosen[self.edges].all(1)].T)
        nodes = np.flatnonzero(chosen)
        names, lowest, group = np.unique(number[nodes], return_index=True, return_inverse=True)
        square = pixel[0] * pixel[1]
        volume = np.bincount(group, self.nodes.area[nodes] * heights[self.layer[nodes]] * square, len(names))
        area, first, last = np.zeros(len(names)), np.full(len(names), 1 << 30), np.zeros(len(names), np.int64)
        np.maximum.at(area, group, self.nodes.area[nodes] * square)
        np.minimum.at(first, group, self.layer[nodes])
        np.maximum.at(last, group, self.layer[nodes])
        at = (self.nodes.middle[nodes[lowest]] - np.array(shape[::-1]) / 2) * pixel
        order = np.argsort(-volume, kind="stable")
        return [
            Feature(
                (int(first[i]), int(last[i])),
                float(area[i]),
                float(volume[i]),
                (float(at[i, 0]), float(at[i, 1])),
            )
            for i in order
        ]


FOOT = 1.0
"""Cross-section from which a component must stand firmly on the plate, mm^2: else the film peels it off."""

FAINT = 0.5
"""Area of a node without a whole pixel, such as a tip on the plate, pixels."""


@dataclass(frozen=True)
class Neck:
    """The weakest cross-section of an object."""

    layer: int  # its layer; 0 is the contact with the plate
    area: float  # its area, mm^2
    carried: float  # largest cross-section of one component above it, mm^2
    at: tuple[float, float]  # centroid of its largest component, mm from the middle of the object

    @property
    def ratio(self) -> float:
        """Carried area per area of the neck."""
        return self.carried / self.area


def weakest(
    graph: Graph, pixel: tuple[float, float], shape: tuple[int, int], least: float, speck: float
) -> Neck | None:
    """Find the cross-section that is smallest for the component of the object that it carries.

    Components that begin in the air carry nothing, and are islands; one that begins as a speck is a tip.

    `pixel`: width and height of a pixel, mm; `least`, `speck`: mm^2.
    """
    if not graph.count:
        return None
    square, nodes = pixel[0] * pixel[1], graph.nodes
    # The plate holds the first layer that is not empty as a layer with the same components below it would.
    feet = next(len(layer.area) for layer in graph.layers if len(layer.area))
    size = np.maximum(nodes.area, FAINT)
    area = np.concatenate([size[:feet], size])
    edges = np.concatenate([np.arange(feet)[:, None] + [0, feet], graph.edges + feet])
    below = np.concatenate([np.zeros(feet, np.int64), 1 + graph.layer[graph.edges[:, 0]]])
    starts = np.searchsorted(below, np.arange(len(graph.layers) + 1))
    tips = feet + np.flatnonzero(graph.islands() & (size * square < speck))
    firm = np.where(_slices.held_nodes(edges, np.append(np.arange(feet), tips), len(area)), area, 0)
    contact, carried, cut, node = _slices.weakest_cut(
        area, firm, edges, starts, min(FOOT, least) / square, least / square
    )
    if node < 0:
        return None
    x, y = (nodes.middle[max(node - feet, 0) if cut else node] - np.array(shape[::-1]) / 2) * pixel
    return Neck(max(int(cut) - 1, 0), float(contact) * square, float(carried) * square, (float(x), float(y)))


COARSE_OVERHANG = 8
"""Coarse pixels along the longest allowed overhang, on which most layers are seen to have none."""

FINEST = 1024
"""Pixels along the longer side of the picture on which a large overhang is measured."""

DIRECTIONS = ((0, 1), (1, 0), (1, 1), (1, -1))
"""Steps along rows, columns and both diagonals, pixels."""


@dataclass(frozen=True)
class Overhang:
    """The farthest overhang of a layer."""

    layer: int  # its layer
    reach: float  # largest distance from the supported part of the layer, mm
    area: float  # area of the layer that reaches too far, mm^2
    at: tuple[float, float]  # its farthest point, mm from the middle of the object


def unsupported_pixels(below: Runs, above: Runs, reach: float) -> Runs:
    """Pixels of a layer that nothing supports.

    `below`, `above`: solid pixels of the layers; `reach`: pixels within this distance of a solid pixel of
    the layer below are supported, pixels.
    """
    return Runs(*_slices.unsupported(below, above, reach), above.width)


def farthest(
    solid: Runs, bare: Runs, layer: int, pixel: tuple[float, float], overhang: float, span: float
) -> Overhang | None:
    """Measure how far the unsupported pixels of a layer reach.

    A pixel on a straight line of solid pixels with support at both ends, a bridge, may be as long as `span`;
    any other, a cantilever, may reach `overhang` far. Components without any support are islands and not
    measured.

    `solid`, `bare`: solid pixels of the layer; `pixel`: width and height of a pixel, mm; `overhang`, `span`
    in mm.
    """
    coarse = max(int(overhang / COARSE_OVERHANG / max(pixel)), 1)
    fine = max(-(-max(solid.height, solid.width) // FINEST), 1)
    for times, slack in ((coarse, 2 * coarse * max(pixel)), (fine, 0.0)):
        far, away = _too_far(solid, bare, times, pixel, overhang - slack, span)
        if not far.any():
            return None
    step = np.array(pixel) * times
    y, x = np.unravel_index(np.argmax(np.where(far, away, 0)), far.shape)
    at = (np.array([x, y]) + 0.5) * step - np.array([solid.width, solid.height]) * pixel / 2
    return Overhang(layer, float(away[y, x]), float(far.sum() * step.prod()), (float(at[0]), float(at[1])))


def _too_far(
    solid: Runs, bare: Runs, times: int, pixel: tuple[float, float], overhang: float, span: float
) -> tuple[np.ndarray, np.ndarray]:
    """Mask of pixels `times` as large that reach too far, and the distance of all from support, mm."""
    counts = [_slices.count_pixels(runs, times) for runs in (solid, bare)]
    full, held = counts[0] > 0, counts[0] > counts[1]
    step = times * pixel[0], times * pixel[1]
    away = _slices.distances(~held, step)
    far = full & (away > overhang)
    if far.any():
        far &= _slices.connected_to(full, held)
    for dy, dx in DIRECTIONS if far.any() else ():
        far &= ~(np.hypot(dy * step[1], dx * step[0]) * _slices.spans(full, held, (dy, dx)) <= span)
    return far, away
