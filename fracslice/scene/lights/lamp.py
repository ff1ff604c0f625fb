"""A lamp: a ball of light. Its strength is that at distance 1 and falls with the squared distance."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ...expr.vocabulary import TURN, cos, maximum, rsqrt, sin, sqrt
from . import Kind, Point, Unit

if TYPE_CHECKING:
    from ..view import Light


def lamp(x, y, z, u, v, position, radius):
    """Sample the surface of the ball."""
    px, py, pz = position
    h = 1.0 - 2.0 * u
    r = radius * sqrt(maximum(1.0 - h * h, 0.0))
    lx = px - x + r * cos(TURN * v)
    ly = py - y + r * sin(TURN * v)
    lz = pz - z + radius * h
    d2 = maximum(lx * lx + ly * ly + lz * lz, 1e-12)
    over = rsqrt(d2)
    return lx * over, ly * over, lz * over, d2 * over, over * over


def sharp_lamp(x, y, z, u, v, position):
    """Sample a point lamp, which casts sharp shadows."""
    px, py, pz = position
    lx = px - x
    ly = py - y
    lz = pz - z
    d2 = maximum(lx * lx + ly * ly + lz * lz, 1e-12)
    over = rsqrt(d2)
    return lx * over, ly * over, lz * over, d2 * over, over * over


def unit(light: Light, eye: Point, far: float) -> Unit:
    if not light.size:
        return sharp_lamp, {"position": light.position}
    return lamp, {"position": light.position, "radius": light.size}


KIND = Kind("near", unit)
