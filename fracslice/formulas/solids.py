"""Solids with flat or superelliptic sides."""

from __future__ import annotations

import math

from ..common.parameters import Count, Number, Vector
from .box import Box
from .registry import Node, shape
from .vocabulary import absolute, atan2, cos, exp, floor, log, maximum, minimum, sin, sqrt


@shape(
    sides=Count(6, "number of sides", least=3, most=1000),
    radius=Number(0.5, "from the axis to the corners", above=0),
    height=Number(1.0, "the height along z, centred at the origin", above=0),
)
def prism(x, y, z, sector, flat, side, half):  # type: ignore[no-untyped-def]
    """A regular prism along the z axis, with a corner on the x axis (Quilez 2020, "Distance functions").

    L = 1: an exact distance.
    """
    turn = sector * (floor(atan2(y, x) / sector) + 0.5)
    c, s = cos(turn), sin(turn)
    q = c * x + s * y - flat
    v = maximum(absolute(c * y - s * x) - side, 0.0)
    out = maximum(q, 0.0)
    across = sqrt(out * out + v * v) + minimum(q, 0.0)
    along = absolute(z) - half
    a, b = maximum(across, 0.0), maximum(along, 0.0)
    return sqrt(a * a + b * b) + minimum(maximum(across, along), 0.0)


@prism.arguments
def prism_arguments(node: Node) -> dict[str, object]:
    sector = 2 * math.pi / node["sides"]
    flat, side = (node["radius"] * f(sector / 2) for f in (math.cos, math.sin))
    return {"sector": sector, "flat": flat, "side": side, "half": node["height"] / 2}


@prism.bounds
def prism_bounds(node: Node) -> Box:
    return Box.centred(node["radius"], node["radius"], node["height"] / 2)


@shape(
    size=Vector((1.0, 1.0, 1.0), "the three diameters", above=0),
    exponent=Number(4.0, "2 is an ellipsoid; larger numbers come near to a box", least=2, most=100),
)
def superquadric(x, y, z, over, exponent, least):  # type: ignore[no-untyped-def]
    """A superellipsoid (Barr 1981, "Superquadrics and angle-preserving transformations").

    The p-norm of the coordinates in half diameters, minus 1, times the smallest one. For p >= 2 the gradient
    of the p-norm is at most 1, so L = 1.
    """
    px, py, pz = over
    x, y, z = absolute(x) * px, absolute(y) * py, absolute(z) * pz
    most = maximum(maximum(x, maximum(y, z)), 1e-12)
    u, v, w = maximum(x / most, 1e-9), maximum(y / most, 1e-9), maximum(z / most, 1e-9)
    total = exp(exponent * log(u)) + exp(exponent * log(v)) + exp(exponent * log(w))
    return (most * exp(log(total) / exponent) - 1.0) * least


@superquadric.arguments
def superquadric_arguments(node: Node) -> dict[str, object]:
    over = tuple(2 / s for s in node["size"])
    return {"over": over, "exponent": node["exponent"], "least": min(node["size"]) / 2}


@superquadric.bounds
def superquadric_bounds(node: Node) -> Box:
    return Box.centred(*(s / 2 for s in node["size"]))
