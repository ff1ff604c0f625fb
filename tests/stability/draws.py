"""Scenes with other numbers: every parameter of every element drawn again from its declared range."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from fracslice.common.parameters import AUTO, Count, Number, Vector
from fracslice.errors import FracsliceError
from fracslice.formulas import Node

DEEPEST = 12
"""Depths beyond it change nothing that a grid can show."""

TRIES = 200


def drawn(root: Node, rng: np.random.Generator, spread: float = 1.0) -> Node:
    """The scene with other parameters.

    Where a range has two ends, half of the time anywhere in it (evenly in the logarithm if it spans decades);
    else up to 2^spread times larger or smaller, or near zero where it was zero. What its formulas refuse
    together is drawn again.
    """
    for _ in range(TRIES):
        try:
            result = _drawn(root, rng, spread)
            _ = [(node.bounds, node.changed(**_known(node)).arguments) for node in result.walk()]
            return result
        except (FracsliceError, ArithmeticError):
            continue
    raise AssertionError(f"{root}: no other parameters are possible")


def torn(root: Node) -> bool:
    """Whether a power in it is not whole: it tears space, and no bound holds across the tear."""
    return any(node.values.get("power", 0.0) % 1 for node in root.walk())


def _known(node: Node) -> dict[str, int]:
    return {name: 1 for name, value in node.values.items() if isinstance(value, str) and value == AUTO}


def _drawn(node: Node, rng: np.random.Generator, spread: float) -> Node:
    values = {
        name: _value(kind, node[name], rng, spread)
        for name, kind in node.formula.parameters.items()
        if node[name] is not None and node.formula.name != "material"
    }
    return node.changed(tuple(_drawn(child, rng, spread) for child in node.children), **values)


def _value(kind: Any, value: Any, rng: np.random.Generator, spread: float) -> Any:
    if isinstance(kind, Count):
        return value if value == AUTO else int(rng.integers(kind.least, min(kind.most, DEEPEST) + 1))
    if isinstance(kind, Number):
        return number(kind, value, rng, spread)
    if isinstance(kind, Vector):
        if kind.whole:
            return tuple(int(rng.integers(1, 5)) if v else 0 for v in value)
        return tuple(number(kind, v, rng, spread) for v in value)
    return value


def number(kind: Number | Vector, value: float, rng: np.random.Generator, spread: float) -> float:
    low, high = max(kind.above, kind.least), min(kind.below, kind.most)
    if math.isfinite(low) and math.isfinite(high) and rng.uniform() < 0.5:
        if low > 0 and high > 100 * low:
            anywhere = low * (high / low) ** rng.uniform()
        else:
            anywhere = rng.uniform(low, high)
        return float(round(anywhere) if float(value).is_integer() else anywhere)
    if value == 0:
        return float(max(low, rng.normal() * 0.2 * spread))
    return float(value * 2 ** rng.uniform(-spread, spread))
