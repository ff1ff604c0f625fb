"""Flights straight at a fractal: they come near, and every camera on the way can be rendered at any size."""

from __future__ import annotations

import numpy as np
import pytest

from fracslice.errors import SceneError
from fracslice.formulas import Node, mandelbulb, sphere
from fracslice.rendering.live import CameraInput
from fracslice.rendering.setup import RenderSetup, clearance, prepare
from fracslice.scene.view import Camera, View

pytestmark = pytest.mark.once

AHEAD = CameraInput(forward=1, pace=2)


def flight(root: Node, camera: Camera, steps: int) -> tuple[Camera, RenderSetup]:
    """The camera after a flight that chooses its depth again whenever the surface is half as far."""
    setup = prepare(root, View(camera=camera), (96, 54))
    near = distance = clearance(setup.root, camera)
    for _ in range(steps):
        camera = AHEAD.flown(camera, distance, 0.2)
        distance = clearance(setup.root, camera)
        if distance < near / 2:
            setup = prepare(root, View(camera=camera), (96, 54))
            near = distance = clearance(setup.root, camera)
    return camera, setup


@pytest.mark.parametrize("seed", range(3))
def test_flights_come_near_and_end_outside_at_any_size(seed: int) -> None:
    random = np.random.default_rng(seed)
    towards = random.normal(size=3)
    eye, target = 2.6 * towards / np.linalg.norm(towards), 0.3 * random.normal(size=3)
    camera, setup = flight(mandelbulb(), Camera(eye=tuple(eye), target=tuple(target)), 200)
    assert clearance(setup.root, camera) < 1e-4
    for size in ((1280, 720), (48, 32), (8, 8)):
        assert clearance(prepare(mandelbulb(), View(camera=camera), size).root, camera) > 0


def test_an_eye_inside_at_every_depth_is_refused() -> None:
    for root in (mandelbulb(), sphere()):
        with pytest.raises(SceneError, match="eye: expected a place outside the solid"):
            prepare(root, View(camera=Camera(eye=(0.1, 0, 0))), (48, 32))
