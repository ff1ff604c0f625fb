"""Random valid scenes, made from the registry: every formula, transforms, cuts, seams, folds and bends."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np

from fracslice.common.parameters import AUTO, REQUIRED, Axis, Choice, Count, Number, Vector
from fracslice.errors import FracsliceError
from fracslice.fields.devices import reference
from fracslice.formulas import Formula, Node, bounds, orbit
from fracslice.scene.layout import formulas
from tests.examples import OF_FILES

from .draws import number
from .random_hybrids import hybrid

DEPTH = 4
DEEPEST = {"iterations": 20, "level": 4}
"""Depths beyond these are thinner than the voxels of a small grid."""

SHALLOW = 6
"""For a first look, where a depth is automatic."""

ORBITS = {f.name for f in formulas() if "step" in f.hooks} - {"mandelbulb", "julia"}

LOOKED = 4000
TREES, TRIES = 100, 10
LEAVES = [f for f in formulas() if f.kind == "shape" and f.name not in OF_FILES]
"""Shapes that numbers make."""
OTHERS = [f for f in formulas() if f.kind != "shape" and f.name not in OF_FILES | {"material", "preimage"}]
"""Elements with others in them, whatever those are; a preimage begins with a fractal."""
Draw = Callable[[np.random.Generator, float], Any]


@dataclass(frozen=True)
class _Dice:
    """tree: what decides which code is needed. numbers: the rest."""

    tree: np.random.Generator
    numbers: np.random.Generator


def random_scene(tree: int, numbers: int) -> Node:
    """A scene one to four elements deep with something in it; always the same for the same two seeds.

    Scenes of one tree differ in their numbers alone and need little to be compiled, if they are possible.
    """
    for attempt in range(TREES):
        for again in range(TRIES):
            dice = _Dice(
                np.random.default_rng((tree, attempt)), np.random.default_rng((tree, attempt, numbers, again))
            )
            with suppress(FracsliceError):  # values that are possible alone but not together
                root = _ended(_tree(dice, int(dice.tree.integers(1, DEPTH + 1))))
                if _inside(root):
                    return root
    raise AssertionError(f"tree {tree}: no scene is possible")


def leaf(formula: Formula, rng: np.random.Generator) -> Node | None:
    """A shape with something in it; None if the values drawn are not possible together."""
    with suppress(FracsliceError):
        root = _ended(_leaf(formula, _Dice(rng, rng)))
        return root if _inside(root) else None
    return None


def _ended(root: Node) -> Node:
    """The scene, cut off where it has no end."""
    return root if root.bounds.box.finite else bounds(root, min=(-1.1, -1.0, -0.9), max=(1.0, 1.2, 0.8))


def _inside(root: Node) -> bool:
    """Whether a point of some at random is inside."""
    known = _shallow(root)
    lo, hi = (np.array(corner)[:, None] for corner in (known.bounds.box.lo, known.bounds.box.hi))
    points = np.random.default_rng(0).uniform(lo, np.maximum(lo, hi), (3, LOOKED))
    return bool((reference(known)(*points) < 0).any())


def _shallow(node: Node) -> Node:
    if node.formula is orbit:  # its depth is drawn
        return node
    values = {name: SHALLOW for name, value in node.values.items() if value == AUTO}
    return node.changed(tuple(map(_shallow, node.children)), **values)


def _tree(dice: _Dice, depth: int) -> Node:
    if depth == 1:
        return _leaf(LEAVES[dice.tree.integers(len(LEAVES))], dice)
    formula = OTHERS[dice.tree.integers(len(OTHERS))]
    most = formula.children[1] or 3
    count = int(dice.tree.integers(min(2, most), most + 1))
    depths = [depth - 1, *dice.tree.integers(1, depth, count - 1).tolist()]
    return _made(formula, tuple(_tree(dice, d) for d in depths), dice)


def _leaf(formula: Formula, dice: _Dice) -> Node:
    return _made(formula, (), dice) if formula is not orbit else hybrid(dice.tree)


def _made(formula: Formula, children: tuple[Node, ...], dice: _Dice) -> Node:
    size = max(children[0].bounds.box.size) if children else 1.0
    size = size if np.isfinite(size) and size > 0 else 2.0
    known = KNOWN.get(formula.name, {})
    values = {
        name: known[name](dice.numbers, size) if name in known else _value(name, kind, dice)
        for name, kind in formula.parameters.items()
    }
    return formula(*children, **{name: value for name, value in values.items() if value is not None})


def _value(name: str, kind: Any, dice: _Dice) -> Any:
    """A value near a parameter's default or anywhere in its range; None where there is no default."""
    if isinstance(kind, Count):
        least = max(kind.least, 1)
        fixed = int(dice.numbers.integers(least, max(least, min(kind.most, DEEPEST.get(name, 4))) + 1))
        return AUTO if kind.words and dice.tree.uniform() < 0.5 else fixed
    if isinstance(kind, Axis):
        return "xyz"[dice.tree.integers(3)]
    if isinstance(kind, Choice):
        return kind.choices[dice.tree.integers(len(kind.choices))]
    if kind.default is REQUIRED or kind.default is None:
        return None
    if isinstance(kind, Number):
        random = dice.tree if name == "power" else dice.numbers
        result = number(kind, kind.default, random, 1.0)
        return float(round(result)) if name == "power" and dice.tree.uniform() < 0.7 else result
    assert isinstance(kind, Vector)
    return tuple(number(kind, v, dice.numbers, 1.0) for v in kind.default)


