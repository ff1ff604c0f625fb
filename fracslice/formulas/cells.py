"""Cubes of which some of the 27 cells are kept, again and again."""

from __future__ import annotations

import math

from ..common.parameters import Count, Vector
from .box import Box
from .registry import Fixed, Node, shape
from .vocabulary import absolute, floor, maximum, minimum, orbit


@shape(
    keep=Vector(
        (1, 2, 3),
        "cells kept: 0 at a corner, 1 at an edge, 2 at a face, 3 at the centre",
        sizes=(1, 2, 3),
        least=0,
        most=3,
        whole=True,
    ),
    level=Count(3, "how often every cell is cut into 27", most=20),
)
def cells(x, y, z, level, runs):  # type: ignore[no-untyped-def]
    """Fractals of kept cells in the cube [-1, 1]^3.

    Kept 0 is Cantor dust (Cantor 1883), 0 and 1 the Menger sponge (Menger 1926), 2 and 3 the Vicsek fractal
    (Vicsek 1983, "Fractal models for diffusion controlled aggregation"), 1 and 2, or 1 to 3, Mosely's
    snowflake (Mosely 2006). Each level is a lattice of kept cells; the fields of all are joined by their
    maximum. They are built from minima and maxima of coordinates, so L = 1.
    """
    f = maximum(absolute(x), maximum(absolute(y), absolute(z))) - 1.0
    cell = 1.0
    for _ in range(level):
        cell = cell / 3.0
        u = absolute(x / cell - 6.0 * floor(x / (6.0 * cell) + 0.5)) - 1.0
        v = absolute(y / cell - 6.0 * floor(y / (6.0 * cell) + 0.5)) - 1.0
        w = absolute(z / cell - 6.0 * floor(z / (6.0 * cell) + 0.5)) - 1.0
        low, high = minimum(u, v), maximum(u, v)
        least, most = minimum(low, w), maximum(high, w)
        middle = maximum(low, minimum(high, w))
        kept = 1e9
        for first, last in runs:
            inside = -1e9
            if first > 0:
                inside = least if first == 1 else middle if first == 2 else most
            beyond = -1e9
            if last < 3:
                beyond = -least if last == 0 else -middle if last == 1 else -most
            kept = minimum(kept, maximum(inside, beyond))
        orbit(u * u + v * v + w * w, kept * cell > f, u, v, w)
        f = maximum(f, kept * cell)
    return f


@cells.arguments
def cells_arguments(node: Node) -> dict[str, object]:
    kept = sorted({*node["keep"]})
    starts = [k for k in kept if k - 1 not in kept]
    ends = [k for k in kept if k + 1 not in kept]
    return {"level": node["level"], "runs": Fixed(tuple(zip(starts, ends, strict=True)))}


@cells.bounds
def cells_bounds(node: Node) -> Box:
    return Box.centred(1.0)


@cells.visible
def cells_visible(node: Node, voxel: float) -> Node:
    """The fractal of the deepest level whose cells are wider than a voxel."""
    deepest = max(math.ceil(math.log(2.0 / voxel, 3.0) - 1e-6) - 1, 0)
    return node if node["level"] <= deepest else node.changed(level=deepest)
