"""The inside of a scene, as a studio shows it, without a page."""

from __future__ import annotations

import math
import time
import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fracslice import box, cylinder, make_mesh, sphere, transform
from fracslice.errors import SceneError
from fracslice.fields.box import Box
from fracslice.mesh.drawing import SECTION, Plane
from fracslice.records import Print, SliceJob
from fracslice.scene.view import Camera
from fracslice.slicing import plan_stack
from fracslice.studio.cut_face import CutFace
from fracslice.studio.inside import Inside
from fracslice.studio.layer_view import HANGS, HELD, ISLAND, PrintLayers
from fracslice.studio.measuring import Mark, Overlay, Tracer, angle, circle, readout
from fracslice.studio.measuring import sphere as best_sphere
from fracslice.studio.session import Session
from fracslice.studio.solid import MEASURES, SceneSolid, graded, legend, thickness_at
from fracslice.volume import Pillars, Supports
from fracslice.volume.amount import Sizing
from fracslice.work import Work
from tests.waiting import wait_until

from .conftest import Begin

pytestmark = pytest.mark.once

SCENE = """<scene version="1">
  <solid unit="1mm">
    <union>
      <box size="10 10 4"/>
      <transform translate="0 0 6"><box size="6 6 2"/></transform>
    </union>
  </solid>
  <film samples="1"/>
</scene>
"""
WORK = Work(threads=1)


@pytest.fixture
def studio(begin: Begin) -> Session:
    return begin("two.xml", SCENE, (96, 64))


@pytest.fixture
def inside(studio: Session) -> Inside:
    studio.inside.fineness = 24.0
    return studio.inside


def done(studio: Session) -> str:
    """What the last job says, once it is done."""
    wait_until(lambda: studio.job is not None and studio.job.is_done)
    assert studio.job
    return studio.job.result or studio.job.problem


def rows(pairs: list[tuple[str, str]]) -> dict[str, str]:
    return dict(pairs)


def test_the_mesh_is_shown_and_cut_open(studio: Session, inside: Inside) -> None:
    inside.show("mesh")
    assert "triangles" in done(studio)
    figures = rows(inside.told["figures"])
    assert float(figures["volume"].split()[0]) == pytest.approx(0.472, rel=0.02)
    assert figures["bodies"] == "2 bodies" and figures["checked"].startswith("closed")
    wait_until(lambda: studio.shown.samples == 1 and studio.live.size == (96, 64))
    studio.cut("x", 0.5)
    wait_until(lambda: (studio.shown.pixels == SECTION).all(2).any())
    assert studio.document.is_saved
    inside.show("field")
    wait_until(lambda: not (studio.shown.pixels == SECTION).all(2).any())


def test_a_mesh_of_an_earlier_scene_is_said_to_be(studio: Session, inside: Inside) -> None:
    inside.show("mesh")
    done(studio)
    assert not inside.told["stale"]
    studio.set_number((0, 0, 0), "size", 0, 8)
    assert inside.told["stale"]


def test_print_edits_are_written_and_compared(studio: Session, inside: Inside) -> None:
    inside.edit("base", "1mm")
    inside.edit("drain", "2mm")
    assert '<print base="1mm" drain="2mm"/>' in studio.document.text
    inside.edit("drain", "")
    assert inside._host.scene.printing == Print(base=1.0)
    base = next(edit for edit in inside.edits if edit["name"] == "base")
    assert base["value"] == 1.0 and base["text"] == "1mm" and base["most"] >= 2
    inside.edit("size", "20mm")
    assert not studio.document.problem and studio.document.scene.size_mm == 20
    studio.edit(studio.document.undo)
    inside.show("mesh")
    done(studio)
    inside.compare(True)
    done(studio)
    told = inside.told
    before, after = (float(rows(told[name])["volume"].split()[0]) for name in ("figures", "other"))
    assert before == pytest.approx(0.472, rel=0.02) and after < 0.9 * before


