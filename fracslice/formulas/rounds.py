"""Steps of an orbit's rounds as code, and the parameters of every orbit."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from ..providers import provider
from .algebra import inverse, product, stretches
from .parameters import AUTO, Count, Vector
from .registry import Fixed, Node
from .transforms import affine

Stepped = tuple[Callable[..., Any], dict[str, Any], tuple[float, ...] | None]
"""Step ``f(w, c, ...)``, the values of its other parameters, and its own constant or None."""

Affine = tuple[np.ndarray, np.ndarray]

REPEAT = Count(1, "times that the step is taken in each round of an <orbit>", least=1, most=8)
ITERATIONS = Count(
    AUTO,
    'steps of the orbit; "auto": until one more moves most by less than 1/512 of the size',
    least=1,
    words=(AUTO,),
)
JULIA = Vector(
    None, "adds this point in each step instead of the start point: a Julia set", least=-100, most=100
)
OWN = {"iterations": ITERATIONS, "julia": JULIA, "repeat": REPEAT}
"""Parameters of every orbit."""


def orbit_step(node: Node) -> Stepped:
    own = {name: value for name, value in node.values.items() if name not in OWN}
    values = {name: Fixed(v) if isinstance(v, (int, str)) else v for name, v in own.items()}
    return node.formula.function, values, node["julia"]


def taken(node: Node) -> Iterator[tuple[Node, Affine | None]]:
    """Steps of a round, and the maps of the transforms around them."""
    if not node.children:
        yield node, None
        return
    for child in node.children:
        inner, linear, offset = child, np.eye(3), np.zeros(3)
        while inner.formula.name == "transform" and len(inner.children) == 1:
            (a, b), inner = affine(inner), inner.children[0]
            linear, offset = product(linear, a), product(linear, b) + offset
        moved = (linear != np.eye(3)).any() or offset.any()
        for _ in range(inner.values.get("repeat", 1)):
            yield inner, (linear, offset) if moved else None


def _step(node: Node, alone: bool) -> Stepped:
    function, values, constant = node.formula.hooks["step"](node)
    only = node.formula.hooks.get("alone") if alone else None
    return function, {**values, **(only(node) if only else {})}, constant


def steps(node: Node, alone: bool = True) -> tuple[tuple[Any, ...], dict[str, Any]]:
    """Return the steps of a round as code, and the values of their arguments.

    Parameters
    ----------
    node : Node
        Orbit.
    alone : bool
        False for the step of a formula as in a hybrid.

    Returns
    -------
    (tuple of kernel.orbits.Code, dict)
        Steps in order; values by name.
    """
    code, codes, values = provider("orbits").Code, [], dict[str, Any]()
    for place, (step, moved) in enumerate(taken(node)):
        function, own, constant = _step(step, alone and step is node)
        fixed = tuple((name, v.value) for name, v in own.items() if isinstance(v, Fixed))
        passed = {name: v for name, v in own.items() if not isinstance(v, Fixed)}
        sizes = tuple((name, len(v) if isinstance(v, tuple) else 1) for name, v in passed.items())
        values |= {f"v{place}_{name}": v for name, v in passed.items()}
        if moved:
            linear, offset = moved
            undone, spread = inverse(linear), stretches(linear)
            values[f"back{place}"] = (*undone.ravel().tolist(), *(-product(undone, offset)).tolist())
            values[f"forth{place}"] = (*linear.ravel().tolist(), *offset.tolist())
            values |= {f"spread{place}": float(spread[0] / spread[-1]), f"shrink{place}": float(spread[-1])}
        if constant is None and node["julia"] is not None:
            point = np.array(node["julia"])
            constant = tuple((product(undone, point - offset) if moved else point).tolist())
        if constant is not None:
            values[f"c{place}"] = constant
        codes.append(code(function, sizes, fixed, constant is not None, moved is not None))
    return tuple(codes), values
