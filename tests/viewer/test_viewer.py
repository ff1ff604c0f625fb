"""The flight window under real keys, pointer and resizing: every event comes from an X server."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from fracslice import read
from fracslice.errors import RenderError
from fracslice.scene.view import Camera
from fracslice.viewer import fly, viewer
from fracslice.viewer.window import has_screen
from tests.viewer.xserver import AVAILABLE, XServer, xserver

pytestmark = pytest.mark.once

pytest.importorskip("pyvista")
real = pytest.mark.skipif(not AVAILABLE, reason="Xvfb and libXtst are not installed")

SCENE = """<scene version="1"><solid size="80mm"><material colour="1 0 0"><sphere/></material></solid>
<camera eye="4 0 0" target="0 0 0"/><shading ambient="0.5"/><film samples="4" background="0 0 1"/>
<light kind="sun"/></scene>"""
SIZE = (320, 240)


class Window:
    """A flight window in a process of its own."""

    def __init__(self, server: XServer, folder: Path) -> None:
        self.server, self.folder, self.saved = server, folder, 0
        (folder / "ball.xml").write_text(SCENE)
        size = "{}x{}".format(*SIZE)
        command = [sys.executable, "-m", "fracslice.cli", "fly", "ball.xml", "--size", size]
        self.process = subprocess.Popen(
            [*command, "--device", "cpu"],
            cwd=folder,
            env=os.environ | {"DISPLAY": server.display},
            stdout=subprocess.PIPE,
            text=True,
        )
        wait(lambda: server.windows() != [] and self.ball() is not None)
        server.point(150, 120)  # keys go to the window under the pointer

    def camera(self, other_than: Camera | None = None) -> Camera:
        """The camera at rest, by the key that saves the view."""
        views: list[Camera | None] = [other_than]
        while views[-1] == other_than or views[-3:] != 3 * views[-1:]:
            assert len(views) < 100, "the camera does not come to rest, or does not move"
            self.saved += 1
            path = self.folder / f"ball-view{self.saved}.xml"
            self.server.key("period")
            wait(path.exists)
            views.append(read(path).view.camera)
            time.sleep(0.1)
        assert views[-1] is not None
        return views[-1]

    def ball(self) -> tuple[int, int] | None:
        """Width and height of the ball's picture, pixels: all that is red; the text is white."""
        pixels = self.server.pixels().astype(int)
        red = pixels[..., 0] > 60 + 2 * pixels[..., 1]
        if not red.any():
            return None
        rows, columns = np.flatnonzero(red.any(1)), np.flatnonzero(red.any(0))
        return int(np.ptp(columns)) + 1, int(np.ptp(rows)) + 1


def wait(holds: Callable[[], bool], seconds: float = 60) -> None:
    end = time.monotonic() + seconds
    while not holds():
        assert time.monotonic() < end, "it never came"
        time.sleep(0.02)


@pytest.fixture(scope="module")
def window(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Window]:
    folder = tmp_path_factory.mktemp("flight")
    with xserver(folder) as server:
        window = Window(server, folder)
        yield window
        window.process.kill()
        window.process.wait()


@pytest.fixture
def first(window: Window) -> Camera:
    """The first camera, to which the window has returned."""
    for _ in range(5):  # a window under load may still fly when it is told to return
        window.server.key("v")
        camera = window.camera(first)
        if camera.eye == (4, 0, 0):
            return camera
    raise AssertionError("the camera does not return")


@real
def test_dragging_turns_the_camera_and_ends_with_the_button(window: Window, first: Camera) -> None:
    def stroke() -> None:
        for step in range(11):
            window.server.point(150 + 4 * step, 120 - 2 * step)

    window.server.point(150, 120)
    window.server.button(1, True)
    stroke()
    window.server.button(1, False)
    turned, degree = window.camera(first), first.fov / SIZE[1]
    expected = first.turned(-40 * degree, -20 * degree)
    assert np.allclose(turned.forward, expected.forward, atol=2e-3)
    stroke()
    assert window.camera() == turned, "no button is held"


@real
@pytest.mark.parametrize(
    ("key", "axis", "sign"),
    [("w", "forward", 1), ("s", "forward", -1), ("d", "right", 1), ("a", "right", -1)]
    + [("r", "above", 1), ("f", "above", -1)],
)
def test_keys_fly_along_the_axes(window: Window, first: Camera, key: str, axis: str, sign: int) -> None:
    window.server.key(key, 0.2)
    moved = np.subtract(window.camera(first).eye, first.eye)
    assert np.linalg.norm(moved) > 0.05
    assert np.allclose(moved / np.linalg.norm(moved), sign * np.array(getattr(first, axis)), atol=1e-6)


