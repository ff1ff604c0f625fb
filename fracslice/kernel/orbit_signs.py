"""Sign of an orbit's field, written from its steps, and a box around its inside proved by it."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache
from itertools import accumulate, islice
from operator import mul
from typing import Any, cast

import numpy as np

from ..formulas.box import Box
from ..formulas.escape import levels
from . import functions
from .enclosing_box import proved_half
from .growth import Growth, arguments
from .interval_arrays import on_intervals
from .intervals import Interval
from .orbits import R2, Code, Round, indented, mapped, written

FARTHEST = 1e15
"""Radius from which a ball is not used: intervals do not hold the squares of its points (`intervals`)."""

MIDDLE = [f"m{v} = cell_middle({v})" for v in "xyz"]
REACH = [*(f"e{v} = cell_extent({v})" for v in "xyz"), "reach = sqrt(ex * ex + ey * ey + ez * ez)"]


def sign(steps: Round, scaled: bool) -> Callable[..., Any]:
    """Write the function of ``|w_N|^2 - R^2`` where an orbit does not stop before, else of 1.

    Of a cell, it follows a box and a ball around the image of its middle; each holds the images of all
    points. The ball grows by the stretch over the box, where intervals of folds and turns grow with each sum.

    Parameters
    ----------
    steps
        Steps of a round.
    scaled
        True if R is that of ``scale |w|``.

    Returns
    -------
    Callable
        Function in the language of formulas.

    Raises
    ------
    KernelError
        If a step is not in the language.
    """
    return _sign(steps, scaled, tuple(functions.fingerprint(code.step) for code in steps))


@lru_cache(maxsize=256)
def _sign(steps: Round, scaled: bool, _: object) -> Callable[..., Any]:
    given, setup, loop = [], [], []
    for place, code in enumerate(steps):
        given += [*code.arguments(place), f"stop{place}"]
        setup += code.before(place, ("x", "y", "z"))
        loop += [*_in_ball(code, place), *([R2] if code.traced(place).length is None else []), *_BETWEEN]
        loop += [f"alive = alive & (r2 < stop{place})"]
    body = [
        *setup,
        *[*MIDDLE, *REACH, "px, py, pz, size = mx, my, mz, reach", f"held = reach < {FARTHEST}"],
        R2,
        f"alive = r2 < stop{len(steps) - 1}",
        "for _ in range(iterations):",
        *indented(["if not any_of(alive):", "    break", *loop]),
        f"return where(alive, {'scale * scale * ' if scaled else ''}r2 - radius2, 1.0 + 0.0 * r2)",
    ]
    own = ["scale", "radius2"] if scaled else ["radius2"]
    return written(steps, ["x", "y", "z", "iterations", *own, *given], body)


_BETWEEN = [
    "size2 = mx * mx + my * my + mz * mz",
    "near, far = maximum(sqrt(size2) - reach, 0.0), sqrt(size2) + reach",
    "r2 = where(held, maximum(minimum(r2, far * far), near * near), r2)",
]
"""Lines that bound |w|^2 by the ball."""


def _in_ball(code: Code, place: int) -> list[str]:
    """Lines that take a box to its image, within the image of a ball around its middle.

    The ball grows by the stretch over the box. Steps that may tear space, or hold the start point in another
    place than a sum, begin with the ball around the box again.
    """
    step = code.traced(place)
    if step.is_torn or not (step.is_added or code.is_fixed(place)):
        return [*code.boxed(place), *MIDDLE, *REACH]
    own, spread = f"cx{place}, cy{place}, cz{place}", f"spread{place} * " if code.moved else ""
    moves = not code.is_fixed(place)
    there = ", ".join(mapped(f"back{place}", ("px", "py", "pz"))) if code.moved else "px, py, pz"
    grown = (
        f"({step.stretch[0]} * reach + {step.stretch[1]} * size)" if moves else f"({step.stretch[0]} * reach)"
    )
    return [
        *([f"hx, hy, hz = {own}", f"{own} = {there}"] if moves else []),
        *["bx, by, bz = x, y, z", "x, y, z = mx, my, mz", *code.image(place)],
        *["mx, my, mz = x, y, z", "x, y, z = bx, by, bz"],
        *([f"{own} = hx, hy, hz"] if moves else []),
        *code.boxed(place, [f"reach = {spread}{grown}"]),
        f"held = held & (reach < {FARTHEST})",
        *(f"{v} = where(held, maximum(minimum({v}, m{v} + reach), m{v} - reach), {v})" for v in "xyz"),
    ]


def sign_arguments(steps: Round, grown: Growth, iterations: int) -> dict[str, object] | None:
    """Return the arguments of the sign of an orbit's field, besides those of its steps.

    Parameters
    ----------
    steps
        Steps of a round.
    grown
        Growth of the orbit.
    iterations
        Number of rounds.

    Returns
    -------
    dict or None
        Values by name; None if an orbit that stops within a round may end inside.
    """
    own = arguments(steps, grown, iterations)
    stops = {name: value for name, value in own.items() if name.startswith("stop")}
    scales = grown.scales if grown.scaled else (1.0,) * len(steps)
    radius, outside = grown.surface * scales[-1], _outside(grown, iterations)
    sizes = (scale**2 * cast("float", stop) for scale, stop in zip(scales, stops.values(), strict=True))
    if any(size < least for size, least in zip(sizes, outside, strict=True)):
        return None
    scale = {"scale": scales[-1]} if grown.scaled else {}
    return {"iterations": iterations, "radius2": radius**2, **scale, **stops}


def _outside(grown: Growth, iterations: int) -> list[float]:
    """Return the square of the scaled |w| after each step of the last round beyond which the field is
    positive: ``log |w|^2`` is compared with the level, which grows by the power of each step.
    """
    radius = grown.surface * (grown.scales[-1] if grown.scaled else 1.0)
    if not grown.by_power:
        return [radius**2] * len(grown.powers)
    first, last, _ = levels(grown.power, iterations, radius)
    rounds = min(iterations - 1, int(30 / math.log10(grown.power)))
    reached = accumulate(grown.powers, mul, initial=first * grown.power**rounds)
    return [math.exp(min(level, last)) for level in islice(reached, 1, None)]


@lru_cache(maxsize=64)
def proved_box(steps: Round, values: tuple[tuple[str, Any], ...], grown: Growth, iterations: int) -> Box:
    """Return a box that is proved to hold the inside of an orbit's field.

    Parameters
    ----------
    steps
        Steps of a round.
    values
        Values of the arguments of the steps.
    grown
        Growth of the orbit.
    iterations
        Number of rounds.

    Returns
    -------
    Box
        The box of `growth`, larger where intervals leave doubt; at most that of the ball where orbits start.
    """
    known = arguments(steps, grown, iterations)
    radius = math.sqrt(cast("float", known[f"stop{len(steps) - 1}"]))
    if grown.proved and grown.by_power:  # for constants as long as the start point, too
        radius = min(radius, grown.surface)
    signed = sign_arguments(steps, grown, iterations)
    if signed is None:
        return Box.centred(radius)
    enclosed, own = on_intervals(sign(steps, grown.scaled)), {**signed, **dict(values)}
    given = [own[name] for name in functions.parameters(enclosed)[3:]]

    def outside(*cells: Interval) -> Interval:
        with np.errstate(all="ignore"):
            return cast("Interval", enclosed(*cells, *given))

    return Box.centred(*proved_half(outside, radius, grown.half))
