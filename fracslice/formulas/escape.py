"""What escape-time fractals have in common: from an orbit to a signed distance.

The solid of N iterations and bailout R is ``{p : |w_N(p)| <= R}``, exactly. A point whose orbit leaves a
larger circle E at step n < N would have ``log |w_N| = p^(N-n) log |w_n|``, p the power; that continues the
field through zero into the inside without any jump larger than 1e-4 of its value (E^p = 10^4). With the
potential ``G = log |w_n| / p^n`` the distance to the solid is about ``G / |G'|`` near it, and for the complex
quadratic maps at least ``(1 - exp(-2 G)) / (4 |G'|)`` (Koebe's 1/4 theorem, as in Milnor 2006, "Dynamics in
One Complex Variable", and Hart, Sandin, Kauffman 1989, "Ray Tracing Deterministic 3-D Fractals"). We return
``(G - G_0) / (|G'| (1 + 2 G))``, which is about the distance near the surface, never above twice that lower
bound, and needs no exponential.
"""

from __future__ import annotations

import math

from .vocabulary import inverse, log, maximum, minimum, rsqrt

JUMP = 1e4
"""E^p: how large |w| gets in the step past the escape circle; 1/JUMP is the relative jump of the field there.
"""

CORE = 0.5
"""The least |w|^2 that the derivative is taken at where a set falls apart.

Koebe's theorem wants a connected set. Where the critical point 0 escapes, the potential has critical points
outside the set, one at each preimage of 0; G' vanishes there and the quotient grows without limit. With D the
distance from w^2 + c to its set, that of w is at least sqrt(|w|^2 + D) - |w|. Where |w|^2 is small against D,
D / (2 |w|) overshoots it, and D / (2 sqrt(CORE)) does not.
"""


def potential_distance(r2, slope, level, first_level, last_level):  # type: ignore[no-untyped-def]
    """Signed distance estimate from an orbit's last radius.

    r2: |w|^2 where the orbit stopped. slope: the largest bound of the norm of the derivative of w along the
    orbit, at least 1. level: log R / p^(N-n), what log |w| would be on the surface; first_level and
    last_level: the same for n = 0 and n = N.

    The largest, not the last: inside, an attracting orbit lets the derivative decay and the quotient grow
    without limit. There ``0.1 / slope`` keeps it below the distance to the surface nearly always;
    deep sets have exceptions, so nothing may rely on it (`registry.Facts`).
    """
    r2 = minimum(maximum(r2, 1e-4), 1e30)
    slope = minimum(slope, 1e30)
    level = minimum(level, last_level)
    height = 0.5 * log(r2)
    damping = level + 2.0 * first_level * maximum(height, 0.0)
    over = inverse(slope * damping)
    return maximum((height - level) * level * r2 * rsqrt(r2) * over, -0.1 * damping * over)


def levels(power: float, iterations: int, bailout: float) -> tuple[float, float, float]:
    """first_level, final level log R, and E^2 for a formula of this power."""
    steps = min(iterations, int(30 / math.log10(power)))
    last = math.log(bailout)
    escape = max(bailout, JUMP ** (1 / power))
    return last / power**steps, last, escape * escape
