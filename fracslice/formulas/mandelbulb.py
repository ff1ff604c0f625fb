"""The Mandelbulb: w -> w^n + p in White and Nylander's triplex numbers, or w^n + c (its Julia sets)."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from . import escape
from .box import Box, Triple
from .escape import CORE, potential_distance, sure_distance
from .orbits import escape_sign, single
from .parameters import AUTO, Number, Vector
from .registry import Fixed, Node, shape
from .rounds import ITERATIONS, REPEAT, Stepped
from .verbs import power as raised
from .verbs import products, raise_whole
from .vocabulary import (
    absolute,
    any_of,
    atan2,
    cos,
    exp,
    log,
    maximum,
    minimum,
    orbit,
    ratio,
    rsqrt,
    sin,
    sqrt,
    where,
)

ESCAPED = 1e4
"""|w| one step past the escape circle."""

CALM = 3.0
"""Value of |w|^2, relative to that of the farthest point of the solid, from which only the radial stretch
counts. A smaller value costs fewer evaluations, but makes the level sets steeper that seams lie on.
"""


@shape(
    lipschitz=2.0,
    exterior_only=True,
    power=Number(
        8.0, "the exponent; whole numbers need no trigonometry and are several times faster", least=2, most=32
    ),
    iterations=ITERATIONS,
    bailout=Number(2.0, "the solid is where the last step is not larger than this", above=1, most=1e6),
    julia=Vector(
        None,
        "adds this point in each step instead of the start point: a Julia set of the Mandelbulb",
        most=4,
        least=-4,
    ),
    repeat=REPEAT,
)
def mandelbulb(  # type: ignore[no-untyped-def]
    x,
    y,
    z,
    power,
    iterations,
    levels,
    calm,
    c,
    separate,
    half_less,
    digits,
    turns,
    half_digits,
    even,
    linear,
    fixed_c,
    loose,
    torn,
    curved,
):
    """The Mandelbulb: whole powers by complex multiplication, others in polar coordinates.

    White and Nylander 2009; distance: Quilez 2009, "Mandelbulb", after Hart, Sandin and Kauffman 1989. With
    w = (rho e^(i phi), z), w^n = (Im (z + i rho)^n e^(i n phi), Re (z + i rho)^n). Both powers are products;
    Im (z + i rho)^n is carried divided by rho, so the poles are no special case. The real part of a square is
    2 re^2 minus the squared norm, which is known. The azimuth enters as u + iv = e^(2 i phi), which needs no
    root, to the power n/2; the remaining factor of rho e^(i n phi) is x + iy for odd n, else rho.

    The map stretches by n r^(n-1) along meridians and by n |sin n theta / sin theta| r^(n-1) along circles of
    latitude. The usual dr ignores the second stretch, and overestimates distances up to 13 times near the
    poles. Here it counts as far out as a point of the solid can come (`escape.farthest`). Farther out, each
    step increases the radius in any direction, so only the radial stretch matters, and the second is faded
    out.

    There is no theorem for three dimensions; L = 2 is measured (`docs/how/accuracy.md`). It fails for a
    disconnected set (a constant far out): there the field also stays below twice `escape.sure_distance`. A
    fractional power tears space where the azimuth jumps from pi to -pi. No bound holds across the tear, so
    the conservative field stays below the sure distance to it.
    """
    first_level, last_level, escape2, least_r2 = levels
    fade, fading = calm
    cx, cy, cz = x, y, z
    grow = 1.0
    if fixed_c:
        cx, cy, cz = c
        grow = 0.0
    rho2 = x * x + y * y
    r2 = rho2 + z * z
    dr = 0.0 * x + 1.0
    level = 0.0 * x + first_level
    reached = first_level
    end_r2, slope = r2, dr
    alive = r2 < escape2
    if curved:
        bend = 0.0 * x
    if loose:
        least, bailout, reach = separate
        sure = sqrt(minimum(r2, 1e30)) - reach
    if torn:
        tear = 0.0 * x + 1e30
    for _ in range(iterations):
        if not any_of(alive):
            break
        rho2 = maximum(rho2, 1e-30)
        if even:
            rho = sqrt(rho2)
        if digits:
            re, im, norm2 = z, 1.0, r2
            for odd in digits:
                twice = re + re
                re, im = twice * re - norm2, twice * im
                norm2 = norm2 * norm2
                if odd:
                    re, im = re * z - im * rho2, re + im * z
                    norm2 = norm2 * r2
            over = ratio(y, rho2)
            u, v = 1.0 - (y + y) * over, (x + x) * over
            cu, cv = u, v
            for odd in turns:
                twice = cv + cv
                cu, cv = 1.0 - twice * cv, twice * cu
                if odd:
                    cu, cv = cu * u - cv * v, cu * v + cv * u
            meridian = r2
            for odd in half_digits:
                meridian = meridian * meridian
                if odd:
                    meridian = meridian * r2
            if even:
                meridian = meridian * sqrt(r2)
            if linear:
                meridian = sqrt(r2)
        else:
            safe = maximum(r2, 1e-30)
            rn = exp(0.5 * power * log(safe))
            theta = power * atan2(rho, z)
            phi = power * atan2(y, x)
            re, im = rn * cos(theta), rn * sin(theta) / rho
            cu, cv = cos(phi), sin(phi)
            meridian = rn * rsqrt(safe)
        if loose:
            meridian = maximum(meridian, least)
            latitude = absolute(im)
        else:
            latitude = absolute(im) * minimum(1.0, fade - r2 * fading)
        if torn:
            beside = 2.0 * sure_distance(where(x < 0.0, absolute(y), rho), slope, bend)
            tear = where(alive, minimum(tear, beside), tear)
        if curved:
            bend = where(alive, bend + slope * half_less * rsqrt(maximum(r2, CORE)), bend)
        if even:
            s = im * rho
            x, y = s * cu + cx, s * cv + cy
        else:
            x, y = im * (cu * x - cv * y) + cx, im * (cu * y + cv * x) + cy
        z = re + cz
        dr = maximum(meridian, latitude) * (power * dr) + grow
        rho2 = x * x + y * y
        r2 = rho2 + z * z
        orbit(r2, alive, x, y, z)
        end_r2 = where(alive, r2, end_r2)
        slope = where(alive, maximum(dr, slope), slope)
        reached = reached * power
        level = where(alive, reached, level)
        if loose:
            radius = sqrt(r2)
            margin = where(level < 0.75 * last_level, radius - reach, radius - bailout)
            sure = where(alive, maximum(sure, sure_distance(margin, slope, bend)), sure)
        alive = alive & (r2 < escape2)
    f = potential_distance(end_r2, slope * slope, level, first_level, last_level, least_r2)
    if loose:
        f = minimum(2.0 * sure, f)
    if torn:
        f = minimum(tear, maximum(-tear, f))
    return f


@mandelbulb.arguments
def mandelbulb_arguments(node: Node) -> dict[str, object]:
    power = node["power"]
    first, last, escape2, least_r2 = escape.levels(power, node["iterations"], node["bailout"], ESCAPED)
    loose, torn = _may_be_disconnected(node, escape2), bool(node.is_conservative and power % 1)
    reach = escape.farthest(power, node["bailout"], _constant(node))
    fading = 1 / (min(CALM * reach**2, escape2) - reach**2)
    return {
        "power": power,
        "iterations": node["iterations"],
        "levels": (first, last, escape2, least_r2),
        "calm": (1 + reach**2 * fading, fading),
        "c": node["julia"] or (0.0, 0.0, 0.0),
        "separate": (CORE ** ((power - 1) / 2), node["bailout"], reach),
        "half_less": (power - 1) / 2,
        "fixed_c": Fixed(node["julia"] is not None),
        "loose": Fixed(loose),
        "torn": Fixed(torn),
        "curved": Fixed(loose or torn),
        **products(power),
    }


def _constant(node: Node) -> float:
    """Largest |c| over all points of the solid."""
    return math.hypot(*node["julia"]) if node["julia"] else node.bounds.box.hi[0]


def _may_be_disconnected(node: Node, escape2: float) -> bool:
    """True if 0, the critical point of w^n, is outside: for one constant at all points, the set is then
    disconnected.
    """
    c = node["julia"] or (0.0, 0.0, 0.0)
    w = (0.0, 0.0, 0.0)
    for _ in range(node["iterations"]):
        w = _step(w, node["power"], c)
        if math.hypot(*w) ** 2 >= escape2:
            return True
    return bool(math.hypot(*w) > node["bailout"])


def _step(w: Triple, power: float, c: Triple) -> Triple:
    """w^power + c in polar coordinates, where theta is the angle from the pole."""
    x, y, z = w
    rn = math.hypot(x, y, z) ** power
    theta, phi = power * math.atan2(math.hypot(x, y), z), power * math.atan2(y, x)
    s = rn * math.sin(theta)
    return s * math.cos(phi) + c[0], s * math.sin(phi) + c[1], rn * math.cos(theta) + c[2]


@mandelbulb.steepening
def mandelbulb_steepening(node: Node) -> float:
    return float(node["power"])


@mandelbulb.check
def mandelbulb_check(node: Node) -> None:
    if node["bailout"] ** node["power"] > 1e15:
        raise node.fail(
            f"bailout={node['bailout']:g}: expected at most {1e15 ** (1 / node['power']):.4g} "
            f"for power {node['power']:g}"
        )


@mandelbulb.bounds
def mandelbulb_bounds(node: Node) -> Box:
    single(node)
    # |w_n+1| >= |w_n|^power - |c|, where c is the start point or the constant, bounds |w_n| backwards from
    # |w_N| <= R. Where c is the start point, its own bound is iterated from above.
    power, steps = node["power"], 1 if node["iterations"] == AUTO else min(node["iterations"], 60)
    constant = math.hypot(*node["julia"]) if node["julia"] else None
    radius = node["bailout"] + ESCAPED
    for _ in range(100):
        start, radius = radius, node["bailout"]
        for _ in range(steps):
            radius = (radius + (start if constant is None else constant)) ** (1 / power)
    return Box.centred(radius)


def whole_step(w, c, digits, turns, half_digits, even, linear, power):  # type: ignore[no-untyped-def]
    """Step of a whole power."""
    return raise_whole(w, digits, turns, half_digits, even, linear, power) + c


def step(w, c, power):  # type: ignore[no-untyped-def]
    """Step of a fractional power."""
    return raised(w, power) + c


@mandelbulb.step
def mandelbulb_step(node: Node) -> Stepped:
    power = node["power"]
    if power % 1:
        return step, {"power": power}, node["julia"]
    return whole_step, {**products(power), "power": power}, node["julia"]


@mandelbulb.sign
def mandelbulb_sign(node: Node) -> tuple[Callable[..., Any], dict[str, object]]:
    _, _, escape2, _ = escape.levels(node["power"], node["iterations"], node["bailout"], ESCAPED)
    return escape_sign(node, node["bailout"], escape2)