def test_layers_show_islands_in_the_pixels_of_a_printer(studio: Session, inside: Inside) -> None:
    inside.printer = "sl1s"
    inside.show("layers")
    inside.plan("sl1s", 0.5)
    wait_until(lambda: studio.job is not None and studio.job.name == "layers" and studio.job.is_done)
    inside.plan("sl1s", 0.5)
    assert done(studio) == "18 layers"
    inside.scrub(14)
    wait_until(lambda: (studio.shown.pixels == ISLAND).all(2).sum() > 100)
    shown = rows(inside.told["rows"])
    assert shown["islands"] == "1" and float(shown["area"].split()[0]) == pytest.approx(36, rel=0.01)
    assert float(shown["resin"].split()[1]) == pytest.approx(0.472, rel=0.15) and shown["time"].endswith(
        "min"
    )
    inside.scrub(15)
    wait_until(lambda: not (studio.shown.pixels == ISLAND).all(2).any())
    assert not (studio.shown.pixels == HANGS).all(2).any()
    area = (studio.shown.pixels > 100).all(2).sum()
    inside.zoom(2)
    wait_until(lambda: (studio.shown.pixels > 100).all(2).sum() > 1.2 * area)
    inside.drag(400, 0)
    wait_until(lambda: not (studio.shown.pixels > 100).all(2).any())


def test_supports_of_a_layer_are_told_from_the_object() -> None:
    ball = transform(sphere(2), translate=(0, 0, 4))
    rod = transform(cylinder(0.5, 3), translate=(0, 0, 1.5))
    size = Sizing.of(6.0)
    stack = plan_stack(ball | rod, SliceJob(layer=0.5, pixel=0.1), WORK, size)
    ends = np.array([[[0, 0, -1.0, 0.5], [0, 0, 3, 0.5]]])
    held = Supports(ball, rod, Pillars(ends, 0.0, np.empty((0, 4))), 0.5, 1, 0, 1.0, 0.1, np.empty((0, 3)))
    layers = PrintLayers(replace(stack, supports=held), WORK, None, None)
    assert (layers.look(1).classes == HELD).sum() == pytest.approx(100 * np.pi / 4, rel=0.2)
    assert not (layers.look(8).classes == HELD).any()


def test_layers_are_written_for_the_printer(studio: Session, inside: Inside, tmp_path: Path) -> None:
    with pytest.raises(SceneError, match=r"two\.sl1: choose the printer"):
        studio.start("two.sl1", {})
    inside.printer, inside.layer = "sl1s", 0.5
    with pytest.raises(SceneError, match=r"reads \.sl1 files: make two\.sl1"):
        studio.start("two.goo", {})
    studio.start("two.sl1", inside.layer_options)
    assert done(studio) == "two.sl1: 18 layers" and studio.job
    assert studio.job.command == "fracslice slice two.xml -o two.sl1 --printer sl1s --layer 0.5mm"
    with zipfile.ZipFile(tmp_path / "two.sl1") as file:
        assert sum(name.endswith(".png") and "thumbnail" not in name for name in file.namelist()) == 18


def test_a_check_lists_problems_and_flies_to_them(studio: Session, inside: Inside) -> None:
    inside.layer = 0.5
    inside.check()
    assert done(studio) == "would not print"
    told = inside.told
    kinds = [problem["kind"] for problem in told["problems"]]
    assert told["verdict"] == "would not print" and "bodies" in kinds
    bodies = kinds.index("bodies")
    inside.go_to(bodies)
    floating = (0.0, 0.0, 5.0)  # middle of the lower face of the upper box, scene units
    np.testing.assert_allclose(studio.views.camera.target, floating, atol=0.3)
    away = np.subtract(studio.views.camera.eye, floating)
    assert np.linalg.norm(away) == pytest.approx(0.5 * 10, rel=0.05)
    assert inside.overlay.marks[0].label == "bodies"
    inside.show("layers")
    inside.go_to(bodies)
    assert inside.index == 14
    name, value = told["problems"][bodies]["mend"][0]
    inside.edit(name, value)
    assert f'{name}="{value}"' in studio.document.text


