"""Sign of an orbit's field, and a box around its inside proved by it."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any, cast

import numpy as np

from ..formulas.box import Box
from . import functions
from .enclosing_box import proved_half
from .growth import Growth, arguments, growth
from .interval_arrays import on_intervals
from .intervals import Interval
from .orbits import Round, sign


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
    radius = grown.surface * scales[-1]
    if any(scale**2 * stop < radius**2 for scale, stop in zip(scales, stops.values(), strict=True)):  # type: ignore[operator]
        return None
    scale = {"scale": scales[-1]} if grown.scaled else {}
    return {"iterations": iterations, "radius2": radius**2, **scale, **stops}


@lru_cache(maxsize=64)
def proved_box(steps: Round, values: tuple[tuple[str, Any], ...], iterations: int) -> Box:
    """Return a box that is proved to hold the inside of an orbit's field.

    Parameters
    ----------
    steps
        Steps of a round.
    values
        Values of the arguments of the steps.
    iterations
        Number of rounds.

    Returns
    -------
    Box
        The box of `growth`, larger where intervals leave doubt; at most that of the ball where orbits start.
    """
    grown = growth(steps, values, iterations)
    if grown is None:
        return Box.everywhere()
    known = arguments(steps, grown, iterations)
    radius = math.sqrt(cast("float", known[f"stop{len(steps) - 1}"]))
    signed = sign_arguments(steps, grown, iterations)
    if signed is None:
        return Box.centred(radius)
    enclosed, own = on_intervals(sign(steps, grown.scaled)), {**signed, **dict(values)}
    given = [own[name] for name in functions.parameters(enclosed)[3:]]

    def outside(*cells: Interval) -> Interval:
        with np.errstate(all="ignore"):
            return cast("Interval", enclosed(*cells, *given))

    return Box.centred(*proved_half(outside, radius, grown.half))
