"""Checks of model files: all those that a scene gets, each problem with its place and what mends it."""

from __future__ import annotations

import base64
import io
import json
import threading
import time
from itertools import count
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as Tree

import numpy as np
import pytest
import trimesh
from fracslice.cli.check import Deadline, place
from fracslice.cli.main import run
from PIL import Image

from fracslice.checks.problems import Problem, mends
from fracslice.mesh import Mesh
from fracslice.mesh.models import MeshField

pytestmark = pytest.mark.once

COARSE = ["--layer", "0.5mm", "--pixel", "0.5mm", "--wall", "0.4mm", "--floor", "0.4mm", "-q"]
"""The solid is sampled as finely as its limits ask."""
PLATE = (20, 20, 2)


@pytest.fixture(name="balls")
def scene_of_balls(tmp_path: Path) -> Path:
    path = tmp_path / "balls.xml"
    balls = '<sphere/><transform translate="0 0 3"><sphere radius="0.5"/></transform>'
    path.write_text(f'<scene version="1"><solid unit="4mm">{balls}</solid></scene>')
    return path


def box(size: tuple[float, float, float], height: float = 0.0) -> trimesh.Trimesh:
    part = trimesh.creation.box(size)
    part.apply_translation((0, 0, height + size[2] / 2))
    return part


def ball(radius: float, height: float) -> trimesh.Trimesh:
    part = trimesh.creation.icosphere(2, radius)
    part.apply_translation((0, 0, height + radius))
    return part


def inverted(part: trimesh.Trimesh) -> trimesh.Trimesh:
    part.invert()
    return part


