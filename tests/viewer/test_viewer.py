"""What keys and the pointer mean in the window to fly in; no screen is needed."""

from __future__ import annotations

from types import SimpleNamespace
from unittest.mock import MagicMock

import numpy as np
import pytest

from fracslice.errors import RenderError
from fracslice.rendering.live import CameraInput
from fracslice.scene.view import Camera
from fracslice.viewer import fly, screen, viewer

pyvista = pytest.importorskip("pyvista")


def shown(level: int) -> SimpleNamespace:
    pixels = np.full((4, 6, 3), level, np.uint8)
    pixels[0] = 0  # the upper row
    return SimpleNamespace(pixels=pixels, caption=f"{level}")


@pytest.fixture
def window(monkeypatch: pytest.MonkeyPatch) -> viewer.Viewer:
    monkeypatch.setattr(pyvista, "Plotter", lambda **_: MagicMock(window_size=(6, 40)))
    live = MagicMock(camera=Camera(fov=40.0), running=True, shown=shown(10))
    return viewer.Viewer(live, (6, 4), lambda: False)


def camera_input(window: viewer.Viewer) -> CameraInput:
    steered: CameraInput = window.live.steer.call_args.args[0]  # type: ignore[attr-defined]
    return steered


def test_keys_that_are_held_steer(window: viewer.Viewer, monkeypatch: pytest.MonkeyPatch) -> None:
    now = 100.0
    monkeypatch.setattr("time.monotonic", lambda: now)
    for key in ("w", "d"):
        window.press(key)
    assert (camera_input(window).forward, camera_input(window).right, camera_input(window).up) == (1, 1, 0)
    window.press("s")
    assert camera_input(window).forward == 0
    window.lift("s")
    window.press("s")  # that is how a key repeats itself
    now += 1
    window.tick()
    assert camera_input(window).forward == 0
    window.lift("s")
    window.lift("d")
    now += 1
    window.tick()
    assert (camera_input(window).forward, camera_input(window).right) == (1, 0)
    window.hurry(2.0)
    assert (camera_input(window).forward, camera_input(window).pace) == (1, 2)
    window.press("v")
    window.live.look.assert_called_once_with(window.live.first)  # type: ignore[attr-defined]


def test_what_is_grasped_follows_the_pointer(window: viewer.Viewer) -> None:
    window.drag((9, 9))
    window.live.turn.assert_not_called()  # type: ignore[attr-defined]
    window.grasp((10, 20))
    window.drag((13, 18))
    window.live.turn.assert_called_once_with(-3, 2)  # type: ignore[attr-defined]


def test_the_newest_picture_is_shown_upright(window: viewer.Viewer) -> None:
    window.live.shown = shown(20)
    window.tick()
    rows = np.asarray(window.image.point_data["picture"]).reshape(4, 6, 3)
    assert (rows[3] == 0).all() and (rows[:3] == 20).all(), "VTK counts rows from below"
    window.caption.set_text.assert_called_with("upper_left", "20")
    window.plotter.render.assert_called_once()
    window.tick()
    window.plotter.render.assert_called_once()


@pytest.mark.parametrize("how", ["key", "outside", "failure"])
def test_it_closes(window: viewer.Viewer, how: str) -> None:
    window.tick()
    close = window.plotter.iren.interactor.TerminateApp
    close.assert_not_called()
    if how == "key":
        window.press("q")
    elif how == "outside":
        window.stopped = lambda: True
    else:
        window.live.running = False  # type: ignore[misc]
    window.tick()
    close.assert_called()


def test_flying_needs_a_screen(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DISPLAY", ":424242")
    if not screen.has_screen():
        with pytest.raises(RenderError, match="no screen"):
            fly("any.xml")
