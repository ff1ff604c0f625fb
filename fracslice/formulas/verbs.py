"""Verbs of orbit steps: maps of space with their stretch.

A verb takes a point w = (x, y, z) first and returns its image and its stretch: a bound of how far the images
of two points move apart, per distance of the points, near w. `over` gives the stretch over a ball around w,
which bounds the image of the whole ball. All are written in the language of formulas.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from .registry import Fixed
from .vocabulary import (
    absolute,
    atan2,
    cos,
    exp,
    floor,
    log,
    maximum,
    minimum,
    ratio,
    rsqrt,
    sin,
    sqrt,
    where,
)

OVER: dict[Callable[..., Any], Callable[..., Any]] = {}
"""Stretch of each verb over the ball of radius e around a point: a function of the point, e and the verb's
other arguments.
"""

NAMES = ("ball", "fold", "fold_to", "inversion", "mirror", "modulo", "positive", "power", "turn")
"""Verbs whose arguments are points and numbers."""

Verb = Callable[..., Any]


def over(verb: Verb) -> Callable[[Verb], Verb]:
    """Decorate the stretch of a verb over a ball.

    Parameters
    ----------
    verb : callable
        The verb.

    Returns
    -------
    callable
        Decorator that returns the function itself.
    """

    def decorate(function: Verb) -> Verb:
        OVER[verb] = function
        return function

    return decorate


def fold(w, limit):  # type: ignore[no-untyped-def]
    """Reflect every coordinate beyond the limit back (Lowe 2010, "What is a Mandelbox?")."""
    x, y, z = w
    image = (
        2.0 * minimum(maximum(x, -limit), limit) - x,
        2.0 * minimum(maximum(y, -limit), limit) - y,
        2.0 * minimum(maximum(z, -limit), limit) - z,
    )
    return image, 1.0


def fold_to(w, size):  # type: ignore[no-untyped-def]
    """Reflect every coordinate beyond its own limit back."""
    x, y, z = w
    a, b, c = size
    image = (
        2.0 * minimum(maximum(x, -a), a) - x,
        2.0 * minimum(maximum(y, -b), b) - y,
        2.0 * minimum(maximum(z, -c), c) - z,
    )
    return image, 1.0


def ball(w, inner):  # type: ignore[no-untyped-def]
    """Invert in the unit sphere what is inside it; within the inner radius scale instead (Lowe 2010)."""
    x, y, z = w
    k = maximum(ratio(1.0, maximum(x * x + y * y + z * z, inner * inner)), 1.0)
    return (k * x, k * y, k * z), k


@over(ball)
def ball_over(w, e, inner):  # type: ignore[no-untyped-def]
    x, y, z = w
    near = maximum(sqrt(x * x + y * y + z * z) - e, inner)
    return maximum(ratio(1.0, near * near), 1.0)


def inversion(w, radius):  # type: ignore[no-untyped-def]
    """Invert in the sphere of this radius around the origin."""
    x, y, z = w
    k = radius * radius * ratio(1.0, maximum(x * x + y * y + z * z, 1e-12))
    return (k * x, k * y, k * z), k


@over(inversion)
def inversion_over(w, e, radius):  # type: ignore[no-untyped-def]
    x, y, z = w
    near = maximum(sqrt(x * x + y * y + z * z) - e, 1e-6)
    return radius * radius * ratio(1.0, near * near)


def mirror(w, normal):  # type: ignore[no-untyped-def]
    """Reflect the points behind a plane through the origin to its front; the normal has any length."""
    x, y, z = w
    a, b, c = normal
    s = 2.0 / (a * a + b * b + c * c) * minimum(a * x + b * y + c * z, 0.0)
    return (x - s * a, y - s * b, z - s * c), 1.0


def positive(w):  # type: ignore[no-untyped-def]
    """Reflect into the octant of positive coordinates."""
    x, y, z = w
    return (absolute(x), absolute(y), absolute(z)), 1.0


def turn(w, axis, degrees):  # type: ignore[no-untyped-def]
    """Rotate about an axis of length 1, by Rodrigues' formula."""
    x, y, z = w
    a, b, c = axis
    cosine, sine = cos(degrees * 0.017453292519943295), sin(degrees * 0.017453292519943295)
    u, v, s = (1.0 - cosine) * a, (1.0 - cosine) * b, (1.0 - cosine) * c
    image = (
        (cosine + u * a) * x + (u * b - sine * c) * y + (u * c + sine * b) * z,
        (u * b + sine * c) * x + (cosine + v * b) * y + (v * c - sine * a) * z,
        (u * c - sine * b) * x + (v * c + sine * a) * y + (cosine + s * c) * z,
    )
    return image, 1.0


