"""Rays that pass through a surface: none may, by the safe step rule. A million random rays for every formula.

    python -m tests.benchmarks.frame.missed [rays a formula] [name ...]

A ray is missed if one of 500 points along it is inside the solid, and the renderer found nothing or something
behind it. Prints a line for each formula; those with any are the unsafe ones.
"""

from __future__ import annotations

import sys

import numpy as np

from fracslice.formulas import Node
from fracslice.kernel import compile_scene
from fracslice.scene.view import Camera
from tests.examples import EXAMPLES
from tests.rendering.rays import directions, distances

SIDE, POINTS = 320, 500
PIXEL = 2 * np.tan(np.radians(25)) / SIDE


def missed(root: Node, camera: Camera) -> tuple[int, int]:
    """How many rays were missed, and how many hit anything."""
    found, d = distances(root, camera, (SIDE, SIDE)), directions(camera, (SIDE, SIDE))
    first = first_inside(root, np.array(camera.eye), d)
    hit = np.isfinite(first)
    return int((np.isnan(found[hit]) | (found[hit] > first[hit] * (1 + 2 * PIXEL))).sum()), int(hit.sum())


def first_inside(root: Node, eye: np.ndarray, d: np.ndarray) -> np.ndarray:
    """The first of many random, ordered points on each ray where the field is negative, in float64."""
    kernel, first = compile_scene(root, "float64"), np.full(d.shape[:2], np.inf)
    jitter = np.random.default_rng(1).uniform(0, 1, POINTS)
    far = 2 * np.linalg.norm(eye)
    for t in (np.arange(POINTS) + jitter) * far / POINTS:
        open_rays = np.isinf(first)
        inside = kernel.points(*(eye[k] + t * d[open_rays][:, k] for k in range(3))) < 0
        first[open_rays] = np.where(inside, t, np.inf)
    return first


def main(rays: int = 1_000_000, *names: str) -> None:
    rng = np.random.default_rng(7)
    for name in names or EXAMPLES:
        root, lost, hits, done = EXAMPLES[name], 0, 0, 0
        while done < rays:
            eye = rng.normal(size=3)
            camera = Camera(eye=tuple((3 + rng.uniform()) * eye / np.linalg.norm(eye)), fov=50)
            if float(compile_scene(root, "float64").points(*(np.array([c]) for c in camera.eye))[0]) <= 0:
                continue
            counts = missed(root, camera)
            lost, hits, done = lost + counts[0], hits + counts[1], done + SIDE * SIDE
        print(f"{name:30} {done:9,} rays, {hits:9,} hit, {lost} missed", flush=True)


if __name__ == "__main__":
    main(*(int(a) if a.isdigit() else a for a in sys.argv[1:]))  # type: ignore[arg-type]
