"""The Menger sponge."""

from __future__ import annotations

import math

from ..common.parameters import Count
from .box import Box
from .registry import Node, shape
from .vocabulary import absolute, floor, maximum, minimum, orbit, sqrt


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
