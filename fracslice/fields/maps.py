"""Maps of space, which are the verbs of steps, powers of points, and the distance that an orbit gives.

The solid of N iterations and bailout R is ``{p : |w_N(p)| <= R}``, exactly. A point whose orbit leaves a
larger circle E at step n < N would have ``log |w_N| = p^(N-n) log |w_n|``, where p is the power. This
continues the field through zero into the inside. log |w| jumps by about |c| / E^p where n changes.

Let ``G = log |w_n| / p^n`` be the potential. The distance to the solid is about ``G / |G'|`` near it, and for
the complex quadratic maps at least ``(1 - exp(-2 G)) / (4 |G'|)`` (Koebe's 1/4 theorem, as in Milnor 2006,
"Dynamics in One Complex Variable", and Hart, Sandin, Kauffman 1989, "Ray Tracing Deterministic 3-D
Fractals"). The estimate is ``(G - G_0) / (|G'| (1 + 2 G))``: about the distance near the surface, never above
twice that lower bound, and free of exponentials.

With w = (rho e^(i phi), z), w^n = (Im (z + i rho)^n e^(i n phi), Re (z + i rho)^n). The map stretches by
n r^(n-1) along meridians and by n |sin n theta / sin theta| r^(n-1) along circles of latitude.

A verb takes a point w = (x, y, z) first and returns its image and its stretch: a bound of how far the images
of two points move apart, per distance of the points, near w. `over` gives the stretch over a ball around w,
which bounds the image of the whole ball. All are written in the language of formulas.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

from ..expr.language import evaluated
from ..expr.vocabulary import (
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

CORE = 0.5
"""Minimum |w|^2 at which the derivative of a disconnected set is taken.

Koebe's theorem requires a connected set. Where the critical point 0 escapes, the potential has critical
points outside the set, one at each preimage of 0; G' vanishes there and the quotient grows without limit. If
D is the distance from w^2 + c to its set, the distance of w is at least sqrt(|w|^2 + D) - |w|. Where |w|^2 is
small against D, D / (2 |w|) exceeds this bound, and D / (2 sqrt(CORE)) does not.
"""


def potential_distance(r2, slope2, level, first_level, last_level, least):  # type: ignore[no-untyped-def]
    """Signed distance estimate from the last radius of an orbit.

    The derivative bound is the largest along the orbit, not the last: inside, an attracting orbit lets the
    derivative decay and the quotient grow without limit. Clipping r2 leaves about ``0.1 / slope`` there. This
    is nearly always below the distance to the surface; deep sets have exceptions, so interior values bound
    nothing (`registry.Bounds`).

    `r2`: |w|^2 where the orbit stopped.
    """
    r2 = minimum(maximum(r2, least), 1e30)
    level = minimum(level, last_level)
    height = log(r2)
    damping = (2.0 * first_level) * height + 2.0 * level
    quotient = maximum(sqrt(r2 / slope2), 1e-30)  # not zero where slope2 overflows: it carries the sign
    return (height - level) * (level * quotient) / damping


def sure_distance(margin, slope, bend):  # type: ignore[no-untyped-def]
    """Radius around the start point within which the orbit's n-th point moves by less than `margin`.

    When w, |w| = r, moves by e < 1/b, w^p moves by at most ``(r + e)^p - r^p <= a e / (1 - b e)`` with
    ``a = p r^(p-1)`` and ``b = (p - 1) / (2 r)``, term by term of the binomial series. A further step and the
    addition of the start point keep this form: a is multiplied, and bend grows by slope * b. So e is at least
    ``margin / (slope + bend * margin)``: the method of majorants (Cauchy 1842). The bound holds for
    disconnected sets, too, but for connected ones it is several times less than that of the potential.
    """
    margin = maximum(margin, 1e-30)
    return margin / minimum(slope + bend * margin, 1e30)


def levels(power: float, iterations: int, bailout: float) -> tuple[float, float, float]:
    """Level parameters of an escape-time formula, as `potential_distance` takes them."""
    steps = min(iterations, int(30 / math.log10(power)))
    last = 2 * math.log(bailout)
    return last / power**steps, last, bailout**2 * math.exp(-max(0.2 / bailout, 1e-4))


def stop(power: float, bailout: float, escaped: float) -> float:
    """Radius where an orbit stops."""
    return float(max(bailout, escaped ** (1 / power)))


def enclosing_radius(power: float, bailout: float, steps: int, constant: float) -> float:
    """Bound of the radius of the solid of some steps: |w_n+1| >= |w_n|^power - |c| bounds |w_n|
    backwards.
    """
    radius = bailout
    for _ in range(steps):
        radius = (radius + constant) ** (1 / power)
    return float(radius)


def farthest(power: float, bailout: float, constant: float) -> float:
    """Bound of the solid's radius for any number of steps."""
    first = radius = (bailout + constant) ** (1 / power)
    for _ in range(100):
        radius = (radius + constant) ** (1 / power)
    return float(max(first, radius))


