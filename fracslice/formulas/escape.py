"""What escape-time fractals have in common: from an orbit to a signed distance.

The solid of N iterations and bailout R is ``{p : |w_N(p)| <= R}``, exactly. A point whose orbit leaves a
larger circle E at step n < N would have ``log |w_N| = p^(N-n) log |w_n|``, p the power; that continues the
field through zero into the inside. log |w| jumps by about |c| / E^p where n changes.
With the potential ``G = log |w_n| / p^n`` the distance to the solid is about ``G / |G'|`` near it, and for
the complex quadratic maps at least ``(1 - exp(-2 G)) / (4 |G'|)`` (Koebe's 1/4 theorem, as in Milnor 2006,
"Dynamics in One Complex Variable", and Hart, Sandin, Kauffman 1989, "Ray Tracing Deterministic 3-D
Fractals"). We return ``(G - G_0) / (|G'| (1 + 2 G))``, which is about the distance near the surface, never
above twice that lower bound, and needs no exponential.
"""

from __future__ import annotations

import math

from .vocabulary import log, maximum, minimum, sqrt

CORE = 0.5
"""The least |w|^2 that the derivative is taken at where a set falls apart.

Koebe's theorem wants a connected set. Where the critical point 0 escapes, the potential has critical points
outside the set, one at each preimage of 0; G' vanishes there and the quotient grows without limit. With D the
distance from w^2 + c to its set, that of w is at least sqrt(|w|^2 + D) - |w|. Where |w|^2 is small against D,
D / (2 |w|) overshoots it, and D / (2 sqrt(CORE)) does not.
"""


def potential_distance(r2, slope2, level, first_level, last_level, least):  # type: ignore[no-untyped-def]
    """Signed distance estimate from an orbit's last radius.

    r2: |w|^2 where the orbit stopped. slope2: the square of the largest bound of the norm of the derivative
    of w along the orbit, at least 1. level: log R^2 / p^(N-n), what log |w|^2 would be on the surface;
    first_level and last_level: the same for n = 0 and n = N. least: below R^2, where r2 is cut off.

    The largest, not the last: inside, an attracting orbit lets the derivative decay and the quotient grow
    without limit. There r2 is cut off so that about ``0.1 / slope`` is left, which is below the distance to
    the surface nearly always; deep sets have exceptions, so nothing may rely on it (`registry.Bounds`).
    """
    r2 = minimum(maximum(r2, least), 1e30)
    level = minimum(level, last_level)
    height = log(r2)
    damping = (2.0 * first_level) * height + 2.0 * level
    quotient = maximum(sqrt(r2 / slope2), 1e-30)  # where slope2 has overflown, something to carry the sign
    return (height - level) * (level * quotient) / damping


def sure_distance(apart, slope, bend):  # type: ignore[no-untyped-def]
    """A radius around the start point within which the orbit's n-th point cannot have moved by `apart`.

    slope: a bound of the norm of the derivative of w_n there. bend: the sum over the steps k < n of
    ``slope_k (p - 1) / (2 |w_k|)``.

    w^p moves by at most ``(r + e)^p - r^p <= a e / (1 - b e)`` when w, |w| = r, moves by e < 1/b, with
    ``a = p r^(p-1)`` and ``b = (p - 1) / (2 r)``: term by term of the binomial series. Bounds of this form
    stay of this form under a further step and the addition of the start point: a is multiplied and bend
    grows by slope * b. So e is at least ``apart / (slope + bend * apart)``: the method of majorants (Cauchy
    1842). It needs no connected set, but is several times less than what the potential says of one.
    """
    apart = maximum(apart, 1e-30)
    return apart / minimum(slope + bend * apart, 1e30)


def levels(
    power: float, iterations: int, bailout: float, escaped: float
) -> tuple[float, float, float, float]:
    """first_level, last_level, E^2 and the least r2 for a formula of this power; E^power is `escaped`."""
    steps = min(iterations, int(30 / math.log10(power)))
    last = 2 * math.log(bailout)
    escape = max(bailout, escaped ** (1 / power))
    return last / power**steps, last, escape**2, bailout**2 * math.exp(-max(0.2 / bailout, 1e-4))


def farthest(power: float, bailout: float, constant: float) -> float:
    """How far from the origin the solid of any number of steps may reach, |constant| being added in each."""
    first = radius = (bailout + constant) ** (1 / power)
    for _ in range(100):
        radius = (radius + constant) ** (1 / power)
    return float(max(first, radius))