def modulo(w, period):  # type: ignore[no-untyped-def]
    """Move by whole periods along each axis into the cube around the origin.

    The map tears space at the faces of the cubes.
    """
    x, y, z = w
    image = (
        x - period * floor(x / period + 0.5),
        y - period * floor(y / period + 0.5),
        z - period * floor(z / period + 0.5),
    )
    return image, 1.0


def power(w, n):  # type: ignore[no-untyped-def]
    """Raise to a power in the triplex numbers of White and Nylander (2009).

    Lengths along meridians grow by n r^(n-1), along circles of latitude by r^(n-1) |sin n theta / sin theta|.
    """
    x, y, z = w
    rho2 = maximum(x * x + y * y, 1e-30)
    r2 = maximum(rho2 + z * z, 1e-30)
    rho = sqrt(rho2)
    rn = exp(0.5 * n * log(r2))
    theta, phi = n * atan2(rho, absolute(z)), n * atan2(y, x)
    # Angles are counted from the nearer pole: rounding of those near pi is not small against rho.
    half_turns = floor(n + 0.5)
    sign = 1.0 - 2.0 * (half_turns - 2.0 * floor(0.5 * half_turns))
    rest = 3.141592653589793 * (n - half_turns)
    sine, cosine = sign * sin(rest), sign * cos(rest)
    s, c = sin(theta), cos(theta)
    s, c = where(z < 0.0, sine * c - cosine * s, s), where(z < 0.0, cosine * c + sine * s, c)
    stretch = n * maximum(rn * rsqrt(r2), rn * absolute(s) / rho)
    return (rn * s * cos(phi), rn * s * sin(phi), rn * c), stretch


@over(power)
def power_over(w, e, n):  # type: ignore[no-untyped-def]
    x, y, z = w
    far = sqrt(x * x + y * y + z * z) + e
    return n * n * exp((n - 1.0) * log(maximum(far, 1e-30)))


def raise_whole(w, digits, turns, half_digits, even, linear, n):  # type: ignore[no-untyped-def]
    """Raise to a whole power in the triplex numbers by products, see `mandelbulb`.

    Compiled into the code are the binary digits of n, n // 2 and (n - 1) // 2 after the first, and whether n
    is even or 2.
    """
    x, y, z = w
    rho2 = maximum(x * x + y * y, 1e-30)
    r2 = rho2 + z * z
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
    stretch = n * maximum(meridian, absolute(im))
    if even:
        s = im * sqrt(rho2)
        image = (s * cu, s * cv, re)
    else:
        image = (im * (cu * x - cv * y), im * (cu * y + cv * x), re)
    return image, stretch


def products(power: float) -> dict[str, Fixed]:
    """Arguments of `raise_whole` for a power; those of a fractional one make no products.

    Parameters
    ----------
    power : float
        The power.

    Returns
    -------
    dict
        Fixed arguments by name.
    """
    whole = power == int(power)
    n = int(power) if whole else 2
    return {
        "digits": Fixed(_digits(n) if whole else ()),
        "turns": Fixed(_digits(n // 2)),
        "half_digits": Fixed(_digits((n - 1) // 2)),
        "even": Fixed(n % 2 == 0),
        "linear": Fixed(n == 2),
    }


def _digits(n: int) -> tuple[int, ...]:
    """Binary digits of n after the first. Exponentiation squares for each and multiplies where it is 1."""
    return tuple(int(d) for d in bin(n)[3:])