@pytest.mark.parametrize(
    ("name", "parts", "problem"),
    [
        ("floating.ply", [box(PLATE), ball(4, 8)], "1 island in the air"),
        ("bar.obj", [box((400, 10, 10))], "does not fit any known printer"),
        ("sheet.stl", [box(PLATE), box((15, 0.05, 12), 1)], "of walls are thinner than 0.4 mm"),
        ("cavity.glb", [box((24, 20, 20)), inverted(box((18, 14, 14), 3))], "1 sealed cavity"),
    ],
)
def test_a_bad_model_would_not_print(
    name: str, parts: list[trimesh.Trimesh], problem: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    whole = trimesh.util.concatenate(parts)
    if name.endswith(".glb"):
        whole.apply_scale(1e-3)  # its unit is the metre
    whole.export(tmp_path / name)
    assert run(["check", str(tmp_path / name), *COARSE]) == 1
    assert problem in capfd.readouterr().out


@pytest.mark.parametrize("scale", ["100%", "150%", "100%,120%,80%"])
def test_a_model_of_the_size_that_is_advised_fits(
    scale: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    box((400, 20, 20)).export(tmp_path / "bar.stl")
    command = ["check", str(tmp_path / "bar.stl"), "--layer", "5mm", "--pixel", "5mm", "--scale", scale, "-q"]
    assert run([*command, "--fix"]) == 0
    before, after = capfd.readouterr().out.split("with --size ")
    size = after.split(":")[0]
    assert f"; --size {size}" in before
    assert run([*command, "--size", size]) == 0
    figures = after.split(": ")[1].splitlines()[0]
    assert figures in capfd.readouterr().out


def test_a_good_model_would_print_and_an_open_one_has_no_layers(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    box((20, 15, 10)).export(tmp_path / "box.3mf")
    assert run(["check", str(tmp_path / "box.3mf"), *COARSE, "--json"]) == 0
    report = json.loads(capfd.readouterr().out)
    assert report["watertight"] and report["layers"]["volume"] == pytest.approx(3000, rel=0.02)
    torn = box((20, 15, 10))
    torn.update_faces([True] * 11 + [False])
    torn.export(tmp_path / "open.stl")
    assert run(["check", str(tmp_path / "open.stl"), *COARSE]) == 1
    assert "layers" not in capfd.readouterr().out


@pytest.mark.nightly
def test_a_problem_has_its_place_and_fix_mends_it(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    trimesh.util.concatenate([box((8, 8, 2)), ball(2, 4)]).export(tmp_path / "loose.stl")
    assert run(["check", str(tmp_path / "loose.stl"), *COARSE, "--fix", "--json"]) in (0, 1)
    report = json.loads(capfd.readouterr().out)["layers"]
    (bodies,) = (p for p in report["before"]["problems"] if p["kind"] == "bodies")
    assert bodies["at"] == pytest.approx([0, 0, 4], abs=0.6) and bodies["layer"] == 8
    assert report["flags"].startswith("--bridge 1mm")
    assert "bodies" not in [p["kind"] for p in report["after"]["problems"]]


def test_fix_leaves_out_what_does_not_help(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "ball.xml").write_text('<scene version="1"><solid size="20mm"><sphere/></solid></scene>')
    command = [
        "check",
        str(tmp_path / "ball.xml"),
        *["--layer", "0.1mm", "--pixel", "0.2mm", "--fix", "--json", "-q"],
    ]
    assert run(command) == 0
    assert json.loads(capfd.readouterr().out)["flags"].startswith("--base")
    monkeypatch.setattr("fracslice.checks.problems.severity", lambda problems: (1, 0.0))  # nothing is better
    assert run(command) == 1
    report = json.loads(capfd.readouterr().out)
    assert report["flags"] == "" and report["after"] == report["before"]


STEP = """<scene version="1"><solid unit="1mm"><union><box size="4 4 4"/>
<transform translate="4 0 4"><box size="4 4 4"/></transform></union></solid></scene>"""


def test_an_object_has_one_verdict(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """Two cubes touch along an edge, one above the other: as a scene, as its layers, and as a model."""
    scene, model = tmp_path / "step.xml", tmp_path / "step.stl"
    scene.write_text(STEP)
    assert run(["mesh", str(scene), "-o", str(model), "--resolution", "16", "-q"]) == 0
    for source in ([scene, "--resolution", "16"], [scene, "--layer", "0.1mm"], [model]):
        assert run(["check", *map(str, source), *COARSE[4:]]) == 1
        out = capfd.readouterr().out
        assert out.count("would") == 1 and "would not print" in out and "  1 loose body: " in out


def test_a_model_with_faults_and_good_layers_has_one_verdict(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    other = box((20, 20, 2))
    other.apply_translation((5, 5, 0))
    trimesh.util.concatenate([box(PLATE), other]).export(tmp_path / "over.stl")
    assert run(["check", str(tmp_path / "over.stl"), *COARSE]) == 1
    out = capfd.readouterr().out
    assert out.count("would") == 1 and "would not print:" in out and "that cut or touch others" in out


@pytest.mark.nightly
def test_fix_writes_what_it_made(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    scene, made = tmp_path / "step.xml", tmp_path / "made.stl"
    scene.write_text(STEP)
    run(["check", str(scene), "--layer", "0.1mm", "--fix", *COARSE[4:], "--json", "-o", str(made)])
    report = json.loads(capfd.readouterr().out)
    assert "--bridge 1mm" in report["flags"]
    assert trimesh.load_mesh(made).body_count == 1
    assert severity_of(report["after"]) < severity_of(report["before"])


def bowl() -> trimesh.Trimesh:
    """A suction cup, unless it lies on a side."""
    hole = box((6, 6, 5), 1)
    return box((10, 10, 5)).difference(hole)


def test_fix_turns_a_model_and_writes_it(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    source, made = tmp_path / "bowl.stl", tmp_path / "made.stl"
    bowl().export(source)
    command = ["check", str(source), *COARSE, "--size", "15mm", "--fix", "--json", "-o", str(made)]
    assert run(command) == 0
    layers = json.loads(capfd.readouterr().out)["layers"]
    assert [problem["kind"] for problem in layers["before"]["problems"]] == ["cups"]
    assert layers["flags"] == "--up 1 0 0" and layers["after"]["problems"] == []
    assert layers["after"]["size"] == pytest.approx((7.5, 15, 15))
    solid = trimesh.load_mesh(made)
    assert solid.extents == pytest.approx((7.5, 15, 15), abs=1e-4)
    assert solid.volume == pytest.approx(bowl().volume * 1.5**3, rel=1e-4)


@pytest.mark.nightly
def test_fix_keeps_a_direction_that_was_asked_for(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    bowl().export(tmp_path / "bowl.stl")
    source, made = tmp_path / "bowl.stl", tmp_path / "made.stl"
    for more, size in (
        (["--up", "0", "1", "0"], (10, 5, 10)),
        (["--scale", "100%,100%,110%"], (10, 10, 5.5)),
    ):
        run(["check", str(source), *COARSE, "--fix", *more, "-o", str(made)])
        assert "with --up" not in capfd.readouterr().out
        assert trimesh.load_mesh(made).extents == pytest.approx(size, abs=1e-4)


def test_fix_says_what_it_did_not_write(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    torn, made = box(PLATE), tmp_path / "made.stl"
    torn.update_faces([True] * 11 + [False])
    torn.export(tmp_path / "torn.stl")
    assert run(["check", str(tmp_path / "torn.stl"), *COARSE, "--fix", "-o", str(made)]) == 1
    assert f"{made}: not written; fracslice repair" in capfd.readouterr().out
    assert not made.exists()


def severity_of(report: dict[str, Any]) -> int:
    return sum(int(problem["count"]) for problem in report["problems"])


def test_fix_keeps_nothing_that_holds_more_resin() -> None:
    few, many = (Problem("traps", "", count=n, resin=r) for n, r in ((3, 900.0), (9, 200.0)))
    fewest = Problem("traps", "", count=3, resin=200.0)
    assert not mends([few], [many]) and mends([fewest], [many]) and mends([], [few])


def test_fix_ends_in_time(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also within an examination; the verdict is that on the object as it is."""
    asked = count()
    monkeypatch.setattr("fracslice.cli.check.Deadline.is_set", lambda _: next(asked) > 3)
    trimesh.util.concatenate([box(PLATE), ball(4, 4)]).export(tmp_path / "loose.stl")
    assert run(["check", str(tmp_path / "loose.stl"), *COARSE, "--fix"]) == 1
    out = capfd.readouterr().out
    assert "1 loose body" in out and "with --bridge 1mm: not finished within 50 s" in out


def test_a_deadline_is_of_cpu_time_and_leaves_signals_alone() -> None:
    signal, now = threading.Event(), time.process_time()
    late, early = Deadline(signal, now - 1), Deadline(signal, now + 1000)
    assert late.is_set() and not early.is_set() and not signal.is_set()
    signal.set()
    assert early.is_set()


def test_options_of_scenes_are_refused(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    box(PLATE).export(tmp_path / "box.stl")
    assert run(["check", str(tmp_path / "box.stl"), "--voxel", "1mm"]) == 2
    assert "--voxel: only for scenes" in capfd.readouterr().err


def test_a_page_holds_figures_problems_pictures_and_the_cross_section(
    balls: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    page, out = balls.with_name("balls.html"), balls.with_name("layers")
    assert run(["slice", str(balls), "-o", str(out), *COARSE[:4], "-q", "--html", str(page)]) == 0
    text = page.read_text()
    assert "ml" in text and "<h2>Would not print</h2>" in text and "<li>1 loose body: layer" in text
    picture = base64.b64decode(text.partition("base64,")[2].partition('"')[0])
    assert Image.open(io.BytesIO(picture)).size[0] > 40
    root = Tree.fromstring(text[text.index("<svg") : text.index("</svg>") + 6])
    points = np.array([p.split(",") for p in root.find("polyline").get("points").split()], float)  # type: ignore[union-attr]
    assert points[:, 1].min() == 40 and points[:, 1].argmin() == pytest.approx(len(points) / 4.5, abs=2)
    capfd.readouterr()
    assert run(["check", str(balls), *COARSE, "--html", str(page)]) == 1
    assert "36 layers, 8.00 x 8.00 x 18.00 mm" in page.read_text()
    assert 'alt="The object"' not in page.read_text()  # without a mesh
    assert run(["check", str(balls), "--resolution", "40", "-q", "--html", str(page)]) == 1
    above, below = (
        Image.open(io.BytesIO(base64.b64decode(part.partition("base64,")[2].partition('"')[0])))
        for part in page.read_text().split('alt="The object"')[1:]
    )
    red = [((np.asarray(one)[:, :, 0] > 2 * np.asarray(one)[:, :, 1]).mean()) for one in (above, below)]
    assert red[1] > red[0] >= 0 and red[1] > 0.001  # of the ball in the air, from below
    assert run(["check", str(balls), *COARSE, "--html", "page.txt"]) == 2
    assert "page.txt: expected a file name that ends in .html" in capfd.readouterr().err


def test_a_model_is_turned_and_scaled_before_it_is_examined() -> None:
    part = box((10, 20, 5))
    model = Mesh(np.asarray(part.vertices, np.float64), np.asarray(part.faces, np.int32))
    assert place(model, (1.0, 0.0, 0.0), (1.02, 1.0, 1.1)).size.tolist() == pytest.approx([5.1, 20, 11])
    assert place(model, (0.0, 0.0, 1.0), (1.0, 1.0, 1.0)) is model


def test_a_model_smaller_than_a_layer_is_in_another_unit(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "metres.stl"
    box((0.03, 0.03, 0.03)).export(path)
    assert run(["check", str(path)]) == 2
    assert capfd.readouterr().err == (
        f"fracslice: {path}: 0.03 mm long, less than a layer: expected a model in mm\n"
    )


@pytest.mark.parametrize(
    ("thickness", "words"),
    [
        (4e-3, ("100.0% of the object's volume is finer", "of walls are thinner than 0.1 mm")),
        (1e-15, ("no layer has a pixel that is half inside: all of it is thinner",)),
    ],
)
def test_a_sheet_thinner_than_a_layer_would_not_print(
    thickness: float, words: tuple[str, ...], tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    box((10, 10, thickness)).export(tmp_path / "thin.ply")
    assert run(["check", str(tmp_path / "thin.ply"), "-q"]) == 1
    out = capfd.readouterr().out
    for part in (f"10.00 x 10.00 x {thickness:g} mm", "would not print:", *words):
        assert part in out


def test_a_plate_of_twelve_triangles_is_checked_by_few_distances(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """3.5 million. It was 9.4 million: for its extent, its bodies in finer samples and layers made twice."""
    asked, evaluate = list[int](), MeshField.kernel

    def counted(field: MeshField, *how: Any) -> Any:
        kernel = evaluate(field, *how)
        points, bricks = kernel.points, kernel.bricks
        kernel.points = lambda *xyz: asked.append(np.size(xyz[0])) or points(*xyz)  # type: ignore[method-assign]
        kernel.bricks = lambda *those: asked.append(those[-1].size) or bricks(*those)  # type: ignore[method-assign]
        return kernel

    monkeypatch.setattr(MeshField, "kernel", counted)
    box((20, 0.05, 20)).export(tmp_path / "plate.stl")
    assert run(["check", str(tmp_path / "plate.stl"), "-q"]) == 1
    assert 1e6 < sum(asked) < 4e6


def test_flipped_triangles_are_a_problem(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    flipped = box((10, 10, 10))
    flipped.faces[0] = flipped.faces[0][::-1]
    flipped.export(tmp_path / "flipped.stl")
    assert run(["check", str(tmp_path / "flipped.stl"), "-q"]) == 1
    assert "3 edges between triangles of opposite orientation" in capfd.readouterr().out


def test_the_layers_of_a_model_far_from_the_origin(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    box((20, 20, 20), 1e6).export(tmp_path / "far.stl")
    assert run(["check", str(tmp_path / "far.stl"), *COARSE]) == 0
    assert "40 layers, 20.00 x 20.00 x 20.00 mm" in capfd.readouterr().out


@pytest.mark.parametrize(
    ("size", "words"),
    [((0, 0, 0), "the mesh has only triangles without area"), ((1e30, 1, 1), "1e+30 mm long, more than")],
)
def test_a_model_without_a_size_is_named(
    size: tuple[float, float, float], words: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "odd.stl"
    part = box((1, 1, 1))
    part.apply_transform(np.diag([*size, 1]))
    part.export(path)
    assert run(["check", str(path), "-q"]) == 2
    assert capfd.readouterr().err.startswith(f"fracslice: {path}: {words}")
