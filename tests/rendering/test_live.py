"""A picture that follows its pilot and its file."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from fracslice.errors import SceneError
from fracslice.rendering import live as module
from fracslice.rendering.live import CameraInput, Drawing, Live, SceneFile, Shown
from fracslice.scene.view import Camera
from fracslice.viewer.viewer import Controls
from fracslice.work import Work
from tests.waiting import wait_until

pytestmark = pytest.mark.once

SCENE = '<scene version="1"><solid size="80mm">{}</solid><camera eye="3 -2 1"/><film samples="4"/></scene>'
SPHERE, BOX = "<sphere/>", '<box size="1 1 1"/>'


@pytest.fixture
def path(tmp_path: Path) -> Path:
    path = tmp_path / "ball.xml"
    path.write_text(SCENE.format(SPHERE))
    return path


@pytest.fixture
def live(path: Path) -> Iterator[Live]:
    live = Live(SceneFile(path), size=(48, 32), work=Work(threads=1), device="cpu")
    yield live
    live.close()
    assert not live.running


def sharp(live: Live, camera: Camera, after: np.ndarray | None = None) -> np.ndarray:
    """The picture from there, when it has all of its samples and is another than the one before."""
    made: list[Shown] = []

    def done() -> bool:
        made[:] = [live.shown]
        return made[0].camera == camera and made[0].samples == 4 and made[0].pixels is not after

    wait_until(done)
    return made[0].pixels


def save(path: Path, text: str) -> None:
    """Saves a file in one step: half of it would be a version of its own."""
    whole = path.with_suffix(".new")
    whole.write_text(text)
    whole.replace(path)


def test_a_flight_never_gets_there() -> None:
    camera, ahead = Camera(eye=(3, 0, 0), target=(0, 0, 0)), CameraInput(forward=1, pace=40)
    places = [3.0]
    for _ in range(30):
        camera = ahead.flown(camera, np.hypot.reduce(camera.eye) - 1, 0.1)
        places.append(camera.eye[0])
    assert 1 < min(places) < 1 + 1e-6
    assert all(a > b for a, b in pairwise(places))
    aside = CameraInput(1, 1, 1, pace=1e3).flown(Camera(eye=(3, 0, 0), target=(0, 0, 0)), 2.0, 1.0)
    assert np.hypot.reduce(np.subtract(aside.eye, (3, 0, 0))) == pytest.approx(1.0)
    assert CameraInput(pace=3).flown(camera, 1.0, 1.0) == camera


def test_a_flight_away_ends_within_sight_of_the_first_view(live: Live) -> None:
    live.steer(CameraInput(forward=-1, pace=1e3))
    start = np.linalg.norm(live.first.eye)
    wait_until(lambda: np.linalg.norm(live.camera.eye) > 30 * start)
    live.steer(CameraInput(forward=-1, right=1, pace=2e3))
    time.sleep(0.5)
    assert np.linalg.norm(live.camera.eye) < 101 * start
    live.steer(CameraInput())
    live.look(live.first)
    wait_until(lambda: live.camera == live.first)


def test_keys_are_let_go_at_once_and_the_pace_has_limits() -> None:
    controls = Controls()
    controls.press("d")
    controls.release("d")
    controls.let_go()
    assert controls.input == CameraInput()
    for _ in range(1000):
        controls.hurry(1.5)
    assert 0 < controls.pace < 1e4


def test_it_sharpens_and_follows_the_pilot(live: Live) -> None:
    before = live.camera
    first = sharp(live, before)
    assert first.shape == (32, 48, 3) and np.ptp(first) > 50
    live.steer(CameraInput(forward=1, pace=5))
    wait_until(lambda: 0 < live.shown.distance < 0.1)
    live.steer(CameraInput())
    assert np.linalg.norm(np.cross(live.camera.forward, before.forward)) < 1e-9, "straight ahead"
    wait_until(lambda: live.shown.samples == 4)  # it has come to rest
    near = live.shown.pixels
    assert abs(near.astype(int) - first).mean() > 5
    aside = live.camera.turned(90, 10)
    live.turn(90, 10)
    wait_until(lambda: live.shown.camera == aside)
    live.look(live.first)
    wait_until(lambda: live.camera == before)
    assert abs(sharp(live, before).astype(int) - first).mean() < 1


def test_a_draft_is_a_coarser_picture_in_the_same_light(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path.write_text(SCENE.format('<box size="9 9 1"/>').replace("3 -2 1", "3 -2 4"))
    drafts: list[Shown] = []  # the first one is soon replaced by a sharp one
    monkeypatch.setattr(module, "Shown", lambda *shown: drafts.append(Shown(*shown)) or drafts[-1])
    live = Live(SceneFile(path), size=(480, 320), work=Work(threads=1), device="cpu")
    try:
        draft, final = drafts[0], sharp(live, live.first)
        assert draft.samples == 0 and draft.pixels.shape == (80, 120, 3)
        means = draft.pixels.mean(axis=(0, 1)), final.mean(axis=(0, 1))
        np.testing.assert_allclose(*means, atol=2)
        live.resize((20, 30))
        wait_until(lambda: live.shown.pixels.shape == (30, 20, 3))
        assert live.shown.camera == live.first
    finally:
        live.close()


def test_a_slow_picture_gets_finer_in_steps(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    developed, widths = module._developed, list[int]()
    monkeypatch.setattr(module, "SOON", 0.0)
    monkeypatch.setattr(
        module, "_developed", lambda by, done: (widths.append(by.width), developed(by, done))[1]
    )
    live = Live(SceneFile(path), size=(480, 320), work=Work(threads=1), device="cpu")
    try:
        sharp(live, live.first)
        assert widths[:3] == [120, 240, 480]
    finally:
        live.close()


def test_a_drawing_is_a_quicker_one_while_the_camera_moves(live: Live) -> None:
    def drawing(shade: int) -> Drawing:
        return lambda _, size: np.full((size[1], size[0], 3), shade, np.uint8)

    def shades() -> tuple[int, float]:
        return int(live.shown.pixels[0, 0, 0]), live.shown.samples

    live.draw(drawing(7), drawing(9))
    wait_until(lambda: shades() == (7, 1.0))
    seen = set[tuple[int, float]]()
    live.turn(5, 0)
    wait_until(lambda: seen.add(shades()) or (9, 0.0) in seen)
    wait_until(lambda: shades() == (7, 1.0))
    live.draw(None)
    sharp(live, live.aim)


def test_a_tap_on_a_key_is_never_lost(live: Live) -> None:
    sharp(live, live.first)
    live.steer(CameraInput(yaw=1))
    time.sleep(0.02)
    live.steer(CameraInput())
    wait_until(lambda: live.camera != live.first)


def test_a_new_kernel_shows_that_it_compiles(
    live: Live, path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("FRACSLICE_CACHE", str(tmp_path / "kernels"))
    for solid in (
        '<mandelbulb power="6"/>',
        '<material colour="1 0 0 0 1 0 0 0 1"><union><mandelbulb power="6"/><box/></union></material>',
    ):
        sharp(live, live.first)
        shown, making = live.shown, set[float | None]()
        save(path, SCENE.format(solid))
        while live.shown is shown or live.shown.samples < 4:
            making.add(live.making)
            time.sleep(0.005)
        assert making - {None}


def test_there_is_no_looking_from_inside(live: Live) -> None:
    before = live.camera
    live.look(replace(before, eye=(0.1, 0, 0)))
    live.turn(0.0, 0.0)
    time.sleep(0.3)
    sharp(live, before)
    assert live.running and live.camera == before


def test_a_saved_file_is_looked_at_from_the_same_place(live: Live, path: Path) -> None:
    first = sharp(live, live.first)
    live.turn(5, 0)
    turned = live.first.turned(5, 0)
    before = sharp(live, turned)
    save(path, SCENE.format(BOX))
    boxed = sharp(live, turned, before)
    assert abs(boxed.astype(int) - before).mean() > 3
    save(path, SCENE.format('<sphere radius="x"/>'))
    wait_until(lambda: "ball.xml:1" in live.shown.problem)
    assert "radius" in live.shown.problem and live.running
    np.testing.assert_array_equal(live.shown.pixels, boxed)
    save(path, SCENE.format(SPHERE).replace("3 -2 1", "-3 -2 1"))
    other = sharp(live, replace(live.first, eye=(-3, -2, 1)))
    assert live.shown.problem == ""
    assert abs(other.astype(int) - first).mean() > 1, "seen from the other side"


def test_what_cannot_be_rendered_is_said_at_once(path: Path) -> None:
    path.write_text(SCENE.format(SPHERE).replace("3 -2 1", "0.1 0 0"))
    with pytest.raises(SceneError, match="outside the solid"):
        Live(SceneFile(path), size=(48, 32))
    with pytest.raises(SceneError, match=r"sphere\.radios"):
        Live(SceneFile(path, ["sphere.radios=2"]))


def test_what_stops_it_is_raised_at_the_end(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    live = Live(SceneFile(path), size=(48, 32), device="cpu")
    monkeypatch.setattr(live, "_step", lambda: 1 / 0)
    wait_until(lambda: not live.running)
    with pytest.raises(ZeroDivisionError):
        live.close()