@real
@pytest.mark.parametrize(
    ("key", "turned"),
    [
        ("Left", lambda a, b: -np.dot(b.forward, a.right)),
        ("Right", lambda a, b: np.dot(b.forward, a.right)),
        ("Up", lambda a, b: np.dot(b.forward, a.above)),
        ("Down", lambda a, b: -np.dot(b.forward, a.above)),
        ("e", lambda a, b: np.dot(b.above, a.right)),
        ("q", lambda a, b: -np.dot(b.above, a.right)),
    ],
)
def test_arrows_turn_and_q_and_e_roll(
    window: Window, first: Camera, key: str, turned: Callable[[Camera, Camera], float]
) -> None:
    window.server.key(key, 0.2)
    camera = window.camera(first)
    assert camera.eye == first.eye and turned(first, camera) > 0.05
    assert window.process.poll() is None


@real
def test_mouse_look_needs_no_button_and_lock_stops_everything(window: Window, first: Camera) -> None:
    window.server.point(150, 120)
    window.server.key("m")
    for step in range(5):
        window.server.point(150 + 8 * step, 120)
    turned = window.camera(first)
    assert np.dot(turned.forward, first.right) > 0.03, "the camera follows the pointer"
    window.server.key("l")
    for key in ("w", "Left", "q", "v"):
        window.server.key(key, 0.1)
    window.server.point(150, 100)
    assert window.camera() == turned
    window.server.key("l")
    window.server.key("m")
    window.server.point(190, 120)
    assert window.camera() == turned


@real
def test_speed_keys_change_the_pace(window: Window, first: Camera) -> None:
    lengths = []
    for pace in ("2", "7"):
        window.server.key("v")
        window.server.key(pace)
        window.server.key("s", 0.2)
        lengths.append(np.linalg.norm(np.subtract(window.camera(first).eye, first.eye)))
    window.server.key("5")
    assert 4 * lengths[0] < lengths[1]


@real
def test_no_key_changes_the_colours(window: Window, first: Camera) -> None:
    before = window.server.pixels()[30:200].mean((0, 1))
    window.server.key("3")  # stereo in VTK's own styles
    assert window.camera() == first
    assert np.allclose(window.server.pixels()[30:200].mean((0, 1)), before, atol=8)
    window.server.key("5")


@real
def test_resizing_does_not_stretch(window: Window, first: Camera) -> None:
    try:
        for size in ((500, 300), (300, 400)):
            window.server.resize(*size)

            def is_round(diameter: float = 0.71 * size[1]) -> bool:
                width, height = window.ball() or (0, 0)  # of a draft, first, whose pixels are large
                return abs(height - diameter) < 0.03 * diameter and abs(width - height) <= 3

            wait(is_round, 20)
    finally:
        window.server.resize(*SIZE)


@real
def test_escape_closes_and_the_view_is_printed(window: Window, first: Camera) -> None:
    window.server.key("Escape")
    output, _ = window.process.communicate(timeout=60)
    assert output == '<camera eye="4 0 0"/>\n' and window.process.returncode == 0


def test_compilation_and_problems_are_displayed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(viewer, "Canvas", lambda *_: SimpleNamespace(close=None))
    monkeypatch.setattr("time.monotonic", lambda: 100.0)
    shown = SimpleNamespace(samples=0.0, distance=0.5, problem="ball.xml:3: no")
    live = SimpleNamespace(scene=SimpleNamespace(name="ball"), shown=shown, making=99.9)
    window = viewer.Viewer(live, SIZE, lambda: False)  # type: ignore[arg-type]
    assert window.caption.splitlines() == ["draft   surface at 0.5   pace 1", "ball.xml:3: no"]
    live.making = 99.0
    assert "compiling ..." in window.caption.splitlines()


def test_flying_needs_a_screen(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DISPLAY", ":424242")
    if not has_screen():
        with pytest.raises(RenderError, match="no screen"):
            fly("any.xml")


@real
def test_a_picture_is_shown_while_it_is_rendered(tmp_path: Path) -> None:
    (tmp_path / "ball.xml").write_text(SCENE.replace('<light kind="sun"/>', '<light kind="sun" size="30"/>'))
    size = "{}x{}".format(*SIZE)
    command = [sys.executable, "-m", "fracslice.cli", "render", "ball.xml", "--size", size, "--samples", "64"]
    with xserver(tmp_path) as server:
        environment = os.environ | {"DISPLAY": server.display}
        process = subprocess.Popen([*command, "-o", "a.png", "--watch"], cwd=tmp_path, env=environment)
        seen = 0
        while process.poll() is None:
            pixels = server.pixels().astype(int)
            seen = max(seen, (pixels[..., 0] > 60 + 2 * pixels[..., 1]).sum())
            time.sleep(0.02)
    assert process.returncode == 0
    assert seen > 5000, "the ball"
    assert subprocess.run([*command, "-o", "b.png"], cwd=tmp_path, check=False).returncode == 0
    assert (tmp_path / "a.png").read_bytes() == (tmp_path / "b.png").read_bytes()
    environment = {k: v for k, v in os.environ.items() if k != "DISPLAY"}
    refused = subprocess.run(
        [*command, "-o", "c.png", "--watch"], cwd=tmp_path, env=environment, capture_output=True, text=True
    )
    assert refused.returncode != 0 and not (tmp_path / "c.png").exists()
    assert refused.stderr.count("\n") == 1 and "there is no screen" in refused.stderr
