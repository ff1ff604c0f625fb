"""Escape-time fractals from their step."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from ..providers import provider
from .box import Box
from .parameters import AUTO, Count, Parameter, Vector
from .registry import Formula, Node, shape

Code = Growth = Any  # of `kernel.orbits`, a layer above
STEPS: dict[str, Callable[..., Any]] = {}
"""Steps of the orbits, by the name of their formula."""

OWN = {
    "iterations": Count(
        AUTO,
        'steps of the orbit; "auto": until one more moves most by less than 1/512 of the size',
        least=1,
        auto=True,
    ),
    "julia": Vector(
        None, "adds this point in each step instead of the start point: a Julia set", least=-100, most=100
    ),
}
"""Parameters of every orbit."""


def orbit(**parameters: Parameter) -> Callable[[Callable[..., Any]], Formula]:
    """Register the escape-time fractal of a step ``f(w, c, ...)``.

    The step returns the next point from the last one, w, and a constant c: the start point, or that of a
    Julia set. It is written with arithmetic on points, the verbs of `fracslice.formulas.verbs`, and on their
    coordinates, ``x, y, z = w``, with the vocabulary. A second returned value is its stretch by w, if the one
    derived from the text is not good enough. Everything else follows from the step: its derivative, the
    radius of escape, the box, the field, and the kernels.

    Parameters
    ----------
    **parameters : Parameter
        Kinds of the parameters by name; `Count` and `Choice` are compiled into the kernel.

    Returns
    -------
    callable
        Decorator that turns the step into a `Formula`.

    Raises
    ------
    SceneError
        If another formula has this name.
    """

    def decorate(step: Callable[..., Any]) -> Formula:
        formula = shape(lipschitz=2.0, exterior_only=True, **parameters, **OWN)(step)
        STEPS[formula.name] = step
        for hook in (
            orbit_bounds,
            orbit_arguments,
            orbit_select,
            orbit_steepening,
            orbit_potential,
            orbit_check,
        ):
            formula.hooks[hook.__name__.removeprefix("orbit_")] = hook
        return formula

    return decorate


def code(node: Node) -> Any:
    """`kernel.orbits.Code`: step of a node with the parameters that its code depends on."""
    own = {name: value for name, value in node.values.items() if name not in OWN}
    fixed = {name: value for name, value in own.items() if isinstance(value, (int, str))}
    sizes = {name: len(v) if isinstance(v, tuple) else 1 for name, v in own.items() if name not in fixed}
    return provider("orbits").Code(STEPS[node.formula.name], tuple(sizes.items()), tuple(fixed.items()))


def grown(node: Node) -> Any:
    """`kernel.orbits.Growth` of a node's orbits; raises `SceneError` if they do not escape."""
    made = code(node)
    values = tuple((name, node[name]) for name, _ in made.sizes)
    steps = 1 if node["iterations"] == AUTO else node["iterations"]
    found = provider("orbits").growth(made, values, node["julia"], steps)
    if found is None:
        raise node.fail("has orbits that do not escape: expected parameters that enlarge more")
    return found


def orbit_bounds(node: Node) -> Box:
    return Box.centred(*grown(node).half)


def orbit_arguments(node: Node) -> dict[str, object]:
    own = {f"v_{name}": node[name] for name, _ in code(node).sizes}
    values: dict[str, object] = provider("orbits").arguments(grown(node), node["iterations"], node["julia"])
    return {**values, **own}


def orbit_select(node: Node) -> Callable[..., Any]:
    found: Callable[..., Any] = provider("orbits").field(
        code(node), grown(node).by_power, node["julia"] is not None
    )
    return found


def orbit_steepening(node: Node) -> float:
    return max(2.0, float(grown(node).power))


def orbit_potential(node: Node) -> bool:
    """True if the field is that of a potential, far from its bound inside."""
    return bool(grown(node).by_power)


def orbit_check(node: Node) -> None:
    """Refuse parameters for which no orbit escapes."""
    grown(node)
