"""Normals by 4, 6 and 3 more samples, and by derivatives: how wrong, at what cost.

    python -m tests.benchmarks.frame.normals

On points that rays hit, with the spacing that the renderer takes (half a pixel's width): the mean and the
worst hundredth of the angles to the gradient of the same field over a sphere of that size (26 directions,
float64). Cost: the time of the same reference on NumPy, as a multiple of one evaluation.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from itertools import product

import numpy as np

from fracslice.formulas import Node, julia, mandelbulb, menger, sphere
from fracslice.kernel import reference

from .duals import gradients

HALF = 1e-3
SCENES: dict[str, Node] = {
    "sphere": sphere(),
    "menger": menger(level=3),
    "julia": julia(iterations=9),
    "mandelbulb": mandelbulb(iterations=7),
}
TETRAHEDRON = np.array([[1, -1, -1], [-1, -1, 1], [-1, 1, -1], [1, 1, 1]], float)
AXES = np.vstack([np.eye(3), -np.eye(3)])
AROUND = np.array([d for d in product((-1, 0, 1), repeat=3) if any(d)], float)


def surface(root: Node, count: int = 4000) -> np.ndarray:
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


def cost(run: Callable[[], object]) -> float:
    times = []
    for _ in range(5):
        start = time.process_time()
        run()
        times.append(time.process_time() - start)
    return min(times)


def main() -> None:
    for name, root in SCENES.items():
        points, field, derived = surface(root), reference(root), gradients(root)
        wanted = gradient(root, points, unit(AROUND))
        once = cost(lambda f=field, p=points: f(*p.T))  # type: ignore[misc]
        ways: dict[str, Callable[[], np.ndarray]] = {
            "tetrahedron, 4": lambda r=root, p=points: gradient(r, p, unit(TETRAHEDRON)),  # type: ignore[misc]
            "central, 6": lambda r=root, p=points: gradient(r, p, AXES),  # type: ignore[misc]
            "forward, 3": lambda r=root, p=points: gradient(r, p, np.eye(3), True),  # type: ignore[misc]
            "derivatives": lambda d=derived, p=points: unit(d(p)),  # type: ignore[misc]
        }
        for way, found in ways.items():
            cosine = (found() * wanted).sum(1)
            angle = np.degrees(np.arccos(np.clip(np.nan_to_num(cosine), -1, 1)))
            print(
                f"{name:12}{way:16} mean {angle.mean():7.3f}  worst 1 % {np.quantile(angle, 0.99):7.2f}  "
                f"cost {cost(found) / once:5.1f}"
            )


if __name__ == "__main__":
    main()
