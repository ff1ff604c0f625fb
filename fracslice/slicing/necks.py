"""Necks: cross-sections that are small for what they carry, down to the contact with the plate.

A layer is peeled from the film of the resin by a force that grows with its area; every layer below has to
bear it. All parts of an object above a layer hang on those components of the layer that they touch, so each
connected component of the layers above is compared with its contact, from the top layer down (a merge tree,
Carr, Snoeyink and Axen 2003).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..common.compiled import compiled
from ..common.disjoint import find
from .feature_graph import Graph

FOOT = 1.0
"""Cross-section from which a component must stand firmly on the plate, mm^2: else the film peels it off."""

FAINT = 0.5
"""Area of a node without a whole pixel, such as a tip on the plate, pixels."""


@dataclass(frozen=True)
class Neck:
    """The weakest cross-section of an object.

    Attributes
    ----------
    layer : int
        Its layer; 0 is the contact with the plate.
    area : float
        Its area, mm^2.
    carried : float
        Largest cross-section of one component above it, mm^2.
    at : tuple of float
        Centroid of its largest component, mm from the middle of the object.
    """

    layer: int
    area: float
    carried: float
    at: tuple[float, float]

    @property
    def ratio(self) -> float:
        """Carried area per area of the neck."""
        return self.carried / self.area


def weakest(
    graph: Graph, pixel: tuple[float, float], shape: tuple[int, int], least: float, speck: float
) -> Neck | None:
    """Find the cross-section that is smallest for the component of the object that it carries.

    Components that begin in the air carry nothing, and are islands; one that begins as a speck is a tip.

    Parameters
    ----------
    graph : Graph
        Solid components of all layers.
    pixel : tuple of float
        Width and height of a pixel, mm.
    shape : tuple of int
        Rows and columns of a layer.
    least : float
        Components whose cross-sections are all smaller are not considered, mm^2; on the plate, `FOOT`.
    speck : float
        Area of an island that is reported as one, mm^2.

    Returns
    -------
    Neck or None
        None if no component is as large.
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
    firm = np.where(_held(edges, np.append(np.arange(feet), tips), len(area)), area, 0)
    contact, carried, cut, node = _weakest(
        area, firm, edges, starts, min(FOOT, least) / square, least / square
    )
    if node < 0:
        return None
    x, y = (nodes.middle[max(node - feet, 0) if cut else node] - np.array(shape[::-1]) / 2) * pixel
    return Neck(max(int(cut) - 1, 0), float(contact) * square, float(carried) * square, (float(x), float(y)))


@compiled
def _held(edges, roots, count):  # type: ignore[no-untyped-def]
    """True for nodes that grow from some nodes."""
    held = np.zeros(count, np.bool_)
    held[roots] = True
    for below, above in edges:
        held[above] |= held[below]
    return held


@compiled
def _weakest(area, firm, edges, starts, foot, least):  # type: ignore[no-untyped-def]
    """Contact area, carried area, cut and largest node of the weakest cross-section; node -1 if none.

    area, firm: of nodes, and 0 for islands. foot, least: carried areas that count on the plate, and above it.
    edges: pairs (below, above), those of cut k from `starts[k]` to `starts[k + 1]`.
    """
    parent, largest = np.arange(len(area)), area.copy()
    contact, widest = np.zeros(len(area)), np.full(len(area), -1)
    ratio, result = 0.0, (0.0, 0.0, 0, -1)
    for cut in range(len(starts) - 2, -1, -1):
        cut_edges, seen = edges[starts[cut] : starts[cut + 1]], {(-1, -1)}
        for node, above in cut_edges:
            root = find(parent, above)
            if (node, root) not in seen:  # a node may touch a component several times
                seen.add((node, root))
                contact[root] += firm[node]
                if widest[root] < 0 or firm[node] > firm[widest[root]]:
                    widest[root] = node
        for _, above in cut_edges:
            root = find(parent, above)
            if (
                contact[root]
                and largest[root] >= (least if cut else foot)
                and largest[root] >= ratio * contact[root]
            ):
                ratio = largest[root] / contact[root]
                result = (contact[root], largest[root], cut, widest[root])
        for _, above in cut_edges:
            contact[find(parent, above)], widest[find(parent, above)] = 0, -1
        for node, above in cut_edges:
            a, b = find(parent, node), find(parent, above)
            low, high = min(a, b), max(a, b)
            largest[low] = max(largest[low], largest[high])
            parent[high] = low
    return result
