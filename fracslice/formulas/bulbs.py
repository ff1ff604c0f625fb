"""The Mandelbulb, w -> w^n + p in White and Nylander's triplex numbers or w^n + c (its Julia sets), and other
relatives of the Mandelbrot set in three dimensions.

What follows from the power of a map w -> m(w) + c with |m(w)| = |w|^n: |w_n+1| >= |w_n|^n - |c| bounds the
solid from outside. For |w| >= |c| and |w|^(n-1) > 2, |w| grows with each step, so no orbit comes back from
beyond 2. The one critical point of these maps is 0.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache
from typing import Any

from ..common.parameters import Count, Number, Vector
from ..expr.vocabulary import absolute, atan2, cos, exp, floor, log, maximum, rsqrt, sin, sqrt, where
from ..fields.growth import stays
from ..fields.maps import (
    LENGTHS,
    MAJORANTS,
    calm_power,
    enclosing_radius,
    farthest,
    positive,
    power_length,
    products,
    square,
    square_length,
    stop,
    turn,
)
from ..fields.maps import power as raised
from ..fields.orbits import ITERATIONS, REPEAT, Stepped, orbit, orbit_step, rounds, steps
from ..fields.registry import Fixed, Node

ESCAPED = 1e4
"""|w| one step past the radius where an orbit stops."""

BAILOUT = 2.0
"""Radius of the surface where a formula has no parameter for it."""

CALM = 3.0
"""Value of |w|^2, relative to that of the farthest point of the solid, from which only the radial stretch
counts. A smaller value costs fewer evaluations, but makes the level sets steeper that seams lie on.
"""


def products_step(node: Node) -> Stepped:
    """Return the step of an orbit with a `power`: a whole one is a constant of its code."""
    function, values, julia = orbit_step(node)
    power = node["power"]
    return function, {**values, "power": Fixed(power) if products(power)[0] else power}, julia


def power_step(node: Node) -> Stepped:
    """Return the step of a power map, with the stretch for hybrids."""
    function, values, julia = products_step(node)
    values.pop("bailout", None)
    return function, {**values, "calm": Fixed(())}, julia


def power_alone(node: Node) -> dict[str, Any]:
    """Return the argument of `powers.calm_power` of an orbit that is no hybrid."""
    if not _is_connected(node):
        return {}
    reach, escape = _reach(node), stop(node["power"], _bailout(node), ESCAPED)
    fading = 1 / (min(CALM * reach**2, escape**2) - reach**2)
    return {"calm": (1 + reach**2 * fading, fading)}


def power_growth(node: Node) -> dict[str, Any]:
    """Return the attributes of `fields.growth.Growth`."""
    return {
        "powers": (float(node["power"]),),
        "factors": (0.0,),
        "escapes": (_bailout(node),),
        "half": (_radius(node),) * 3,
        "proved": _bailout(node) ** (node["power"] - 1) >= 2,
        "least": 1.0,
        "stopped": ESCAPED,
        "connected": _is_connected(node),
        "reach": _reach(node),
    }


HOOKS: dict[str, Callable[..., Any]] = {"step": power_step, "alone": power_alone, "growth": power_growth}


def _bailout(node: Node) -> float:
    return float(node.values.get("bailout", BAILOUT))


def _radius(node: Node) -> float:
    """Radius of the solid."""
    power, bailout, count = node["power"], _bailout(node), min(rounds(node), 60)
    if node["julia"]:
        return enclosing_radius(power, bailout, count, math.hypot(*node["julia"]))
    return _own_radius(power, bailout, count)


@lru_cache(maxsize=256)
def _own_radius(power: float, bailout: float, count: int) -> float:
    """Radius of the solid whose constant is the start point: its own bound is iterated from above."""
    radius = bailout + ESCAPED
    for _ in range(100):
        radius = enclosing_radius(power, bailout, count, radius)
    return radius


def _reach(node: Node) -> float:
    """Radius of the solids of all numbers of steps."""
    constant = math.hypot(*node["julia"]) if node["julia"] else _radius(node)
    return farthest(node["power"], _bailout(node), constant)


def _is_connected(node: Node) -> bool:
    """True if the critical point 0 is inside; if not, the set of one constant is disconnected."""
    if not node["julia"]:
        return True
    bailout, (code, given) = _bailout(node), steps(node, alone=False)
    outer = stop(node["power"], bailout, ESCAPED)
    return stays(code, given, rounds(node), bailout, outer)


@orbit(
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
def mandelbulb(w, c, power, calm):  # type: ignore[no-untyped-def]
    """The Mandelbulb: whole powers by complex multiplication, others in polar coordinates.

    White and Nylander 2009; distance: Quilez 2009, "Mandelbulb", after Hart, Sandin and Kauffman 1989. With
    w = (rho e^(i phi), z), w^n = (Im (z + i rho)^n e^(i n phi), Re (z + i rho)^n).

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
    return calm_power(w, power, calm) + c


