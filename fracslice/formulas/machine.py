"""Machine elements: spur gears and screw threads."""

from __future__ import annotations

import math

from ..common.parameters import Count, Number
from ..expr.vocabulary import absolute, atan2, floor, maximum, minimum, sqrt
from ..fields.box import Box
from ..fields.registry import Node, shape


@shape(
    teeth=Count(16, "number of teeth", least=6, most=1000),
    radius=Number(1.0, "of the pitch circle", above=0),
    height=Number(0.4, "the height along z, centred at the origin", above=0),
    bore=Number(0.2, "radius of the hole along the axis", least=0),
    angle=Number(20.0, "pressure angle, degrees", least=10, most=30),
)
def gear(x, y, z, sector, base, quarter, tip, root, bore, half):  # type: ignore[no-untyped-def]
    """A spur gear along the z axis with involute flanks (Euler 1765; Litvin and Fuentes 2004, "Gear Geometry
    and Applied Theory"): addendum 1 and dedendum 1.25 modules.

    Involutes of one circle are parallel, so the distance to a flank is the base radius times an angle. Below
    the base circle flanks are radial: L = sqrt(1 + (pi / teeth)^2).
    """
    r = sqrt(x * x + y * y)
    angle = atan2(y, x)
    angle = absolute(angle - sector * floor(angle / sector + 0.5))
    u = sqrt(maximum(r * r - base * base, 0.0))
    flank = minimum(r, base) * (angle - quarter) + (u - base * atan2(u, base))
    return maximum(maximum(r - tip, minimum(flank, r - root)), maximum(bore - r, absolute(z) - half))


def _radii(node: Node) -> tuple[float, float, float]:
    """Radii of the tips, the roots and the base circle."""
    module = 2 * node["radius"] / node["teeth"]
    base = node["radius"] * math.cos(math.radians(node["angle"]))
    return node["radius"] + module, node["radius"] - 1.25 * module, base


@gear.check
def gear_check(node: Node) -> None:
    root = _radii(node)[1]
    if not node["bore"] < root:
        raise node.fail(f"bore={node['bore']:g}: expected less than the radius of the roots, {root:.4g}")


@gear.arguments
def gear_arguments(node: Node) -> dict[str, object]:
    tip, root, base = _radii(node)
    angle = math.radians(node["angle"])
    return {
        "sector": 2 * math.pi / node["teeth"],
        "base": base,
        "quarter": math.pi / (2 * node["teeth"]) + math.tan(angle) - angle,
        "tip": tip,
        "root": root,
        "bore": node["bore"],
        "half": node["height"] / 2,
    }


@gear.bounds
def gear_bounds(node: Node) -> Box:
    tip = _radii(node)[0]
    return Box.centred(tip, tip, node["height"] / 2)


@gear.slope
def gear_slope(node: Node) -> float:
    return math.hypot(1.0, math.pi / node["teeth"])


SLOPE = math.sqrt(3)
"""Radius by height of a flank at 60 degrees."""

DEPTH = 5 / 16 * SLOPE
"""Depth of the thread in units of the pitch."""


@shape(
    radius=Number(0.5, "outer radius", above=0),
    pitch=Number(0.2, "height of one turn", above=0),
    height=Number(1.5, "the height along z, centred at the origin", above=0),
)
def thread(x, y, z, radius, pitch, half, over, tallest, deepest):  # type: ignore[no-untyped-def]
    """A right-handed screw along the z axis with the basic profile of ISO metric threads (ISO 68-1).

    Oberg and Jones 1914, "Machinery's Handbook". The radial distance to the profile, times the
    cosine of its steepest slope, is clipped deep inside, where a turn moves points too little: L = 1.
    """
    r = sqrt(x * x + y * y)
    turns = z / pitch - atan2(y, x) * 0.15915494309189535
    off = pitch * absolute(turns - floor(turns + 0.5))
    cut = minimum(maximum((off - 0.0625 * pitch) * 1.7320508075688772, 0.0), tallest)
    side = maximum((r - radius + cut) * over, -deepest)
    return maximum(side, absolute(z) - half)


def _core(node: Node) -> float:
    """Radius of the roots."""
    return float(node["radius"] - DEPTH * node["pitch"])


@thread.check
def thread_check(node: Node) -> None:
    if not _core(node) > 0.1 * node["radius"]:
        most = 0.9 * node["radius"] / DEPTH
        raise node.fail(f"pitch={node['pitch']:g}: expected less than {most:.4g} for this radius")


@thread.arguments
def thread_arguments(node: Node) -> dict[str, object]:
    core, pitch = _core(node), node["pitch"]
    over = 1 / math.sqrt(1 + 3 * (1 + (pitch / (math.pi * core)) ** 2))
    return {
        "radius": node["radius"],
        "pitch": pitch,
        "half": node["height"] / 2,
        "over": over,
        "tallest": DEPTH * pitch,
        "deepest": over * core / 2,
    }


@thread.bounds
def thread_bounds(node: Node) -> Box:
    return Box.centred(node["radius"], node["radius"], node["height"] / 2)
