"""What a studio does without a page."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh

from fracslice import Mesh
from fracslice.common.parameters import File
from fracslice.errors import SceneError
from fracslice.fields.depth import resolve_depths
from fracslice.formulas import Node, burning_ship, mandelbulb, sphere, transform
from fracslice.scene import read
from fracslice.scene.layout import registered_formulas
from fracslice.studio import panels
from fracslice.studio.document import Tag, required
from fracslice.studio.session import Session, loosened
from fracslice.work import Work
from tests.waiting import wait_until

from .conftest import Begin

pytestmark = pytest.mark.once

TEXT = """<scene version="1">
  <solid unit="1mm">
    <sphere radius="5"/>
  </solid>
  <film samples="2"/>
</scene>
"""
BALL = (0, 0)


@pytest.fixture
def studio(begin: Begin) -> Session:
    return begin("ball.xml", TEXT, (48, 32))


def rest(studio: Session) -> np.ndarray:
    """The picture with all of its samples."""
    wait_until(lambda: studio.shown.samples == 2 and studio.shown.camera == studio.live.aim)
    return studio.shown.pixels


def test_an_edit_is_seen_and_undone(studio: Session) -> None:
    before = rest(studio)
    studio.set_number(BALL, "radius", 0, 3)
    wait_until(lambda: studio.live.scene.root == sphere(radius=3.0))
    smaller = rest(studio)
    assert abs(smaller.astype(int) - before).mean() > 2
    studio.edit(studio.document.undo)
    wait_until(lambda: studio.live.scene.root == sphere(radius=5.0))
    np.testing.assert_array_equal(rest(studio), before)


def test_what_cannot_be_done_is_said(studio: Session) -> None:
    studio.edit(studio.document.remove, ())
    assert "expected an element" in studio.message
    studio.edit(studio.document.set_value, BALL, "radius", "x")
    assert "radius" in studio.document.problem and studio.document.scene.root == sphere(radius=5.0)


def test_the_camera_turns_around_its_target_and_is_kept(studio: Session) -> None:
    first = studio.live.aim
    studio.views.orbit(120, 40)
    studio.views.approach(3)
    turned = studio.live.aim
    arms = [np.subtract(camera.eye, camera.target) for camera in (first, turned)]
    np.testing.assert_allclose(turned.target, first.target, atol=1e-12)
    assert np.linalg.norm(arms[1]) == pytest.approx(np.linalg.norm(arms[0]) / 1.1**3)
    wait_until(lambda: studio.shown.camera == turned)
    studio.keep_view()
    studio.save()
    saved = read(studio.target).view.camera
    assert saved is not None
    np.testing.assert_allclose(saved.eye, turned.eye, rtol=1e-8)
    assert studio.document.is_saved and studio.document.text.count("<camera") == 1


def test_files_are_made_in_the_folder_alone(studio: Session, tmp_path: Path) -> None:
    studio.start("ball.stl", {"resolution": 24.0})
    wait_until(lambda: studio.job is not None and studio.job.is_done)
    assert studio.job and studio.job.result.startswith("ball.stl")
    assert Mesh.load(tmp_path / "ball.stl").volume == pytest.approx(500 / 3 * np.pi, rel=0.02)
    studio.start("ball.png", {"samples": 1, "size": (40, 30)})
    wait_until(lambda: studio.job is not None and studio.job.is_done)
    assert (tmp_path / "ball.png").exists()
    for name in ("../ball.stl", "/ball.stl", "ball.txt"):
        with pytest.raises(SceneError, match=r"ball\.(stl|txt)"):
            studio.start(name, {})


def test_a_notebook_makes_the_mesh_of_the_scene(
    studio: Session, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    studio.start("ball.ipynb", {"resolution": 24.0})
    wait_until(lambda: studio.job is not None and studio.job.is_done)
    assert studio.job and (studio.job.result, studio.job.command) == ("ball.ipynb is written", "")
    code = [c["source"] for c in json.loads((tmp_path / "ball.ipynb").read_text())["cells"][1:]]
    assert "studio = Studio(scene)" in code[1]
    exec(f"{code[0]}\n{code[2]}", {})
    assert Mesh.load(tmp_path / "ball.3mf").volume == pytest.approx(500 / 3 * np.pi, rel=0.02)


def test_a_job_is_cancelled_without_a_file(studio: Session, tmp_path: Path) -> None:
    studio.start("ball.stl", {"resolution": 900.0})
    assert studio.job
    studio.start("other.stl", {})
    assert "ball.stl is being made" in studio.message
    studio.job.cancel.set()
    wait_until(lambda: studio.job is not None and studio.job.is_done)
    assert "cancelled" in studio.job.problem and not list(tmp_path.glob("*.stl"))


def test_a_model_is_a_scene_of_its_own(tmp_path: Path) -> None:
    trimesh.creation.box((4, 5, 6)).export(tmp_path / "block.stl")
    studio = Session(str(tmp_path / "block.stl"), tmp_path, Work(threads=1), "cpu")
    try:
        assert studio.document.scene.root.formula.name == "model" and studio.document.scene.name == "block"
        studio.edit(studio.document.wrap, BALL, "shell")
        assert studio.document.problem == ""
        studio.save()
        assert read(tmp_path / "block.xml").root.formula.name == "shell"
    finally:
        studio.close()


def test_random_numbers_keep_the_text(studio: Session) -> None:
    for root, picture in studio.variations(0.5, 3):
        assert picture.shape == (150, 200, 3) and np.ptp(picture) > 50
        studio.take(root)
    assert studio.document.scene.root != sphere(radius=5.0) and studio.document.problem == ""
    radius = studio.document.find(BALL).attributes["radius"]  # type: ignore[union-attr]
    assert studio.document.text == TEXT.replace('"5"', f'"{radius}"')


def test_a_section_cuts_the_picture_and_not_the_file(studio: Session) -> None:
    whole = rest(studio)
    studio.cut("z", 0.5)
    wait_until(lambda: studio.live.scene.root.formula.name == "intersection")
    half = studio.live.scene.root
    assert half.distance([0, 0, 0.1]) == pytest.approx(0.1) and half.distance([0, 0, -1]) == pytest.approx(-1)
    assert abs(rest(studio).astype(int) - whole).mean() > 2
    studio.start("ball.stl", {"resolution": 16.0})
    wait_until(lambda: studio.job is not None and studio.job.is_done)
    assert studio.job and studio.job.result
    studio.cut("", 0.5)
    wait_until(lambda: studio.live.scene.root == sphere(radius=5.0))
    assert studio.document.is_saved


def program(root: Node) -> object:
    """Code of a field; another one is compiled."""
    return resolve_depths(root, 0.01).linked.program


def test_no_power_is_compiled_by_itself() -> None:
    for made in (mandelbulb, burning_ship):
        powers = [
            loosened(transform(made(power=power), translate=(1, 0, 0))) for power in (3.0, 7.0, 7.5, 8.0)
        ]
        assert len({program(root) for root in powers}) == 1
    assert loosened(sphere(radius=2.0)) == sphere(radius=2.0)


def test_controls_follow_from_the_registry(studio: Session) -> None:
    document = studio.document
    (radius,) = panels.controls(document.find(BALL))  # type: ignore[arg-type]
    assert (
        radius["kind"] == "slider" and radius["values"] == [5.0] and 0 < radius["least"] < 5 < radius["most"]
    )
    document.add((), "light")
    light = {control["name"]: control for control in panels.controls(document.find((2,)))}  # type: ignore[arg-type]
    assert light["kind"]["kind"] == "choice" and "sun" in light["kind"]["choices"]
    assert light["colour"]["stops"] == ["#ffffff"] and light["colour"]["most"] == 1
    assert panels.colour_text(["#ff8000", "#000000"]) == "1 0.502 0 0 0 0"
    paint = Tag("material", {"colour": "1 0 0 0 0 1"}, (), 1, 0, 0)
    (colours,) = (control for control in panels.controls(paint) if control["name"] == "colour")
    assert colours["stops"] == ["#ff0000", "#0000ff"] and colours["most"] == 8
    for choice in panels.choices():
        tag = replace(document.root, name=choice["name"], attributes={})
        assert choice["doc"] and all(control["doc"] for control in panels.controls(tag))


def test_every_new_element_has_values_of_its_kinds() -> None:
    for name, formula in registered_formulas().items():
        for attribute, value in required(name).items():
            kind = formula.parameters[attribute]
            assert value or isinstance(kind, File) or name == "text"
            if value:
                kind.read(value)


def test_the_camera_is_focused_on_what_is_under_the_mouse(studio: Session) -> None:
    studio.focus_on((24.0, 16.0))
    camera = studio.document.scene.view.camera
    assert camera and camera.focus and camera.aperture > 0
    assert camera.focus == pytest.approx(np.linalg.norm(camera.eye) - 5.0, rel=1e-2)
    studio.focus_on((0.0, 0.0))
    assert "no surface" in studio.message