LARGEST = 32
"""Largest whole power by products."""


@evaluated
def products(n: float) -> tuple[Any, ...]:
    """Return the products of a whole power.

    `n`: power.
    """
    if not (2 <= n <= LARGEST and n % 1 == 0):
        return False, (), (), (), False, False
    whole = int(n)
    return True, _digits(whole), _digits(whole // 2), _digits((whole - 1) // 2), whole % 2 == 0, whole == 2


def _digits(n: int) -> tuple[int, ...]:
    """Binary digits of n after the first. Exponentiation squares for each and multiplies where it is 1."""
    return tuple(int(d) for d in bin(n)[3:])


def square(w):  # type: ignore[no-untyped-def]
    """Square in the quaternions without k."""
    x, y, z = w
    return (x * x - y * y - z * z, 2.0 * x * y, 2.0 * x * z), 2.0 * sqrt(x * x + y * y + z * z)


def square_majorant(w):  # type: ignore[no-untyped-def]
    """Bend of `square`: 2 r e + e^2 is at most 2 r e / (1 - e / (2 r))."""
    x, y, z = w
    return 0.5 * rsqrt(maximum(x * x + y * y + z * z, CORE)), 1e30


def square_length(r):  # type: ignore[no-untyped-def]
    return r * r


def triplex(w, n):  # type: ignore[no-untyped-def]
    """Image of a point, and its stretches along meridians and circles of latitude, divided by n."""
    whole, digits, turns, half_digits, even, linear = products(n)
    if whole:
        image, meridian, latitude = by_products(w, digits, turns, half_digits, even, linear)
    else:
        image, meridian, latitude = by_angles(w, n)
    return image, meridian, latitude


def by_products(w, digits, turns, half_digits, even, linear):  # type: ignore[no-untyped-def]
    """See `triplex`, for a whole power.

    Im (z + i rho)^n is carried divided by rho, so the poles are no special case. The real part of a square is
    2 re^2 minus the squared norm, which is known. The azimuth enters as u + iv = e^(2 i phi), which needs no
    root, to the power n/2; the remaining factor of rho e^(i n phi) is x + iy for odd n, else rho.
    """
    x, y, z = w
    across2 = x * x + y * y
    rho2 = maximum(across2, 1e-30)
    r2 = across2 + z * z
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
    if even:
        s = im * sqrt(rho2)
        image = (s * cu, s * cv, re)
    else:
        image = (im * (cu * x - cv * y), im * (cu * y + cv * x), re)
    return image, meridian, absolute(im)


def by_angles(w, n):  # type: ignore[no-untyped-def]
    """See `triplex`. Angles are counted from the nearer pole: rounding of those near pi is not small against
    rho.
    """
    x, y, z = w
    rho2 = maximum(x * x + y * y, 1e-30)
    r2 = maximum(rho2 + z * z, 1e-30)
    rho = sqrt(rho2)
    rn = exp(0.5 * n * log(r2))
    theta, phi = n * atan2(rho, absolute(z)), n * atan2(y, x)
    half_turns = floor(n + 0.5)
    sign = 1.0 - 2.0 * (half_turns - 2.0 * floor(0.5 * half_turns))
    rest = 3.141592653589793 * (n - half_turns)
    sine, cosine = sign * sin(rest), sign * cos(rest)
    s, c = sin(theta), cos(theta)
    s, c = where(z < 0.0, sine * c - cosine * s, s), where(z < 0.0, cosine * c + sine * s, c)
    return (rn * s * cos(phi), rn * s * sin(phi), rn * c), rn * rsqrt(r2), rn * absolute(s) / rho


def power(w, n):  # type: ignore[no-untyped-def]
    """Raise to a power in the triplex numbers (White and Nylander 2009)."""
    image, meridian, latitude = triplex(w, n)
    return image, n * maximum(meridian, latitude)


def power_over(w, e, n):  # type: ignore[no-untyped-def]
    """Stretch of `power` over a ball."""
    x, y, z = w
    far = sqrt(x * x + y * y + z * z) + e
    return n * n * exp((n - 1.0) * log(maximum(far, 1e-30)))


def power_majorant(w, n):  # type: ignore[no-untyped-def]
    """Bend of `power` (`escape.sure_distance`), and the distance to its tear: where n is not whole, the
    azimuth jumps from pi to -pi.
    """
    x, y, z = w
    whole, _, _, _, _, _ = products(n)
    if whole:  # noqa: SIM108
        tear = 1e30
    else:
        tear = where(x < 0.0, absolute(y), sqrt(maximum(x * x + y * y, 1e-30)))
    return 0.5 * (n - 1.0) * rsqrt(maximum(x * x + y * y + z * z, CORE)), tear


def power_length(r, n):  # type: ignore[no-untyped-def]
    """Length of the image of `power`."""
    whole, digits, _, _, _, _ = products(n)
    if whole:  # noqa: SIM108
        length = whole_power(r, digits)
    else:
        length = exp(n * log(maximum(r, 1e-30)))
    return length


def whole_power(r, digits):  # type: ignore[no-untyped-def]
    """Power of a number, from the binary digits of the exponent after the first."""
    power = r
    for odd in digits:
        power = power * power
        if odd:
            power = power * r
    return power


def calm_length(r, n, calm):  # type: ignore[no-untyped-def]
    """See `power_length`."""
    return power_length(r, n)


def calm_power(w, n, calm):  # type: ignore[no-untyped-def]
    """Power of a map w^n + c that stands alone: the stretch of circles of latitude is faded out far out.

    It counts as far out as a point of the solid can come (`escape.farthest`). Farther out, each step
    increases the radius in any direction, so only the radial stretch matters.
    """
    image, meridian, latitude = triplex(w, n)
    if calm:
        x, y, z = w
        fade, fading = calm
        latitude = latitude * minimum(1.0, fade - (x * x + y * y + z * z) * fading)
    return image, n * maximum(meridian, latitude)


def calm_majorant(w, n, calm):  # type: ignore[no-untyped-def]
    """See `power_majorant`."""
    return power_majorant(w, n)


OVER: dict[Callable[..., Any], Callable[..., Any]] = {power: power_over}
"""Stretch of each verb over the ball of radius e around a point: a function of the point, e and the verb's
other arguments.
"""

NAMES = ("ball", "fold", "fold_to", "inversion", "mirror", "modulo", "positive", "power", "turn")
"""Verbs whose arguments are points and numbers."""

MAJORANTS: dict[Callable[..., Any], Callable[..., Any]] = {
    power: power_majorant,
    calm_power: calm_majorant,
    square: square_majorant,
}
"""Bend (`escape.sure_distance`) and distance to the tear of each verb that has a majorant: a function of the
verb's arguments.
"""

LENGTHS: dict[Callable[..., Any], Callable[..., Any]] = {
    power: power_length,
    calm_power: calm_length,
    square: square_length,
}
"""Length of the image, for verbs where it depends on that of the point alone: a function of the length and of
the verb's other arguments.
"""

Verb = Callable[..., Any]


def over(verb: Verb) -> Callable[[Verb], Verb]:
    """Decorate the stretch of a verb over a ball."""

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


def ball_majorant(w, inner):  # type: ignore[no-untyped-def]
    """Inwards from r <= 1, the stretch 1 / s^2 adds up to (1 / r^2) e / (1 - e / r)."""
    x, y, z = w
    return ratio(1.0, maximum(minimum(sqrt(x * x + y * y + z * z), 1.0), inner)), 1e30


def ball_length(r, inner):  # type: ignore[no-untyped-def]
    return maximum(ratio(r, maximum(r * r, inner * inner)), r)


MAJORANTS[ball], LENGTHS[ball] = ball_majorant, ball_length


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


CENTRAL = frozenset({mirror, positive, turn})
"""Verbs that keep the length."""

RIGID = frozenset({fold, fold_to, mirror, positive, turn})
"""Verbs that neither stretch, bend nor tear."""
