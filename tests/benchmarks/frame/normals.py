"""Normals by 4, 6 and 3 more samples: angle to the mean gradient, and cost.

On points that rays hit, with the spacing that the renderer takes (half a pixel's width): degrees to the
gradient of the field over a sphere of that size (26 directions, float64). Cost: CPU time on NumPy in
evaluations.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from itertools import product

import numpy as np

from fracslice.fields.devices import reference
from fracslice.formulas import Node, julia, mandelbulb, menger, sphere

from ..runner import Row, Run

HALF = 1e-3
SMALLEST = {"scenes": ("sphere",), "count": 50}
SCENES: dict[str, Node] = {
    "sphere": sphere(),
    "menger": menger(level=3),
    "julia": julia(iterations=9),
    "mandelbulb": mandelbulb(iterations=7),
}
TETRAHEDRON = np.array([[1, -1, -1], [-1, -1, 1], [-1, 1, -1], [1, 1, 1]], float)
AXES = np.vstack([np.eye(3), -np.eye(3)])
AROUND = np.array([d for d in product((-1, 0, 1), repeat=3) if any(d)], float)


def surface(root: Node, count: int) -> np.ndarray:
    """Points outside, about half a pixel from the surface: where rays stop."""
    field, rng = reference(root), np.random.default_rng(1)
    o = rng.normal(size=(count, 3))
    o *= 3 / np.linalg.norm(o, axis=1, keepdims=True)
    d = rng.uniform(-0.8, 0.8, (count, 3)) - o
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    t, f = np.zeros(count), np.zeros(count)
    for _ in range(600):
        f = field(*(o + t[:, None] * d).T)
        t += np.where(f / root.bounds.lipschitz > HALF, f / root.bounds.lipschitz, 0)
    return (o + t[:, None] * d)[(f / root.bounds.lipschitz <= HALF) & (t < 6)]


def gradient(root: Node, points: np.ndarray, offsets: np.ndarray, centre: bool = False) -> np.ndarray:
    """Unit gradients from samples around the points; centre: differences to the point's own value."""
    field = reference(root)
    base = field(*points.T) if centre else 0.0
    total = sum(np.outer(field(*(points + HALF * v).T) - base, v) for v in offsets)
    return total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-300)


def unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-300)


def rows(run: Run, scenes: tuple[str, ...] = tuple(SCENES), count: int = 4000) -> Iterator[Row]:
    for name in scenes:
        root = SCENES[name]
        points = surface(root, count)
        expected = gradient(root, points, unit(AROUND))
        acts = {
            "tetrahedron, 4 samples": partial(gradient, root, points, unit(TETRAHEDRON)),
            "central, 6 samples": partial(gradient, root, points, AXES),
            "forward, 3 samples": partial(gradient, root, points, np.eye(3), True),
        }
        measured = run.interleaved({**acts, "once": partial(reference(root), *points.T)})
        for how, act in acts.items():
            cosine = (act() * expected).sum(1)
            angle = np.degrees(np.arccos(np.clip(np.nan_to_num(cosine), -1, 1)))
            row = {
                "": name,
                "by": how,
                "mean": float(angle.mean()),
                "worst hundredth": float(np.quantile(angle, 0.99)),
            }
            yield {**row, "cost": measured.ratio(how, "once", "cpu_s")}
