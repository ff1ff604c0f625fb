"""A sun: a disc in the sky."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from ...expr.vocabulary import disc, frame, normalised
from . import Kind, Point, Unit

if TYPE_CHECKING:
    from ..view import Light


def sun(x, y, z, u, v, towards, spread, far):
    """Sample the disc."""
    lx, ly, lz = towards
    zero = 0.0 * x
    ax, ay, az, bx, by, bz = frame(lx + zero, ly + zero, lz + zero)
    p, q = disc(u, v)
    p = spread * p
    q = spread * q
    dx, dy, dz = normalised(lx + p * ax + q * bx, ly + p * ay + q * by, lz + p * az + q * bz)
    return dx, dy, dz, far + zero, 1.0 + zero


def sharp_sun(x, y, z, u, v, towards, far):
    """Sample a point-like sun, which casts sharp shadows."""
    lx, ly, lz = towards
    zero = 0.0 * x
    return lx + zero, ly + zero, lz + zero, far + zero, 1.0 + zero


def unit(light: Light, eye: Point, far: float) -> Unit:
    length = math.hypot(*light.position)
    values: dict[str, Any] = {"towards": tuple(p / length for p in light.position), "far": far}
    if not light.size:
        return sharp_sun, values
    return sun, {**values, "spread": math.tan(math.radians(light.size) / 2)}


KIND = Kind("far away", unit, is_disc=True)
