"""Variations of a scene: other numbers of its elements, within their ranges."""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np

from ..errors import FracsliceError, SceneError
from ..formulas import Node
from ..formulas.parameters import Count, Number, Vector
from .model import Scene

KEPT = {"material", "transform", "bounds"}
"""Elements that say how a solid looks and where it is, not what it is."""

OF_A_HYBRID, OF_A_STEP = {"iterations", "bailout"}, {"repeat"}
"""Parameters that a hybrid has for all of its steps, and those that a step alone has."""

TRIES, POINTS = 100, 4096


def varied(scene: Scene, seed: tuple[int, ...], spread: float) -> Scene:
    """Vary the numbers of a scene's elements.

    Parameters
    ----------
    scene : Scene
        The scene.
    seed : tuple of int
        Seed of the random numbers; equal seeds make equal scenes.
    spread : float
        Size of the changes: 1 multiplies or divides a number by 2 in a typical case.

    Returns
    -------
    Scene
        Scene with a solid in it; materials, transforms, boxes and the view are unchanged.

    Raises
    ------
    SceneError
        If no variation that was tried is another valid scene that holds a solid.
    """
    rng = np.random.default_rng(seed)
    for _ in range(TRIES):
        with suppress(FracsliceError, ArithmeticError):  # values that are valid alone but not together
            root = _node(scene.root, rng, spread)
            if root != scene.root and _holds_a_solid(root):
                return replace(scene, root=root)
    raise SceneError(f"{scene.name}: none of {TRIES} variations is valid: expected a smaller spread")


def _node(node: Node, rng: np.random.Generator, spread: float, step: bool = False) -> Node:
    """Varied node; `step` is True inside a hybrid."""
    hybrid = step or node.formula.name == "orbit"
    children = tuple(_node(child, rng, spread, hybrid) for child in node.children)
    if node.formula.name in KEPT:
        return node.changed(children)
    fixed = OF_A_HYBRID if step else OF_A_STEP
    kinds = {name: kind for name, kind in node.formula.parameters.items() if name not in fixed}
    return node.changed(
        children, **{name: _value(name, kind, node[name], rng, spread) for name, kind in kinds.items()}
    )


def _value(name: str, kind: Any, value: Any, rng: np.random.Generator, spread: float) -> Any:
    """Varied value of a parameter; words, automatic depths and values left out stay."""
    if value is None or isinstance(value, str):
        return value
    if isinstance(kind, Count):
        step = round(rng.normal() * spread * max(1.0, value / 4))
        return min(max(value + step, kind.least), kind.most)
    if isinstance(kind, Number):
        number = _number(kind, value, rng, spread)
        return float(round(number)) if name == "power" and value == round(value) else number
    if isinstance(kind, Vector) and not kind.whole:
        return tuple(_number(kind, v, rng, spread) for v in value)
    return value


def _number(kind: Number | Vector, value: float, rng: np.random.Generator, spread: float) -> float:
    """Number times a random power of two; near zero, moved. It stays within its range."""
    draw = float(rng.normal()) * spread
    moved = value * 2**draw if abs(value) > 1e-3 else value + 0.2 * draw
    low = kind.least if kind.least > kind.above else math.nextafter(kind.above, math.inf)
    high = kind.most if kind.most < kind.below else math.nextafter(kind.below, -math.inf)
    return float(f"{min(max(moved, low), high):.4g}")


def _holds_a_solid(root: Node) -> bool:
    """True if one of some random points in the box is inside."""
    box = root.bounds.box
    if not box.finite or box.empty:
        return False
    points = np.random.default_rng(0).uniform(box.lo, box.hi, (POINTS, 3))
    return bool((root.distance(points) < 0).any())
