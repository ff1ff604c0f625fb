"""Relatives of the Mandelbrot set in three dimensions."""

from __future__ import annotations

from .orbits import orbit
from .parameters import Number
from .verbs import positive
from .verbs import power as raised
from .vocabulary import sqrt

POWER = Number(8.0, "the exponent", least=2, most=16)


@orbit()
def quaternion_mandelbrot(w, c):  # type: ignore[no-untyped-def]
    """The Mandelbrot set of q^2 + c in the quaternions, cut at k = 0 (Norton 1982).

    It is the complex Mandelbrot set turned about the real axis.
    """
    x, y, z = w
    return (x * x - y * y - z * z, 2.0 * x * y, 2.0 * x * z) + c, 2.0 * sqrt(x * x + y * y + z * z)


@orbit()
def bristorbrot(w, c):  # type: ignore[no-untyped-def]
    """The Bristorbrot (Bristor 2009, fractalforums.com)."""
    x, y, z = w
    return (x * x - y * y - z * z, y * (2.0 * x - z), z * (2.0 * x + y)) + c


@orbit(power=POWER)
def burning_ship(w, c, power):  # type: ignore[no-untyped-def]
    """The Mandelbulb of absolute coordinates, after Michelitsch and Roessler 1992, "The burning ship"."""
    return raised(positive(w), power) + c
