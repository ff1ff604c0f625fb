"""The Jerusalem cube."""

from __future__ import annotations

import math

from ..common.parameters import Count
from .box import Box
from .registry import Fixed, Node, shape
from .vocabulary import absolute, maximum, minimum, orbit

CORNER = math.sqrt(2) - 1
"""Size of the cubes at the corners; that of the cubes at the edges is its square."""

Step = tuple[float, float, float]
"""Size of a cube in one before, and its centre: (a, a, b)."""


def paths(level: int) -> list[list[Step]]:
    """Steps from the whole to the cubes at one corner and on one edge, of every cube on the way."""
    if level < 1:
        return [[]]
    corner, edge = (CORNER, 1 - CORNER, 1 - CORNER), (CORNER**2, 1 - CORNER**2, 0.0)
    return [[corner, *rest] for rest in paths(level - 1)] + [[edge, *rest] for rest in paths(level - 2)]


@shape(level=Count(3, "how often every cube is replaced by 20", most=5))
def jerusalem(x, y, z, steps):  # type: ignore[no-untyped-def]
    """The Jerusalem cube in [-1, 1]^3 (Baird 2011): 8 cubes of size sqrt(2) - 1 at the corners, and 12 of its
    square on the edges, which are one level ahead.

    Space is folded into the part nearest to one corner and one edge; the smallest of the fields of both is
    taken in every step, so L = 1. Volume V(n) = 8 k^3 V(n - 1) + 12 k^6 V(n - 2), k = sqrt(2) - 1.
    """
    f = 1e9 + 0.0 * x
    for begins, factor, a, b, ends in steps:
        if begins:
            u, v, w, size = x, y, z, 1.0
        if factor < 1.0:
            u, v, w = absolute(u), absolute(v), absolute(w)
            low, high = minimum(u, v), maximum(u, v)
            u, v, w = maximum(high, w), maximum(low, minimum(high, w)), minimum(low, w)
            u, v, w = u - a * size, v - a * size, w - b * size
            size = factor * size
            orbit((u * u + v * v + w * w) / (size * size), u == u, u / size, v / size, w / size)
        if ends:
            f = minimum(f, maximum(absolute(u), maximum(absolute(v), absolute(w))) - size)
    return f


@jerusalem.arguments
def jerusalem_arguments(node: Node) -> dict[str, object]:
    rows = []
    for path in paths(node["level"]):
        steps = path or [(1.0, 0.0, 0.0)]
        rows += [(k == 0, *step, k == len(steps) - 1) for k, step in enumerate(steps)]
    return {"steps": Fixed(tuple(rows))}


@jerusalem.bounds
def jerusalem_bounds(node: Node) -> Box:
    return Box.centred(1.0)


@jerusalem.visible
def jerusalem_visible(node: Node, voxel: float) -> Node:
    """The cube of the deepest level whose smallest cubes are wider than a voxel."""
    deepest = max(math.floor(math.log(2.0 / voxel, 1.0 / CORNER) + 1e-6) - 1, 0)
    return node if node["level"] <= deepest else node.changed(level=deepest)