mandelbulb.hooks.update(HOOKS)


@mandelbulb.check  # type: ignore[untyped-decorator]
def mandelbulb_check(node: Node) -> None:
    if node["bailout"] ** node["power"] > 1e15:
        raise node.fail(
            f"bailout={node['bailout']:g}: expected at most {1e15 ** (1 / node['power']):.4g} "
            f"for power {node['power']:g}"
        )


POWER = Number(8.0, "the exponent", least=2, most=16)

DIAGONAL_AXIS = (0.24450384497347374, -0.5902844985873289, 0.7692737357538558)
DIAGONAL = 56.60026933422475
"""Rotation that takes the x axis to the space diagonal, and the y axis to (-1, 1, 0)."""


@orbit()
def quaternion_mandelbrot(w, c):  # type: ignore[no-untyped-def]
    """The Mandelbrot set of q^2 + c in the quaternions, cut at k = 0 (Norton 1982).

    It is the complex Mandelbrot set turned about the real axis. L = 2 is measured.
    """
    return square(w) + c


@orbit()
def bristorbrot(w, c):  # type: ignore[no-untyped-def]
    """The Bristorbrot (Bristor 2009, fractalforums.com). L = 2 is measured."""
    x, y, z = w
    return (x * x - y * y - z * z, y * (2.0 * x - z), z * (2.0 * x + y)) + c


@orbit(power=POWER)
def burning_ship(w, c, power, calm):  # type: ignore[no-untyped-def]
    """The Mandelbulb of absolute coordinates, after Michelitsch and Roessler 1992, "The burning ship".

    L = 2 is measured.
    """
    return calm_power(positive(w), power, calm) + c


burning_ship.hooks.update(HOOKS)


@burning_ship.growth  # type: ignore[untyped-decorator]
def burning_ship_growth(node: Node) -> dict[str, object]:
    """Of positive coordinates, no azimuth is at the tear."""
    return {**power_growth(node), "torn": False}


@orbit(power=Count(3, "the exponent", least=2, most=9))
def quaternion_power(w, c, power):  # type: ignore[no-untyped-def]
    """The Mandelbrot set of q^n + c in the quaternions, cut at k = 0, or with `julia` the Julia set (Bedding
    and Briggs 1995, "Iteration of quaternion maps").

    With q = x + u, |u|^2 = y^2 + z^2, the real part and the factor of u are polynomials. The derivative of
    q^n has the norm n |q|^(n-1) at most. L = 2 is measured.
    """
    x, y, z = w
    u2 = y * y + z * z
    a, b = x, 1.0 + 0.0 * x
    r, stretch = sqrt(x * x + u2), 1.0 * power
    for _ in range(power - 1):
        a, b = x * a - u2 * b, x * b + a
        stretch = stretch * r
    return (a, b * y, b * z) + c, stretch


@orbit(power=Number(9.0, "the exponent", least=2, most=16))
def cosine_bulb(w, c, power, torn):  # type: ignore[no-untyped-def]
    """The Mandelbulb with angles counted from the equator (Nylander 2009, bugman123.com): odd powers.

    Lengths along meridians grow by n r^(n-1), along circles of latitude by r^(n-1) |cos n theta / cos theta|,
    without limit near the poles if n is not odd: space tears there. L = 2 is measured.
    """
    image = torn_power(w, power) if torn else equatorial_power(w, power)
    return image + c


@cosine_bulb.step  # type: ignore[untyped-decorator]
def cosine_step(node: Node) -> Stepped:
    """A power that is not whole tears space where the azimuth jumps."""
    function, values, julia = orbit_step(node)
    return function, {**values, "torn": Fixed(node["power"] % 1 != 0)}, julia