def test_points_of_the_field_are_measured(studio: Session, inside: Inside) -> None:
    studio.live.look(Camera(eye=(0.0, -40.0, 0.0), target=(0.0, 0.0, 0.0), fov=30))
    wait_until(lambda: studio.shown.camera.eye == (0.0, -40.0, 0.0))
    inside.pick((48, 32))
    assert rows(inside.told["measures"]) == {"point 1": "0.000 -5.000 2.000 mm", "thickness": "10 mm"}
    inside.pick((0, 0))
    assert len(inside.points) == 1
    inside.points += [np.array([3.0, -5.0, 0.0]), np.array([3.0, -5.0, 4.0])]
    told = rows(inside.told["measures"])
    assert told["distance"] == "4 mm" and told["angle"] == "90 degrees" and told["circle"] == "radius 2.5 mm"
    marked = inside.over(studio.shown)
    inside.forget()
    assert inside.told["measures"] == [] and (inside.over(studio.shown) == studio.shown.pixels).all()
    inside.points, inside.bed, inside.printer = [], True, "sl1s"
    inside.draw()
    assert (inside.over(studio.shown) != marked).any() and len(inside.overlay.marks) == 12


def test_points_of_a_mesh_are_measured(studio: Session, inside: Inside) -> None:
    inside.show("mesh")
    done(studio)
    studio.live.look(Camera(eye=(0.0, -40.0, 0.0), target=(0.0, 0.0, 0.0), fov=30))
    inside.measuring = True
    wait_until(lambda: studio.shown.camera.eye == (0.0, -40.0, 0.0))
    inside.pick((48, 32))
    np.testing.assert_allclose(inside.points[0][1], -5.0, atol=1e-3)
    assert inside.there == []  # 10 mm are more than a quarter of the object
    assert inside.solid
    top = thickness_at(inside.solid, np.array([1.0, 1.0, 7.0]), np.array([0.0, 0.0, 1.0]))
    assert top == pytest.approx(2, abs=0.05)
    inside.hover((48, 32))
    assert inside.hovered.endswith("mm") and "-5.0" in inside.hovered


def test_all_is_forgotten(studio: Session, inside: Inside) -> None:
    inside.show("mesh")
    done(studio)
    inside.release()
    assert inside.told["mode"] == "field" and not inside.told["figures"] and inside.told["count"] == 0


def test_colours_measure_the_surface() -> None:
    made = make_mesh(sphere(10) - sphere(8) - box((30, 30, 0.5)), resolution=64, threads=1)
    solid = SceneSolid(made)
    for name in MEASURES:
        solid.measure(name, WORK)
        assert solid.coloured(name).colours is not None and legend(solid, name)["unit"] == MEASURES[name].unit
    place = made.vertices - made.vertices.mean(0)
    flat = np.abs(place[:, 2]) > 2
    outside = flat & (np.linalg.norm(place, axis=1) > 9)
    assert np.median(solid.known["thickness"][outside]) == pytest.approx(2, abs=0.02)
    assert np.median(solid.known["curvature"][outside]) == pytest.approx(0.1, rel=0.05)
    assert np.median(solid.known["curvature"][flat & ~outside]) == pytest.approx(-0.125, rel=0.05)
    rim = np.abs(place[:, 2]) < 0.3
    assert np.median(solid.known["gap"][rim]) == pytest.approx(0.5, abs=0.1)
    below = outside & (np.abs(place[:, 2] + 7) < 0.5)
    np.testing.assert_allclose(solid.known["overhang"][below].mean(), np.degrees(np.arcsin(0.7)), atol=3)
    assert 0 < np.median(solid.known["error"]) < 1000 * 0.1 * made.report.voxel_mm


def test_points_snap_to_the_root() -> None:
    ball = sphere(5)
    tracer = Tracer(ball, ball.bounds.box, 0.02)
    seen = np.array([0.3, -4.89, 1.0])
    point = tracer.snapped(seen)
    assert np.linalg.norm(point) == pytest.approx(5, abs=1e-12) and np.linalg.norm(point - seen) < 0.01
    assert (tracer.snapped(2 * seen) == 2 * seen).all()
    assert tracer.thickness(point) == pytest.approx(10, abs=1e-6)
    assert tracer.radius(point) == pytest.approx(5, rel=1e-4)
    hollow = Tracer(box((20, 20, 20)) - ball, Box((-10.0,) * 3, (10.0,) * 3), 0.02)
    assert hollow.radius(np.array([3.0, 4.0, 0.0])) == pytest.approx(-5, rel=1e-4)
    assert math.isinf(hollow.radius(np.array([10.0, 0.0, 0.0])))
    camera = Camera(eye=(0.0, -20.0, 0.0), target=(0.0, 0.0, 0.0))
    view = tracer.view(np.array([0.0, 5.0, 0.0]), camera, 4.0)  # the far side is not seen from the front
    assert view.eye[1] >= 5 and view.target == (0.0, 5.0, 0.0)


