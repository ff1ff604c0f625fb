"""Cubes that are cut into smaller cubes, again and again: the Menger sponge, other choices of 27 cells, and
the Jerusalem cube.
"""

from __future__ import annotations

import math

from ..common.parameters import Count, Vector
from ..expr.vocabulary import absolute, floor, maximum, minimum, orbit, sqrt
from ..fields.box import Box
from ..fields.registry import Fixed, Node, shape


@shape(level=Count(3, "how often holes are cut; meshes and layers stop at bars of a voxel", most=20))
def menger(x, y, z, level):  # type: ignore[no-untyped-def]
    """The Menger sponge of any level in the cube [-1, 1]^3.

    Menger 1926; distance: Quilez 2011, "Menger fractal": a box minus an infinite lattice of crosses for each
    level. Every term is the distance to its own solid or less, so their maximum has L = 1. Volume 8
    (20/27)^n, area 4 (2 (20/9)^n + 4 (8/9)^n).

    q is the offset of a point from the centre of its cell, in cells; the next level's is
    |3 q - nearest whole|.
    """
    ax = absolute(x) - 1.0
    ay = absolute(y) - 1.0
    az = absolute(z) - 1.0
    ox = maximum(ax, 0.0)
    oy = maximum(ay, 0.0)
    oz = maximum(az, 0.0)
    d = sqrt(ox * ox + oy * oy + oz * oz) + minimum(maximum(ax, maximum(ay, az)), 0.0)
    cell = 1.0 / 3.0
    qx = absolute(0.5 * x - floor(0.5 * x) - 0.5)
    qy = absolute(0.5 * y - floor(0.5 * y) - 0.5)
    qz = absolute(0.5 * z - floor(0.5 * z) - 0.5)
    for _ in range(level):
        ux = 3.0 * qx
        uy = 3.0 * qy
        uz = 3.0 * qz
        vx = ux - 1.0
        vy = uy - 1.0
        vz = uz - 1.0
        rx = absolute(ux + vx)
        ry = absolute(uy + vy)
        rz = absolute(uz + vz)
        low, high = minimum(rx, ry), maximum(rx, ry)
        cross = maximum(low, minimum(high, rz))
        r2 = 4.0 * (qx * qx + qy * qy + qz * qz)
        orbit(r2, (cross - 1.0) * cell > d, 2.0 * qx, 2.0 * qy, 2.0 * qz)
        d = maximum(d, cross * cell - cell)
        qx = minimum(ux, absolute(vx))
        qy = minimum(uy, absolute(vy))
        qz = minimum(uz, absolute(vz))
        cell = cell * (1.0 / 3.0)
    return d


@menger.bounds
def menger_bounds(node: Node) -> Box:
    return Box.centred(1.0)


@menger.visible
def menger_visible(node: Node, voxel: float) -> Node:
    """The sponge of the deepest level whose bars, one cell wide, are wider than a voxel.

    Thinner bars fall between samples. The sponge contains all edges of its cells, so no point of the returned
    solid is farther than sqrt(2) / 6 cells, 0.71 voxels, from the sponge of full depth.
    """
    deepest = max(math.ceil(math.log(2.0 / voxel, 3.0) - 1e-6) - 1, 0)
    return node if node["level"] <= deepest else node.changed(level=deepest)


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
