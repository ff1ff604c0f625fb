"""The Mandelbrot set of the bicomplex numbers."""

from __future__ import annotations

from .box import Box
from .escape import levels, potential_distance, stop
from .julia import ESCAPED
from .orbits import ITERATIONS
from .registry import Node, shape
from .vocabulary import any_of, maximum, orbit, sqrt, where

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
