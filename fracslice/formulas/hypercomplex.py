"""Fractals of z -> z^2 + c in more than two dimensions: quaternion Julia sets, and the Mandelbrot set of
the bicomplex numbers.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

from ..common.parameters import Number, Vector
from ..expr.vocabulary import any_of, maximum, orbit, sqrt, where
from ..fields.box import Box
from ..fields.maps import CORE, enclosing_radius, levels, potential_distance, square, stop
from ..fields.orbits import ITERATIONS, REPEAT, Stepped, escape_sign, rounds, single
from ..fields.registry import Fixed, Node, shape

ESCAPED = 256.0
"""|w| one step past the escape circle."""


@shape(
    lipschitz=2.0,
    exterior_only=True,
    c=Vector(
        (-0.2, 0.8, 0.0, 0.0),
        "the constant added in each step: real part, i, j, k",
        sizes=(4,),
        least=-4,
        most=4,
    ),
    iterations=ITERATIONS,
    bailout=Number(2.0, "the solid is where the last step is not larger than this", above=1, most=1e6),
    repeat=REPEAT,
)
def julia(x, y, z, c, iterations, first_level, last_level, escape2, least, flat, loose):  # type: ignore[no-untyped-def]
    """The filled Julia set of q^2 + c in the quaternions, cut at k = 0.

    Norton 1982, "Generation and Display of Geometric Fractals in 3-D"; distance: Hart, Sandin and Kauffman
    1989, "Ray Tracing Deterministic 3-D Fractals". The derivative of q^2 has the norm 2|q| exactly. L = 2 is
    Koebe's bound for connected complex Julia sets; for a disconnected set, the derivative near zero is taken
    at a larger |q|, see `escape.CORE`. For quaternions L = 2 is measured (`docs/how/accuracy.md`). Results
    are frozen once a lane has escaped; w itself runs on, unused.
    """
    cr, ci, cj, ck = c
    imaginary2 = y * y + z * z
    r2 = x * x + imaginary2
    d2 = 0.0 * x + 1.0
    k = 0.0 * x
    level = 0.0 * x + first_level
    slope2 = d2
    alive = r2 < escape2
    for _ in range(iterations):
        if not any_of(alive):
            break
        d2 = where(alive, 2.0 * (maximum(r2, CORE) if loose else r2) * (2.0 * d2), d2)
        slope2 = maximum(d2, slope2)
        level = where(alive, level + level, level)
        twice = x + x
        x = (x * x + cr) - imaginary2
        y = twice * y + ci
        z = twice * z + cj
        imaginary2 = y * y + z * z
        if not flat:
            k = twice * k + ck
            imaginary2 = imaginary2 + k * k
        r2 = where(alive, x * x + imaginary2, r2)
        orbit(r2, alive, x, y, z)
        alive = r2 < escape2
    return potential_distance(r2, slope2, level, first_level, last_level, least)


@julia.arguments
def julia_arguments(node: Node) -> dict[str, object]:
    first, last, least = levels(2, node["iterations"], node["bailout"])
    escape2 = stop(2, node["bailout"], ESCAPED) ** 2
    flat = Fixed(node["c"][3] == 0)
    return {
        "c": node["c"],
        "iterations": node["iterations"],
        "first_level": first,
        "last_level": last,
        "escape2": escape2,
        "least": least,
        "flat": flat,
        "loose": Fixed(_may_be_disconnected(node["c"], node["iterations"], node["bailout"], escape2)),
    }


def _may_be_disconnected(c: Sequence[float], iterations: int, bailout: float, escape2: float) -> bool:
    """True if the critical point 0 is outside: the set is disconnected. Its orbit stays in the complex plane
    of c.
    """
    constant, w = complex(c[0], math.hypot(*c[1:])), 0j
    for _ in range(iterations):
        w = w * w + constant
        if abs(w) ** 2 >= escape2:
            return True
    return abs(w) > bailout


@julia.steepening
def julia_steepening(node: Node) -> float:
    return 2.0


@julia.bounds
def julia_bounds(node: Node) -> Box:
    single(node)
    return Box.centred(enclosing_radius(2, node["bailout"], rounds(node), math.hypot(*node["c"])))


def step(w, c):  # type: ignore[no-untyped-def]
    return square(w) + c


@julia.step
def julia_step(node: Node) -> Stepped:
    if node["c"][3]:
        raise node.fail("c: expected a last number of 0 inside <orbit>: its points have no k")
    return step, {}, node["c"][:3]


@julia.sign
def julia_sign(node: Node) -> tuple[Callable[..., Any], dict[str, object]] | None:
    escape = stop(2, node["bailout"], ESCAPED)
    return escape_sign(node, node["bailout"], escape**2) if not node["c"][3] else None


BAILOUT, HALF = 2.0, 0.7071067811865476


@shape(
    lipschitz=2.0,
    exterior_only=True,
    iterations=ITERATIONS,
)
def tetrabrot(x, y, z, iterations, first_level, last_level, escape2, least):  # type: ignore[no-untyped-def]
    """The Tetrabrot (Rochon 2000, "A generalized Mandelbrot set for bicomplex numbers").

    Idempotents split the bicomplex square into two complex ones: a point is inside if both x + (y - z) i and
    x + (y + z) i are in the complex Mandelbrot set. It is the intersection of two skew cylinders, whose maps
    stretch lengths by sqrt(2). L = 2 is Koebe's bound for both.
    """
    return maximum(
        plane_distance(x, y - z, iterations, first_level, last_level, escape2, least),
        plane_distance(x, y + z, iterations, first_level, last_level, escape2, least),
    )


def plane_distance(a, b, iterations, first_level, last_level, escape2, least):  # type: ignore[no-untyped-def]
    """Distance to the complex Mandelbrot set, in space."""
    x, y = a, b
    r2 = x * x + y * y
    d2 = 0.0 * x + 1.0
    slope2 = d2
    level = 0.0 * x + first_level
    alive = r2 < escape2
    for _ in range(iterations):
        if not any_of(alive):
            break
        d2 = where(alive, 4.0 * r2 * d2 + 4.0 * sqrt(r2 * d2) + 1.0, d2)
        slope2 = maximum(d2, slope2)
        level = where(alive, level + level, level)
        x, y = x * x - y * y + a, 2.0 * x * y + b
        r2 = where(alive, x * x + y * y, r2)
        orbit(r2, alive, x, y, 0.0 * x)
        alive = r2 < escape2
    return HALF * potential_distance(r2, slope2, level, first_level, last_level, least)


@tetrabrot.arguments
def tetrabrot_arguments(node: Node) -> dict[str, object]:
    first, last, least = levels(2, node["iterations"], BAILOUT)
    return {
        "iterations": node["iterations"],
        "first_level": first,
        "last_level": last,
        "escape2": stop(2, BAILOUT, ESCAPED) ** 2,
        "least": least,
    }


@tetrabrot.steepening
def tetrabrot_steepening(node: Node) -> float:
    return 2.0


@tetrabrot.bounds
def tetrabrot_bounds(node: Node) -> Box:
    """|c| is at most 2 in both planes: x + (y - z) i and x + (y + z) i."""
    return Box.centred(2.0)
