"""The Mandelbulb: w -> w^n + p in White and Nylander's triplex numbers, or w^n + c (its Julia sets)."""

from __future__ import annotations

import math

from .box import Box, Triple
from .escape import CORE, farthest, levels, potential_distance, sure_distance
from .parameters import AUTO, Count, Number, Vector
from .registry import Fixed, Node, shape
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
"""How large |w| is one step past the escape circle."""

CALM = 3.0
"""At this |w|^2, in units of the farthest of the solid, only radii count. A shorter way there costs fewer
evaluations, but makes the levels steeper that seams lie on.
"""


@shape(
    lipschitz=2.0,
    exterior_only=True,
    power=Number(
        8.0, "the exponent; whole numbers need no trigonometry and are several times faster", least=2, most=32
    ),
    iterations=Count(
        AUTO,
        'steps of the orbit; "auto": until one more moves most by less than 1/512 of the size',
        least=1,
        auto=True,
    ),
    bailout=Number(2.0, "the solid is where the last step is not larger than this", above=1, most=1e6),
    julia=Vector(
        None,
        "adds this point in each step instead of the start point: a Julia set of the Mandelbulb",
        most=4,
        least=-4,
    ),
)
def mandelbulb(  # type: ignore[no-untyped-def]
    x,
    y,
    z,
    power,
    iterations,
    first_level,
    last_level,
    escape2,
    least_r2,
    fade,
    fading,
    c,
    digits,
    turns,
    half_digits,
    even,
    linear,
    fixed_c,
    loose,
    least,
    bailout,
    reach,
    half_less,
    torn,
    curved,
    whole,
):
    """The Mandelbulb: whole powers by complex multiplication, others in polar coordinates.

    White and Nylander 2009; distance: Quilez 2009, "Mandelbulb", after Hart, Sandin and Kauffman 1989. With
    w = (rho e^(i phi), z), w^n = (Im (z + i rho)^n e^(i n phi), Re (z + i rho)^n): both powers are products,
    and Im (z + i rho)^n is carried divided by rho, so the poles are no special case. The real part of a
    square is 2 re^2 minus the squared norm, which is known. Of the azimuth u + iv = e^(2 i phi) is taken,
    which needs no root, to the power n/2; what is left of rho e^(i n phi) is x + iy where n is odd, else rho.

    The map stretches by n r^(n-1) along meridians and by n |sin n theta / sin theta| r^(n-1) along circles of
    latitude. The textbook's dr forgets the second, and overestimates distances up to 13 times near the poles;
    it is taken here, as far out as a point of the solid can come (`escape.farthest`). Beyond, each step leads
    farther away whatever its direction, so that only how radii stretch matters; there it is faded out.
    There is no theorem for three dimensions; L = 2 is measured (`docs/how/accuracy.md`). Where a set falls
    apart (a constant far out) that fails, and the field is also kept below twice a sure distance,
    `escape.sure_distance`. A power that is not whole tears space where the azimuth jumps from pi to -pi: no
    bound holds across the tear, and the guarded field stays below the sure distance from it.
    """
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
        sure = sqrt(minimum(r2, 1e30)) - reach
    if torn:
        tear = 0.0 * x + 1e30
    for _ in range(iterations):
        if not any_of(alive):
            break
        rho2 = maximum(rho2, 1e-30)
        if even:
            rho = sqrt(rho2)
        if whole:
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
        orbit(r2, alive)
        end_r2 = where(alive, r2, end_r2)
        slope = where(alive, maximum(dr, slope), slope)
        reached = reached * power
        level = where(alive, reached, level)
        if loose:
            radius = sqrt(r2)
            apart = where(level < 0.75 * last_level, radius - reach, radius - bailout)
            sure = where(alive, maximum(sure, sure_distance(apart, slope, bend)), sure)
        alive = alive & (r2 < escape2)
    f = potential_distance(end_r2, slope * slope, level, first_level, last_level, least_r2)
    if loose:
        f = minimum(2.0 * sure, f)
    if torn:
        f = minimum(tear, maximum(-tear, f))
    return f


def _digits(n: int) -> tuple[int, ...]:
    """The binary digits of n after the first: square for each, multiply where it is 1."""
    return tuple(int(d) for d in bin(n)[3:])


@mandelbulb.arguments
def mandelbulb_arguments(node: Node) -> dict[str, object]:
    power = node["power"]
    first, last, escape2, least_r2 = levels(power, node["iterations"], node["bailout"], ESCAPED)
    loose, torn = _falls_apart(node, escape2), bool(node.is_conservative and power % 1)
    constant = _constant(node)
    reach = farthest(power, node["bailout"], constant)
    fading = 1 / (min(CALM * reach**2, escape2) - reach**2)
    return {
        "power": power,
        "iterations": node["iterations"],
        "first_level": first,
        "last_level": last,
        "escape2": escape2,
        "least_r2": least_r2,
        "fade": 1 + reach**2 * fading,
        "fading": fading,
        "c": node["julia"] or (0.0, 0.0, 0.0),
        "fixed_c": Fixed(node["julia"] is not None),
        "loose": Fixed(loose),
        "least": CORE ** ((power - 1) / 2),
        "bailout": node["bailout"],
        "reach": reach,
        "half_less": (power - 1) / 2,
        "torn": Fixed(torn),
        "curved": Fixed(loose or torn),
        **_products(power),
    }


def _constant(node: Node) -> float:
    """The largest |c| of all points of the solid."""
    return math.hypot(*node["julia"]) if node["julia"] else node.bounds.box.hi[0]


def _falls_apart(node: Node, escape2: float) -> bool:
    """Whether 0, the critical point of w^n, is outside, where the constant is one for all."""
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


def _products(power: float) -> dict[str, Fixed]:
    """Which products make a whole power; none are compiled for another."""
    whole = power == int(power)
    n = int(power) if whole else 2
    return {
        "whole": Fixed(whole),
        "digits": Fixed(_digits(n)),
        "turns": Fixed(_digits(n // 2)),
        "half_digits": Fixed(_digits((n - 1) // 2)),
        "even": Fixed(n % 2 == 0),
        "linear": Fixed(n == 2),
    }


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
    # |w_n+1| >= |w_n|^power - |c|, c the start point or the constant: backwards from |w_N| <= R, from above.
    power, steps = node["power"], 1 if node["iterations"] == AUTO else min(node["iterations"], 60)
    constant = math.hypot(*node["julia"]) if node["julia"] else None
    radius = node["bailout"] + ESCAPED
    for _ in range(100):
        start, radius = radius, node["bailout"]
        for _ in range(steps):
            radius = (radius + (start if constant is None else constant)) ** (1 / power)
    return Box.centred(radius)
