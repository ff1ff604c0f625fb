"""Escape-time fractals: signed distance from an orbit.

The solid of N iterations and bailout R is ``{p : |w_N(p)| <= R}``, exactly. A point whose orbit leaves a
larger circle E at step n < N would have ``log |w_N| = p^(N-n) log |w_n|``, where p is the power. This
continues the field through zero into the inside. log |w| jumps by about |c| / E^p where n changes.

Let ``G = log |w_n| / p^n`` be the potential. The distance to the solid is about ``G / |G'|`` near it, and for
the complex quadratic maps at least ``(1 - exp(-2 G)) / (4 |G'|)`` (Koebe's 1/4 theorem, as in Milnor 2006,
"Dynamics in One Complex Variable", and Hart, Sandin, Kauffman 1989, "Ray Tracing Deterministic 3-D
Fractals"). The estimate is ``(G - G_0) / (|G'| (1 + 2 G))``: about the distance near the surface, never above
twice that lower bound, and free of exponentials.
"""

from __future__ import annotations

import math

from ..expr.vocabulary import log, maximum, minimum, sqrt

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
