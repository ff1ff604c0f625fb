"""Colours of points on a surface, as in pictures without light, and the scalars behind them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..common.arrays import from_linear
from ..expr.graph import ON_ARRAYS, Evaluator, Function
from ..fields.linker import Linker, link_tree
from ..fields.registry import Node
from ..formulas.material import material
from ..work import Work, chunks
from .materials import Look, TraceDialect, traps

MATERIAL, PALETTE = "material", "viridis"

COUNT = 1 << 14
"""Points that are evaluated at a time."""

_FUNCTION = "colour"


@dataclass(frozen=True)
class Paint:
    """Colours of points."""

    colours: NDArray[np.uint8]  # sRGB
    # property of the orbit, by the name of the trap, or "trap" where materials choose it; and the number of
    # the material, "material", 0 for none
    scalars: Mapping[str, NDArray[np.float32]]


def paint(root: Node, points: NDArray[np.float64], shown: str, work: Work) -> Paint:
    """Evaluate the colours of a scene.

    `points`: float64 (n, 3), scene units.
    """
    if shown != MATERIAL:
        root = material(_plain(root), palette=PALETTE, trap=shown)
    functions, parameters = _link_painting(root)
    evaluator = Evaluator(ON_ARRAYS, functions)
    values = np.empty((5, len(points)))

    def evaluate(rows: slice) -> None:
        with np.errstate(all="ignore"):
            values[:, rows] = np.broadcast_arrays(
                *evaluator(functions[_FUNCTION], *points[rows].T, parameters)
            )

    work.map(evaluate, chunks(len(points), COUNT))
    tone = {"trap" if shown == MATERIAL else shown: values[4].astype(np.float32)}
    number = {MATERIAL: values[3].astype(np.float32)} if shown == MATERIAL else {}
    return Paint(_encode_srgb(values[:3].T), {**tone, **number})


def _plain(node: Node) -> Node:
    """The tree without its materials."""
    if node.formula is material:
        return _plain(node.children[0])
    return node.changed(tuple(map(_plain, node.children))) if node.children else node


def _link_painting(root: Node) -> tuple[Mapping[str, Function], NDArray[np.float64]]:
    """Functions and parameters of the function of linear red, green and blue, material number and tone."""
    linker = Linker()
    look = Look(linker, root)
    dialect = TraceDialect(linker, materials=look.paints, traps=traps(root))
    colours = [look.colour(k, node) for k, node in enumerate(look.all)]
    lines = [
        f"_, paint, tone = {link_tree(linker, root, dialect)}",
        "t = 0.0 * x",
        *look.chosen(colours, ("cr", "cg", "cb")),
        "return cr, cg, cb, paint, tone",
    ]
    linker.write(_FUNCTION, ("x", "y", "z", "P"), lines)
    return linker.functions, np.array(linker.parameters or [0.0])


def _encode_srgb(light: NDArray[np.float64]) -> NDArray[np.uint8]:
    """Linear light in sRGB."""
    colours: NDArray[np.uint8] = np.rint(255 * from_linear(light.clip(0.0, 1.0))).astype(np.uint8)
    return colours
