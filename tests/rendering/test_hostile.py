"""Parameters at the end of their range: every pixel stays a number, every ray ends."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fracslice.errors import SceneError
from fracslice.formulas import (
    Node,
    bounds,
    julia,
    mandelbulb,
    material,
    plane,
    repeat,
    sphere,
    transform,
    union,
)
from fracslice.rendering import Renderer, develop
from fracslice.scene.view import Camera, Film, Fog, Light, Shading, View
from fracslice.work import Work

pytestmark = pytest.mark.once

BULB = mandelbulb(iterations=4)
FAR = Camera(eye=(1e4, 3, 2), fov=0.02)
HOSTILE: dict[str, tuple[Node, View]] = {
    "tiny": (transform(BULB, scale=1e-5), View(camera=Camera(eye=(3e-5, -2e-5, 1e-5)))),
    "huge": (transform(BULB, scale=1e6), View(camera=Camera(eye=(3e6, -2e6, 1e6)))),
    "far and narrow": (BULB, View(camera=FAR)),
    "all around": (BULB, View(camera=Camera(eye=(1.3, -1.0, 0.1), fov=178.9))),
    "lights": (
        BULB,
        View(
            lights=(
                Light(kind="lamp", position=(0, 0, 0.01), strength=1e6),
                Light(kind="lamp", position=(0.1, 0, 0), size=50),
                Light(size=90, strength=1e6),
                Light(kind="sky", strength=1e6),
            ),
            fog=Fog(density=1e6),
            shading=Shading(ambient=100, occlusion=4, reach=1e-9),
        ),
    ),
    "glass": (
        material(
            julia(iterations=6),
            clear=1,
            index=4,
            absorb=(1e6, 0, 1),
            reflect=1,
            shininess=10000,
            specular=100,
        ),
        View(shading=Shading(bounces=16)),
    ),
    "lens": (BULB, View(camera=Camera(eye=(2, -2, 1), aperture=100, focus=1e-6))),
    "plane": (union(plane(), sphere(radius=0.5)), View(camera=Camera(eye=(3, 0, 1e-3), target=(0, 0, 1e-3)))),
    "endless": (
        bounds(
            repeat(sphere(radius=0.2), period=(0.5, 0.5, 0.5)), min=(-1e3, -1e3, -1e3), max=(1e3, 1e3, 1e3)
        ),
        View(camera=Camera(eye=(0.25, 0.25, 0.25), target=(1, 0.25, 0.25))),
    ),
}


@pytest.mark.parametrize("name", HOSTILE)
def test_every_pixel_is_a_number(name: str) -> None:
    root, view = HOSTILE[name]
    *_, last = Renderer(root, view, (24, 18), Work(threads=1), "cpu").passes(samples=3)
    assert np.isfinite(last.image).all()
    assert (last.image >= 0).all()
    shown = develop(last.mean, replace(view, film=Film(bloom=1, exposure=20)))
    assert np.isfinite(shown).all()
    assert shown.min() >= 0
    assert shown.max() <= 1


@pytest.mark.parametrize(
    ("root", "view", "message"),
    [
        (BULB, {"camera": Camera(eye=(0.1, 0, 0), target=(1, 0, 0))}, "outside the solid"),
        (plane(), {}, "camera.* is missing"),
        (BULB, {"lights": (Light(kind="sky"), Light(kind="sky"))}, "at most one sky"),
    ],
)
def test_views_that_show_nothing_are_refused(root: Node, view: dict, message: str) -> None:
    with pytest.raises(SceneError, match=message):
        Renderer(root, View(**view), (8, 8), Work(threads=1))


@pytest.mark.parametrize(
    ("record", "values", "message"),
    [
        (Camera, {"eye": (1, 2, 3), "target": (1, 2, 3)}, "different points"),
        (Camera, {"eye": (0, 0, 3), "up": (0, 0, -1)}, "other than the one the camera looks in"),
        (Film, {"width": 0}, "expected a whole number from 1"),
        (Film, {"samples": 0}, "expected a whole number from 1"),
        (Light, {"position": (float("nan"), 0, 1)}, "expected 3 numbers"),
        (Light, {"strength": float("nan")}, "expected a number"),
        (Light, {"kind": "laser"}, "expected camera, environment, lamp, sky or sun"),
        (Shading, {"mode": "cel"}, "expected light, normal"),
    ],
)
def test_records_refuse_what_cannot_be(record: type, values: dict, message: str) -> None:
    with pytest.raises(SceneError, match=message):
        record(**values)
