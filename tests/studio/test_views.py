"""Moves of a studio's camera about the point under the mouse."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from fracslice.fields.registry import Node
from fracslice.formulas import box, sphere, transform, union
from fracslice.rendering.live import CameraInput
from fracslice.scene.view import Camera
from fracslice.studio import views
from fracslice.studio.views import Pixel, Views, scaled_about, surface_at, turned_about

pytestmark = pytest.mark.once

SIZE = 96, 64
CAMERA = Camera(eye=(3.0, -2.0, 1.0), target=(0.0, 0.0, 0.2), fov=50.0)
ROOT = union(sphere(radius=0.5), transform(box(size=(0.4, 0.4, 0.4)), translate=(0.9, 0.3, 0.0)))


def pixel_of(camera: Camera, point: tuple[float, ...], size: tuple[int, int] = SIZE) -> Pixel:
    """Where a perspective shows a point, worked out from the definition of a film at distance 1."""
    arm = np.subtract(point, camera.eye)
    right, up, ahead = (float(arm @ np.array(axis)) for axis in (camera.right, camera.above, camera.forward))
    scale = size[1] / 2 / math.tan(math.radians(camera.fov) / 2)
    return size[0] / 2 + scale * right / ahead, size[1] / 2 - scale * up / ahead


@pytest.mark.parametrize("at", [(48.0, 32.0), (40.5, 35.25), pixel_of(CAMERA, (0.9, 0.3, 0.05))])
def test_the_point_under_the_mouse_is_on_the_surface_and_is_shown_there(at: Pixel) -> None:
    point = surface_at(ROOT, CAMERA, SIZE, at)
    assert point is not None
    assert abs(float(ROOT.kernel("cpu", "float64").points(*np.array(point)[:, None])[0])) < 0.05
    np.testing.assert_allclose(pixel_of(CAMERA, point), at, atol=1e-6)


def test_beside_the_solid_there_is_none() -> None:
    assert surface_at(ROOT, CAMERA, SIZE, (2.0, 2.0)) is None


def test_turns_and_steps_leave_the_point_where_it_is_seen() -> None:
    point = surface_at(ROOT, CAMERA, SIZE, (40.5, 35.25))
    assert point is not None
    for camera in turned_about(CAMERA, point, 40.0, -12.0), scaled_about(CAMERA, point, 0.3):
        np.testing.assert_allclose(pixel_of(camera, point), (40.5, 35.25), atol=1e-6)
        assert math.dist(camera.eye, CAMERA.eye) > 0.1
    near = scaled_about(CAMERA, point, 0.3)
    assert math.dist(near.eye, point) == pytest.approx(0.3 * math.dist(CAMERA.eye, point))


class Still:
    """A live picture that is where it is aimed at."""

    def __init__(self, root: Node) -> None:
        self.root, self.size, self.aim, self.first = root, SIZE, CAMERA, CAMERA

    @property
    def camera(self) -> Camera:
        return self.aim

    def look(self, camera: Camera) -> None:
        self.aim = camera

    def steer(self, _: CameraInput) -> None: ...


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> SimpleNamespace:
    """Time that a test sets."""
    made = SimpleNamespace(now=0.0)
    monkeypatch.setattr(views, "time", SimpleNamespace(monotonic=lambda: made.now))
    return made


@pytest.fixture
def seen(clock: SimpleNamespace) -> Views:
    return Views(Still(ROOT))  # type: ignore[arg-type]


@pytest.fixture
def rest(seen: Views, clock: SimpleNamespace) -> Callable[[], Camera]:
    """Let a flight end, and the camera rest."""

    def waited() -> Camera:
        for _ in range(30):
            clock.now += 0.1
            seen.advance()
        return seen.camera

    return waited


def test_views_that_were_left_are_returned_to(seen: Views, rest: Callable[[], Camera]) -> None:
    first = rest()
    seen.look_around(30, 10)
    second = rest()
    seen.walk_to((48.0, 32.0))
    third = rest()
    assert len({first, second, third}) == 3
    seen.back()
    assert rest() == second
    seen.back()
    assert rest() == first
    seen.back()
    assert rest() == first
    seen.back(-1)
    assert rest() == second


def test_a_walk_ends_nearer_to_what_it_then_looks_at(seen: Views, rest: Callable[[], Camera]) -> None:
    point = seen.surface_at((40.5, 35.25))
    seen.walk_to((40.5, 35.25))
    made = rest()
    assert point is not None and made.target == point
    assert math.dist(made.eye, point) == pytest.approx(0.4 * math.dist(CAMERA.eye, point))


def test_a_key_ends_a_flight(seen: Views, clock: SimpleNamespace) -> None:
    seen.fly_to(replace(CAMERA, eye=(9.0, 9.0, 9.0)))
    clock.now += 0.1
    seen.advance()
    seen.steer(CameraInput(forward=1.0))
    clock.now += 5
    seen.advance()
    assert seen.camera.eye != (9.0, 9.0, 9.0)


def test_parallel_rays_find_the_surface() -> None:
    camera = replace(CAMERA, kind="orthographic")
    point = surface_at(ROOT, camera, SIZE, (48.0, 32.0))
    assert point is not None and abs(np.subtract(point, CAMERA.target) @ camera.right) < 1e-9