def _vector(low: float, high: float, scaled: bool = True) -> Draw:
    return lambda rng, size: tuple((rng.uniform(low, high, 3) * (size if scaled else 1.0)).tolist())


def _one(low: float, high: float, scaled: bool = True) -> Draw:
    return lambda rng, size: float(rng.uniform(low, high) * (size if scaled else 1.0))


def _sometimes(draw: Draw, chance: float = 0.5) -> Draw:
    return lambda rng, size: draw(rng, size) if rng.uniform() < chance else None


def _turn(rng: np.random.Generator, _: float) -> tuple[float, ...]:
    return (*rng.normal(size=3).tolist(), float(rng.uniform(0, 360)))


def _scale(rng: np.random.Generator, _: float) -> tuple[float, ...]:
    return tuple((2 ** rng.uniform(-1, 1, rng.choice((1, 3)))).tolist())


def _seam(rng: np.random.Generator, size: float) -> float:
    return float(rng.choice((0.0, rng.uniform(0, 0.2) * size)))


def _julia(rng: np.random.Generator, _: float) -> tuple[float, ...] | None:
    return tuple(rng.uniform(-0.7, 0.7, 3).tolist()) if rng.uniform() < 0.4 else None


SEAM = {"smooth": _seam}
KNOWN: dict[str, dict[str, Draw]] = {
    "mandelbulb": {"julia": _julia},
    "julia": {"c": lambda rng, _: tuple(rng.uniform(-0.7, 0.7, 4).tolist())},
    "transform": {
        "translate": _sometimes(_vector(-0.3, 0.3)),
        "rotate": _sometimes(_turn),
        "scale": _sometimes(_scale),
    },
    "union": SEAM,
    "intersection": SEAM,
    "difference": SEAM,
    "shell": {"thickness": _one(0.03, 0.2)},
    "infill": {"shell": _one(0.03, 0.2), "denser": _one(-0.02, 0.05), "within": _one(0.1, 0.5)},
    "onion": {"period": _one(0.2, 0.4), "thickness": _one(0.05, 0.15)},
    "thicken": {"by": _one(-0.05, 0.1), "within": _one(0.2, 0.6)},
    "displace": {"by": _one(-0.05, 0.1)},
    "offset": {"distance": _one(-0.05, 0.1)},
    "bounds": {"min": _vector(-0.6, -0.2), "max": _vector(0.2, 0.6)},
    "repeat": {
        "period": _vector(0.4, 1.4),
        "count": lambda rng, _: tuple(rng.integers(1, 4, 3).tolist()),
    },
    "twist": {"degrees": _one(-90, 90, scaled=False)},
    "bend": {"degrees": _one(-60, 60, scaled=False)},
}
"""What has no default, or would mostly be nothing elsewhere; lengths in sizes of the first child."""
