"""fracslice show and fly, up to the window."""

from __future__ import annotations

from pathlib import Path

import pytest
from fracslice.cli.main import run

from fracslice.mesh import Mesh
from fracslice.scene.view import Camera
from fracslice.viewer import Found


def test_show_opens_on_the_mesh_of_a_scene(ball: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    meshes: list[Mesh] = []
    monkeypatch.setattr("fracslice.viewer.show", meshes.append)
    monkeypatch.setattr("fracslice.viewer.need_screen", lambda: None)
    words = ["--set", "solid.size=4cm", "--size", "2cm", "--resolution", "24", "--base", "5mm", "--quiet"]
    assert run(["show", str(ball), *words]) == 0
    assert meshes[0].size == pytest.approx((20, 20, 15), abs=0.1)


def test_check_opens_on_what_it_found(
    ball: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    shown: list[tuple[Mesh, Found]] = []
    monkeypatch.setattr("fracslice.viewer.show", lambda *what: shown.append(what))
    monkeypatch.setattr("fracslice.viewer.need_screen", lambda: None)
    words = ["--size", "2cm", "--resolution", "24", "--cavities", "keep", "--quiet", "--show"]
    assert run(["check", str(ball), *words]) == 1
    ((mesh, found),) = shown
    assert mesh.colours is not None and found.marks == []
    assert len(found.tops) == len(found.areas) and found.areas.max() == pytest.approx(314, rel=0.02)
    capsys.readouterr()
    assert run(["check", str(ball), "--layer", "1mm", "--show"]) == 2
    assert "--show: only with a mesh" in capsys.readouterr().err


def test_fly_says_where_it_ended(
    ball: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    asked = []

    def fly(*arguments: object) -> Camera:
        asked.append(arguments)
        return Camera(eye=(1.5, 0, 2), fov=30)

    monkeypatch.setattr("fracslice.viewer.fly", fly)
    assert run(["fly", str(ball), "--size", "80x60", "--set", "sphere.radius=2", "--device", "cpu"]) == 0
    path, settings, size, _, device, _ = asked[0]
    assert (path, settings, size, device) == (ball, ("sphere.radius=2",), (80, 60), "cpu")
    assert capsys.readouterr().out == '<camera eye="1.5 0 2" fov="30"/>\n'


def test_no_mesh_is_made_where_no_window_can_be(
    ball: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("fracslice.viewer.window.has_screen", lambda: False)
    monkeypatch.setattr("fracslice.jobs.mesh.make_mesh", None)
    assert run(["show", str(ball)]) == 2
    assert "there is no screen" in capsys.readouterr().err


@pytest.mark.parametrize("command", ["show", "fly"])
def test_what_is_no_scene_is_one_line(
    command: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run([command, "mandelbulp", "--quiet"]) == 2
    error = capsys.readouterr().err
    assert "mandelbulb" in error and error.count("\n") == 1
