"""Orbits of power maps w -> m(w) + c with |m(w)| = |w|^n: what follows from the power.

|w_n+1| >= |w_n|^n - |c| bounds the solid from outside. For |w| >= |c| and |w|^(n-1) > 2, |w| grows with each
step, so no orbit comes back from beyond 2. The one critical point of these maps is 0.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import lru_cache
from typing import Any

from ..providers import provider
from .escape import enclosing_radius, farthest, stop
from .orbits import Stepped, orbit_step, rounds, steps
from .powers import products
from .registry import Fixed, Node

ESCAPED = 1e4
"""|w| one step past the radius where an orbit stops."""

BAILOUT = 2.0
"""Radius of the surface where a formula has no parameter for it."""

CALM = 3.0
"""Value of |w|^2, relative to that of the farthest point of the solid, from which only the radial stretch
counts. A smaller value costs fewer evaluations, but makes the level sets steeper that seams lie on.
"""


def products_step(node: Node) -> Stepped:
    """Return the step of an orbit with a `power`: a whole one is a constant of its code."""
    function, values, julia = orbit_step(node)
    power = node["power"]
    return function, {**values, "power": Fixed(power) if products(power)[0] else power}, julia


def power_step(node: Node) -> Stepped:
    """Return the step of a power map, with the stretch for hybrids."""
    function, values, julia = products_step(node)
    values.pop("bailout", None)
    return function, {**values, "calm": Fixed(())}, julia


def power_alone(node: Node) -> dict[str, Any]:
    """Return the argument of `powers.calm_power` of an orbit that is no hybrid."""
    if not _is_connected(node):
        return {}
    reach, escape = _reach(node), stop(node["power"], _bailout(node), ESCAPED)
    fading = 1 / (min(CALM * reach**2, escape**2) - reach**2)
    return {"calm": (1 + reach**2 * fading, fading)}


def power_growth(node: Node) -> dict[str, Any]:
    """Return the attributes of `kernel.growth.Growth`."""
    return {
        "powers": (float(node["power"]),),
        "factors": (0.0,),
        "escapes": (_bailout(node),),
        "half": (_radius(node),) * 3,
        "proved": _bailout(node) ** (node["power"] - 1) >= 2,
        "least": 1.0,
        "stopped": ESCAPED,
        "connected": _is_connected(node),
        "reach": _reach(node),
    }


HOOKS: dict[str, Callable[..., Any]] = {"step": power_step, "alone": power_alone, "growth": power_growth}


def _bailout(node: Node) -> float:
    return float(node.values.get("bailout", BAILOUT))


def _radius(node: Node) -> float:
    """Radius of the solid."""
    power, bailout, count = node["power"], _bailout(node), min(rounds(node), 60)
    if node["julia"]:
        return enclosing_radius(power, bailout, count, math.hypot(*node["julia"]))
    return _own_radius(power, bailout, count)


@lru_cache(maxsize=256)
def _own_radius(power: float, bailout: float, count: int) -> float:
    """Radius of the solid whose constant is the start point: its own bound is iterated from above."""
    radius = bailout + ESCAPED
    for _ in range(100):
        radius = enclosing_radius(power, bailout, count, radius)
    return radius


def _reach(node: Node) -> float:
    """Radius of the solids of all numbers of steps."""
    constant = math.hypot(*node["julia"]) if node["julia"] else _radius(node)
    return farthest(node["power"], _bailout(node), constant)


def _is_connected(node: Node) -> bool:
    """True if the critical point 0 is inside; if not, the set of one constant is disconnected."""
    if not node["julia"]:
        return True
    bailout, (code, values) = _bailout(node), steps(node, alone=False)
    outer = stop(node["power"], bailout, ESCAPED)
    stays: bool = provider("orbit_samples").stays(code, values, rounds(node), bailout, outer)
    return stays
