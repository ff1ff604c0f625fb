"""Where a bound may break: axes and poles, cell borders, fold planes, diagonals, and anywhere."""

from __future__ import annotations

import numpy as np

from fracslice.formulas import Box, Node

ENDLESS = 2.0
"""How far points go along an axis that a scene has no end on."""


def _frame(box: Box) -> tuple[np.ndarray, np.ndarray]:
    """Lower and upper corner of a finite box half as large again as the scene's."""
    lo, hi = np.array(box.lo), np.array(box.hi)
    lo, hi = np.where(np.isfinite(lo), lo, -ENDLESS), np.where(np.isfinite(hi), hi, ENDLESS)
    grown = np.maximum((hi - lo) / 4, 1e-3)
    return lo - grown, hi + grown


def borders(root: Node) -> np.ndarray:
    """Coordinates where fields fold: zero, the faces of boxes, Menger's cells, borders between copies."""
    result = [0.0]
    for node in root.solids():
        ends = [v for v in (*node.bounds.box.lo, *node.bounds.box.hi) if np.isfinite(v)]
        result += ends
        if node.formula.name == "menger":
            result += (np.arange(-27, 28) / 27).tolist()
        if node.formula.name == "repeat":
            result += [k * p / 2 for p in node["period"] for k in range(-4, 5)]
    return np.unique(result)


def points(root: Node, count: int, rng: np.random.Generator) -> np.ndarray:
    """Points [3, count] in and around a scene: a third anywhere, the rest at or very near special places."""
    lo, hi = _frame(root.bounds.box)
    p = rng.uniform(lo[:, None], hi[:, None], (3, count))
    near = rng.choice([-1.0, 0.0, 1.0], (3, count)) * 10 ** rng.uniform(-12, -2, (3, count))
    kind = rng.integers(0, 6, count)
    rows = np.arange(3)[:, None]
    special, axis = borders(root), rng.integers(0, 3, count)
    on_plane = (kind == 2) & (rows == axis) | (kind == 3)
    p = np.where(on_plane, special[rng.integers(0, len(special), (3, count))] + near, p)
    p = np.where((kind == 4) & (rows != axis), near, p)
    diagonal = np.abs(p[0]) * rng.choice([-1, 1], (3, count)) + near
    return np.where((kind == 5) & (rows != axis), diagonal, p)
