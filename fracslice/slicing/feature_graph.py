"""Islands, bodies, cups, traps and cavities: components of all layers and their overlaps, by union-find.

On a masked printer the object hangs from the plate, its first layer uppermost, and grows downwards into the
resin. A hollow without a way out through the layers printed so far is a suction cup, which sucks at the film.
One without a way out through the layers that follow is a resin trap, which keeps its resin when it is lifted.
One without any way out is a cavity.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from ..common.compiled import compiled
from ..common.disjoint import find, grouped, unite
from .runs import LayerComponents, Nodes, overlaps


@dataclass(frozen=True)
class Feature:
    """A feature found by a check.

    Attributes
    ----------
    layers : tuple of int
        First and last layer.
    area : float
        Maximum area in a layer, mm^2.
    volume : float
        Volume, mm^3.
    at : tuple of float
        Centroid in its first layer, mm from the middle of the object.
    """

    layers: tuple[int, int]
    area: float
    volume: float
    at: tuple[float, float]


@dataclass(eq=False)
class Graph:
    """Components of layers as nodes, overlaps as edges. Layers are added in order.

    Attributes
    ----------
    layers : list of Nodes
        Nodes of each layer.
    pairs : list of ndarray
        Overlapping nodes of successive layers, int64 [n, 2] each.
    last : LayerComponents or None
        Components of the last layer.
    count : int
        Number of nodes.
    """

    layers: list[Nodes] = field(default_factory=list)
    pairs: list[np.ndarray] = field(default_factory=list)
    last: LayerComponents | None = None
    count: int = 0

    def add(self, components: LayerComponents) -> None:
        """Add the components of the next layer.

        Parameters
        ----------
        components : LayerComponents
            Solid or empty components.
        """
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

        Returns
        -------
        bool [n]
            True for islands.
        """
        held = self.layer == 0
        held[self.edges[:, 1]] = True
        return np.asarray(~held)

    def shut(self, backwards: bool) -> np.ndarray:
        """Empty nodes without a way out through the layers up to their own.

        The plate closes the first layer. Looking backwards, nodes that reach the last layer are open.

        Parameters
        ----------
        backwards : bool
            Look at the layers from the node's own on instead.

        Returns
        -------
        bool [n]
            True for shut nodes.
        """
        sign = -1 if backwards else 1
        free = self.nodes.open | (backwards & (self.layer == self.layer.max(initial=0)))
        later = np.max(sign * self.layer[self.edges], axis=1)
        order = np.argsort(later, kind="stable")
        return np.asarray(_shut(self.edges[order], later[order], sign * self.layer, free))

    def sealed(self) -> np.ndarray:
        """Empty nodes without any way out, not even to the plate.

        Returns
        -------
        bool [n]
            True for sealed nodes.
        """
        body, count = grouped(self.count, *self.edges.T)
        free = np.zeros(count, bool)
        free[body[self.nodes.open | (self.layer == 0) | (self.layer == self.layer.max(initial=0))]] = True
        return np.asarray(~free[body])

    def groups(
        self, chosen: np.ndarray, heights: np.ndarray, pixel: tuple[float, float], shape: tuple[int, int]
    ) -> list[Feature]:
        """Group chosen nodes into connected components.

        Parameters
        ----------
        chosen : bool [n]
            Nodes.
        heights : float64 [l]
            Heights of the layers, mm.
        pixel : tuple of float
            Width and height of a pixel, mm.
        shape : tuple of int
            Rows and columns of a layer.

        Returns
        -------
        list of Feature
            The groups, by descending volume.
        """
        number, _ = grouped(self.count, *self.edges[chosen[self.edges].all(1)].T)
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


@compiled
def _shut(edges, later, layer, free):  # type: ignore[no-untyped-def]
    """True for nodes that are not connected to an open one once the edges up to their layer are added."""
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
