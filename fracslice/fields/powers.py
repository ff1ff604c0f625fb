"""Powers of points: the triplex numbers of White and Nylander (2009), by products or in polar coordinates.

With w = (rho e^(i phi), z), w^n = (Im (z + i rho)^n e^(i n phi), Re (z + i rho)^n). The map stretches by
n r^(n-1) along meridians and by n |sin n theta / sin theta| r^(n-1) along circles of latitude.
"""

from __future__ import annotations

from typing import Any

from ..expr.functions import evaluated
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
from .escape import CORE

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
