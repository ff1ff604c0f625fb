"""Random rays that pass through a surface, for every formula and combination: the step rule allows none.

A ray is missed if one of 500 points along it is inside the solid, and the renderer reports no hit or one
behind.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from fracslice.fields.cpu import compile_scene
from fracslice.formulas import Node
from fracslice.scene.view import Camera
from tests.examples import EXAMPLES
from tests.rendering.rays import directions, distances

from ..runner import Row, Run

POINTS = 500
SMALLEST = {"formulas": ("sphere",), "rays": 100, "side": 16}


def missed(root: Node, camera: Camera, side: int) -> tuple[int, int]:
    """How many rays were missed, and how many hit anything."""
    result, d = distances(root, camera, (side, side)), directions(camera, (side, side))
    first = first_inside(root, np.array(camera.eye), d)
    hit = np.isfinite(first)
    pixel = 2 * np.tan(np.radians(25)) / side * first[hit]
    return int((np.isnan(result[hit]) | (result[hit] > first[hit] + pixel)).sum()), int(hit.sum())


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


def rows(
    run: Run, formulas: tuple[str, ...] = tuple(EXAMPLES), rays: int = 1_000_000, side: int = 320
) -> Iterator[Row]:
    rng = np.random.default_rng(7)
    for name in formulas:
        root, lost, hits, done = EXAMPLES[name], 0, 0, 0
        while done < rays:
            eye = rng.normal(size=3)
            camera = Camera(eye=tuple((3 + rng.uniform()) * eye / np.linalg.norm(eye)), fov=50)
            if float(compile_scene(root, "float64").points(*(np.array([c]) for c in camera.eye))[0]) <= 0:
                continue
            counts = missed(root, camera, side)
            lost, hits, done = lost + counts[0], hits + counts[1], done + side * side
        yield {"": name, "rays": done, "hit": hits, "missed": lost}