def equatorial_power(w, power):  # type: ignore[no-untyped-def]
    """Power in polar coordinates whose angle is that to the equator."""
    x, y, z, stretch = equatorial(w, power)
    return (x, y, z), stretch


def torn_power(w, power):  # type: ignore[no-untyped-def]
    """`equatorial_power` that is not whole."""
    x, y, z, stretch = equatorial(w, power)
    return (x, y, z), stretch


def equatorial(w, power):  # type: ignore[no-untyped-def]
    """Image of `equatorial_power`, and its stretch."""
    x, y, z = w
    rho2 = maximum(x * x + y * y, 1e-30)
    r2 = maximum(rho2 + z * z, 1e-30)
    rho = sqrt(rho2)
    rn = exp(0.5 * power * log(r2))
    theta, phi = power * atan2(rho, absolute(z)), power * atan2(y, x)
    # Angles are counted from the nearer pole: rounding of those near pi / 2 is not small against rho.
    half_turns = floor(0.5 * power)
    sign = 1.0 - 2.0 * (half_turns - 2.0 * floor(0.5 * half_turns))
    rest = 1.5707963267948966 * (power - 2.0 * half_turns - 1.0)
    sine, cosine = sign * cos(rest), -sign * sin(rest)
    p, q = sin(theta), cos(theta)
    across, along = rn * (cosine * q + sine * p), rn * (sine * q - cosine * p)
    stretch = power * maximum(rn * rsqrt(r2), absolute(across) / rho)
    return across * cos(phi), across * sin(phi), where(z < 0.0, -along, along), stretch


def torn_majorant(w, power):  # type: ignore[no-untyped-def]
    """Towards the axis, rho away, |across| / rho grows by less than 1 / (1 - n e / rho)^2."""
    x, y, z = w
    rho = sqrt(maximum(x * x + y * y, 1e-30))
    return power / rho, where(x < 0.0, absolute(y), rho)


LENGTHS[equatorial_power] = LENGTHS[torn_power] = power_length
MAJORANTS[torn_power] = torn_majorant


@orbit(
    power=Number(4.0, "the exponent", least=2, most=16),
    factor=Number(1.1, "size of lambda", above=0, most=4),
    angle=Number(30.0, "angle of lambda, about the z axis, degrees"),
)
def lambda_bulb(w, c, power, factor, angle):  # type: ignore[no-untyped-def]
    """The filled Julia set of lambda (w - w^n) in the triplex numbers, after the logistic map (May 1976,
    "Simple mathematical models with very complicated dynamics"). L = 2 is measured for powers up to 12, L = 3
    beyond.
    """
    return factor * turn(w - raised(w, power), (0.0, 0.0, 1.0), angle)


lambda_bulb.hooks["step"] = products_step


@lambda_bulb.slope  # type: ignore[untyped-decorator]
def lambda_slope(node: Node) -> float:
    return 2.0 if node["power"] <= 12 else 3.0


@orbit(
    scale=Number(2.0, "how much space is enlarged before it is squared", above=0, most=4),
    offset=Number(2.0, "how far it is moved along the x axis before that", least=-4, most=4),
)
def benesi(w, c, scale, offset):  # type: ignore[no-untyped-def]
    """Folds in a frame along the space diagonal, then a square about the x axis (Benesi 2010,
    fractalforums.com: "Pine tree" after the transform T1). Of the constant, x is added alone; scale 1 and
    offset 0 leave the folds.

    The square doubles the angle about the x axis, counted from the z axis to the y axis, and that to it:
    lengths grow by 2 r along meridians and by 4 |x| along circles. L = 2 is measured.
    """
    w = turn(positive(turn(w, DIAGONAL_AXIS, DIAGONAL)), DIAGONAL_AXIS, -DIAGONAL)
    cx, _, _ = c
    return pine(scale * w - offset * (1.0, 0.0, 0.0)) + (cx, 0.0, 0.0)


def pine(w):  # type: ignore[no-untyped-def]
    """Square about the x axis."""
    x, y, z = w
    rho = sqrt(maximum(y * y + z * z, 1e-30))
    k = 2.0 * x / rho
    image = (x * x - y * y - z * z, k * 2.0 * y * z, k * (y * y - z * z))
    return image, maximum(2.0 * sqrt(x * x + y * y + z * z), 4.0 * absolute(x))


LENGTHS[pine] = square_length
