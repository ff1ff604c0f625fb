"""Normals by 4, 6 and 3 more samples: how wrong, at what cost.

python -m tests.benchmarks.frame.normals

On points that rays hit, with the spacing that the renderer takes (half a pixel's width): the mean and the
worst hundredth of the angles to the gradient of the same field over a sphere of that size (26 directions,
float64).
"""

from __future__ import annotations

from itertools import product

import numpy as np

from fracslice.formulas import Node, julia, mandelbulb, menger, sphere
from fracslice.kernel import reference

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
        t += np.where(f / root.facts.lipschitz > HALF, f / root.facts.lipschitz, 0)
    return (o + t[:, None] * d)[(f / root.facts.lipschitz <= HALF) & (t < 6)]


def gradient(root: Node, points: np.ndarray, offsets: np.ndarray, centre: bool = False) -> np.ndarray:
    """Unit gradients from samples around the points; centre: differences to the point's own value."""
    field = reference(root)
    base = field(*points.T) if centre else 0.0
    total = sum(np.outer(field(*(points + HALF * v).T) - base, v) for v in offsets)
    return total / np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-300)


def main() -> None:
    for name, root in SCENES.items():
        points = surface(root)
        wanted = gradient(root, points, AROUND / np.linalg.norm(AROUND, axis=1, keepdims=True))
        for way, offsets, centre in (
            ("tetrahedron, 4", TETRAHEDRON / 3**0.5, False),
            ("central, 6", AXES, False),
            ("forward, 3", np.eye(3), True),
        ):
            cosine = (gradient(root, points, offsets, centre) * wanted).sum(1)
            angle = np.degrees(np.arccos(np.clip(cosine, -1, 1)))
            print(f"{name:12}{way:16} mean {angle.mean():7.3f}  worst 1 % {np.quantile(angle, 0.99):7.2f}")


if __name__ == "__main__":
    main()
