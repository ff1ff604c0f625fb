"""The Menger sponge."""

from __future__ import annotations

from .box import Box
from .parameters import Count
from .registry import Node, shape
from .vocabulary import absolute, floor, maximum, minimum, orbit, sqrt


@shape(level=Count(3, "how many times holes are cut; level 0 is a cube", most=20))
def menger(x, y, z, level):  # type: ignore[no-untyped-def]
    """The Menger sponge of any level in the cube [-1, 1]^3.

    Menger 1926; distance: Quilez 2011, "Menger fractal": a box minus, per level, an infinite lattice of
    crosses. Every term is the distance to its own solid or less, so their maximum has L = 1. Volume 8
    (20/27)^n, area 4 (2 (20/9)^n + 4 (8/9)^n).
    """
    ax = absolute(x) - 1.0
    ay = absolute(y) - 1.0
    az = absolute(z) - 1.0
    ox = maximum(ax, 0.0)
    oy = maximum(ay, 0.0)
    oz = maximum(az, 0.0)
    d = sqrt(ox * ox + oy * oy + oz * oz) + minimum(maximum(ax, maximum(ay, az)), 0.0)
    scale = 1.0
    cell = 1.0 / 3.0
    for _ in range(level):
        qx = absolute(0.5 * scale * x - floor(0.5 * scale * x) - 0.5)
        qy = absolute(0.5 * scale * y - floor(0.5 * scale * y) - 0.5)
        qz = absolute(0.5 * scale * z - floor(0.5 * scale * z) - 0.5)
        rx = absolute(1.0 - 6.0 * qx)
        ry = absolute(1.0 - 6.0 * qy)
        rz = absolute(1.0 - 6.0 * qz)
        cross = minimum(maximum(rx, ry), minimum(maximum(ry, rz), maximum(rz, rx)))
        orbit(4.0 * (qx * qx + qy * qy + qz * qz), (cross - 1.0) * cell > d)
        d = maximum(d, (cross - 1.0) * cell)
        scale = scale * 3.0
        cell = cell * (1.0 / 3.0)
    return d


@menger.bounds
def _(node: Node) -> Box:
    return Box.centred(1.0)
