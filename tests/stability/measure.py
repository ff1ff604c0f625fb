"""How far the kernels are from the float64 reference, over scales, depths and extreme parameters."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from fracslice.fields.cpu import compile_scene
from fracslice.fields.devices import reference
from fracslice.fields.field import Precision
from fracslice.formulas import Node

from .extremes import extreme_versions, hostile_points
from .scaling import SCALINGS

DECADES = range(-5, 6)
DEPTHS = (1, 10, 100, 1000)
LARGEST = {"float32": 1e29, "float64": 1e299}
"""The farthest points: 3^20, Menger's deepest level, times them does not overflow."""

Field = Callable[..., np.ndarray]


def _representable(points: np.ndarray) -> np.ndarray:
    """Points that float32 holds: what is measured is the arithmetic, not the rounding of its input."""
    return points.astype(np.float32).astype(np.float64)


def _error(got: np.ndarray, expected: np.ndarray, size: np.ndarray | float = 1.0) -> float:
    """The largest error in units of the object's size, of a far point's distance, or of the value itself."""
    return float(np.max(np.abs(got - expected) / (size + np.abs(expected))))


def scale_error(root: Node, precision: Precision, count: int = 4000) -> float:
    """The object 1e-5 to 1e5 times as large, both ways, against the reference at its own size."""
    points = np.random.default_rng(11).uniform(-1.6, 1.6, (3, count))
    worst, truth = 0.0, reference(root)
    for factor in (10.0**k for k in DECADES):
        p = _representable(points * factor)
        expected = truth(*(p / factor))
        for way in SCALINGS.values():
            got = compile_scene(way(root, factor), precision).points(*p) / factor
            worst = max(worst, _error(got, expected))
    return worst


def coordinate_error(root: Node, precision: Precision, count: int = 4000) -> float:
    """The object as it is, at points whose coordinates have sizes from 1e-5 to 1e5, each its own."""
    rng = np.random.default_rng(12)
    signs = rng.choice([-1, 1], (3, count))
    p = _representable(signs * 10 ** rng.uniform(DECADES[0], DECADES[-1], (3, count)))
    got = compile_scene(root, precision).points(*p)
    return _error(got, reference(root)(*p), np.maximum(np.abs(p).max(0), 1.0))


def depth_error(root: Node, precision: Precision, count: int = 2000) -> float:
    """An escape-time fractal 1 to 1000 steps deep, its derivative overflown, at random and dyadic points."""
    rng = np.random.default_rng(13)
    dyadic = np.stack(np.meshgrid(*[np.arange(-2, 2.1, 0.5)] * 3), 0).reshape(3, -1)
    p = _representable(np.concatenate([rng.uniform(-1.3, 1.3, (3, count)), dyadic], axis=1))
    worst = 0.0
    for depth in DEPTHS:
        deep = root.changed(iterations=depth)
        worst = max(worst, _error(compile_scene(deep, precision).points(*p), reference(deep)(*p)))
    return worst


def nan_count(root: Node, precision: Precision) -> tuple[int, int]:
    """How many values were not a number, and of how many, over all extreme versions at hostile points."""
    points, lost, seen = hostile_points(LARGEST[precision]), 0, 0
    for _, node in [("", root), *extreme_versions(root)]:
        f = compile_scene(node, precision).points(*points)
        lost, seen = lost + int(np.isnan(f).sum()), seen + f.size
    return lost, seen