def test_points_make_angles_circles_and_spheres() -> None:
    corners = 5 * np.eye(3)
    assert angle(*corners) == pytest.approx(60) and circle(*corners) == pytest.approx(5 * (2 / 3) ** 0.5)
    assert circle(*np.outer([1, 2, 3], [1.0, 1, 1])) > 1e15
    points = 7 + np.concatenate([corners, -corners[:1]])
    assert best_sphere(points) == pytest.approx((5, 0), abs=1e-9)
    assert dict(readout(list(points)))["sphere"].startswith("radius 5 mm")


def test_marks_behind_the_eye_are_not_drawn() -> None:
    camera, size = Camera(eye=(0.0, -5.0, 0.0), target=(0.0, 0.0, 0.0)), (64, 48)
    black = np.zeros((12, 16, 3), np.uint8)
    for y, drawn in ((-10.0, False), (0.0, True)):
        mark = Mark(np.array([[-1.0, y, 0.0], [1.0, y, 0.0]]), (255, 0, 0))
        assert Overlay((mark,)).over(black, camera, size).any() == drawn
    through = Mark(np.array([[0.0, -10.0, -1.0], [0.0, 10.0, 1.0]]), (255, 0, 0))
    assert Overlay((through,)).over(black, camera, size).any()


def test_what_was_made_is_freed_after_the_last_tab(
    studio: Session, inside: Inside, monkeypatch: pytest.MonkeyPatch
) -> None:
    pages = pytest.importorskip("fracslice.studio.page")
    page = pages.Page(studio)
    inside.show("mesh")
    done(studio)
    monkeypatch.setattr(pages, "AWAY", 0.0)
    for tabs, kept in ((2, True), (-1, True), (-1, False)):
        page.gate.count(tabs)
        time.sleep(0.001)
        page._forget()
        assert inside.has_made == kept


def test_a_mesh_is_seen_from_inside_and_the_field_from_outside(studio: Session, inside: Inside) -> None:
    inside.show("mesh")
    done(studio)
    within_it = Camera(eye=(0.0, 0.0, 0.0), target=(0.0, 1.0, 0.0))
    studio.live.look(within_it)
    wait_until(lambda: studio.shown.camera == within_it)
    assert studio.shown.distance > 0
    inside.show("field")
    wait_until(lambda: studio.shown.camera == studio.live.first)


@pytest.mark.parametrize("kind", ["perspective", "orthographic"])
def test_the_face_of_a_cut_shows_distances(kind: str) -> None:
    """A ball cut through its middle: rings, whose values are those of the radius, exactly."""
    ball, plane = sphere(1.0), Plane((1.0, 0.0, 0.0), 0.0)
    face = CutFace(ball, plane, ball.bounds.box, 20.0)
    assert float(face.legend["high"]) == pytest.approx(20, rel=1e-3)
    camera = Camera(eye=(4.0, 0.0, 0.0), target=(0.0, 0.0, 0.0), kind=kind, fov=40.0)
    black = np.zeros((90, 160, 3), np.uint8)
    seen = face.over(black, camera, (320, 180))
    painted = seen.any(2)
    radius = 45 / (4 * math.tan(math.radians(20)))  # pixels of a length of 1
    rows, columns = np.indices(painted.shape) + 0.5
    away = np.hypot(rows - 45, columns - 80) / radius
    assert (painted == (away < 1)).mean() > 0.999
    at = painted & (away < 0.99)
    fits = (seen == graded(1 - away.ravel(), (0.0, 1.0)).reshape(seen.shape)).all(2)
    assert 0.7 < fits[at].mean() < 1  # all but lines between bands
    behind = replace(camera, eye=(-4.0, 0.0, 0.0))
    assert not face.over(black, behind, (320, 180)).any()


def test_distances_are_switched_on_in_the_page(studio: Session, inside: Inside) -> None:
    studio.cut("x", 0.5)
    plain = inside.over(studio.shown)
    inside.distances = True
    assert (inside.over(studio.shown) != plain).any()
    assert inside.told["face"]["unit"] == "mm"
    studio.cut("", 0.5)
    assert inside.over(studio.shown) is studio.shown.pixels
