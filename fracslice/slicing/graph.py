"""The parts of all layers and what lies over what: islands, bodies, cups, traps and cavities, by union and
find.

On a masked printer the object hangs from the plate, its first layer uppermost, and grows downwards into the
resin. So a hollow that has no way out through the layers printed so far is a cup that sucks at the film;
one that has none through the layers that follow keeps its resin when it is lifted; one that has none at all
is a cavity.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ..compiled import compiled
from ..disjoint import find, unite
from .runs import LayerComponents, overlaps


@dataclass(frozen=True)
class Found:
    """Something that a check found. layers: the first and last it is in. area: its largest in a layer,
    mm^2. volume: mm^3. at: the middle of its first layer's part, mm from the middle of the object.
    """

    layers: tuple[int, int]
    area: float
    volume: float
    at: tuple[float, float]


@dataclass(eq=False)
class Graph:
    """Parts as nodes, in the order of their layers. Fed one layer at a time."""

    layer: list[np.ndarray] = field(default_factory=list)
    area: list[np.ndarray] = field(default_factory=list)
    middle: list[np.ndarray] = field(default_factory=list)
    open: list[np.ndarray] = field(default_factory=list)
    edges: list[np.ndarray] = field(default_factory=list)
    last: LayerComponents | None = None
    count: int = 0

    def add(self, components: LayerComponents) -> None:
        """The parts of the next layer."""
        if self.last is not None:
            pairs = overlaps(self.last, components).astype(np.int64)
            self.edges.append(pairs + np.array([self.count - len(self.last), self.count]))
        self.layer.append(np.full(len(components), len(self.layer), np.int32))
        self.area.append(components.area)
        self.middle.append(components.middle)
        self.open.append(components.open)
        self.last = components
        self.count += len(components)

    def nodes(self) -> Nodes:
        """All that was fed, as arrays."""
        edges = np.concatenate([np.empty((0, 2), np.int64), *self.edges])
        layer, area, middle, free = (
            np.concatenate(a) for a in (self.layer, self.area, self.middle, self.open)
        )
        return Nodes(layer, area, middle, free, edges)


@dataclass(frozen=True, eq=False)
class Nodes:
    """layer int32 [n], area int64 [n] and middle float64 [n, 2] in pixels, open bool [n]; edges int64 [e,
    2], by layers.
    """

    layer: np.ndarray
    area: np.ndarray
    middle: np.ndarray
    open: np.ndarray
    edges: np.ndarray

    def bodies(self) -> np.ndarray:
        """The body of each node, numbered by first node, int64 [n]."""
        return _united(self.edges, len(self.layer))

    def islands(self) -> np.ndarray:
        """Which nodes have nothing below them, bool [n]; the first layer lies on the plate."""
        held = self.layer == 0
        held[self.edges[:, 1]] = True
        return np.asarray(~held)

    def shut(self, backwards: bool) -> np.ndarray:
        """Which empty nodes have no way out through the layers up to their own (or, backwards, from their
        own on).

        The plate shuts the first layer; what reaches the last one is open.
        """
        order = -1 if backwards else 1
        free = self.open | (backwards & (self.layer == self.layer.max(initial=0)))
        later = (
            np.maximum(*self.layer[self.edges].T) if not backwards else -np.minimum(*self.layer[self.edges].T)
        )
        edges = self.edges[np.argsort(later, kind="stable")]
        return np.asarray(_shut(edges, np.sort(later), order * self.layer, free))

    def sealed(self) -> np.ndarray:
        """Which empty nodes have no way out at all, not even to the plate's side."""
        body = self.bodies()
        free = np.zeros(len(body), bool)
        free[body[self.open | (self.layer == 0) | (self.layer == self.layer.max(initial=0))]] = True
        return np.asarray(~free[body])

    def grouped(
        self, chosen: np.ndarray, heights: np.ndarray, pixel: tuple[float, float], shape: tuple[int, int]
    ) -> list[Found]:
        """The chosen nodes as connected groups, the largest volume first. heights: of the layers, mm."""
        inner = self.edges[chosen[self.edges].all(1)]
        root = _united(inner, len(self.layer))
        nodes = np.flatnonzero(chosen)
        names, group = np.unique(root[nodes], return_inverse=True)
        square = pixel[0] * pixel[1]
        volume = np.bincount(group, self.area[nodes] * heights[self.layer[nodes]] * square, len(names))
        area, first, last = np.zeros(len(names)), np.full(len(names), 1 << 30), np.zeros(len(names), np.int64)
        np.maximum.at(area, group, self.area[nodes] * square)
        np.minimum.at(first, group, self.layer[nodes])
        np.maximum.at(last, group, self.layer[nodes])
        at = (self.middle[names] - np.array(shape[::-1]) / 2) * pixel
        order = np.argsort(-volume, kind="stable")
        return [
            Found(
                (int(first[i]), int(last[i])),
                float(area[i]),
                float(volume[i]),
                (float(at[i, 0]), float(at[i, 1])),
            )
            for i in order
        ]


def _united(edges: np.ndarray, count: int) -> np.ndarray:
    """The root of each node."""
    parent = np.arange(count)
    _unite_all(parent, edges)
    return parent


@compiled
def _unite_all(parent, edges):  # type: ignore[no-untyped-def]
    for a, b in edges:
        unite(parent, a, b)
    for i in range(len(parent)):
        parent[i] = find(parent, i)


@compiled
def _shut(edges, later, layer, free):  # type: ignore[no-untyped-def]
    """Adds the edges layer by layer; a node is judged when its layer is complete."""
    count = len(layer)
    root = np.arange(count + 1)
    order = np.argsort(layer, kind="mergesort")
    shut = np.zeros(count, np.bool_)
    for i in range(count):
        if free[i]:
            unite(root, i, count)
    e, i = 0, 0
    while i < count:
        now = layer[order[i]]
        while e < len(edges) and later[e] <= now:
            unite(root, edges[e, 0], edges[e, 1])
            e += 1
        outside = find(root, count)
        while i < count and layer[order[i]] == now:
            shut[order[i]] = find(root, order[i]) != outside
            i += 1
    return shut
