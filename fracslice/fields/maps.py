"""Maps of space, the verbs of steps.

A verb takes a point w = (x, y, z) first and returns its image and its stretch: a bound of how far the images
of two points move apart, per distance of the points, near w. `over` gives the stretch over a ball around w,
which bounds the image of the whole ball. All are written in the language of formulas.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from ..expr.vocabulary import absolute, cos, floor, maximum, minimum, ratio, sin, sqrt
from .powers import (
    calm_length,
    calm_majorant,
    calm_power,
    power,
    power_length,
    power_majorant,
    power_over,
    square,
    square_length,
    square_majorant,
)

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
