"""fracslice explore: variations of a scene on a contact sheet."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from fracslice.cli.main import run
from PIL import Image

from fracslice.formulas import (
    julia,
    mandelbulb,
    material,
    menger,
    orbit,
    sphere,
    superquadric,
    transform,
    union,
)
from fracslice.scene import Scene, read
from fracslice.scene.layout import varied

pytestmark = pytest.mark.once

SOURCE = '<scene version="1"><solid size="40mm"><superquadric exponent="3"/></solid></scene>'


@pytest.fixture
def source(tmp_path: Path) -> Path:
    path = tmp_path / "own.xml"
    path.write_text(SOURCE)
    return path


def explored(source: Path, name: str, *options: str) -> Path:
    target = source.parent / f"{name}.png"
    small = ("--size", "24x18", "--samples", "1", "--quiet")
    assert run(["explore", str(source), "-o", str(target), *small, *options]) == 0
    return target


def test_a_sheet_has_a_scene_for_each_picture_and_can_be_gone_on_from(source: Path) -> None:
    sheet = explored(source, "sheet", "--count", "5")
    assert Image.open(sheet).size == (72, 36)
    scenes = [read(path) for path in sorted(sheet.with_suffix("").iterdir())]
    assert [path.name for path in sorted(sheet.with_suffix("").iterdir())] == [f"0{k}.xml" for k in range(5)]
    assert scenes[0] == read(source) and len({scene.root["exponent"] for scene in scenes}) == 5
    onward = explored(sheet.with_suffix("") / "03.xml", "onward", "--count", "2")
    assert read(onward.with_suffix("") / "00.xml") == scenes[3]


def test_a_seed_makes_the_same_sheet_whatever_the_count(source: Path) -> None:
    a, b, c = (explored(source, n, "--count", k, "--seed", s) for n, k, s in ("a21", "b31", "c22"))
    first, same, other = ((p.with_suffix("") / "01.xml").read_text() for p in (a, b, c))
    assert first == same != other


def test_a_smaller_sheet_leaves_no_scene_of_a_larger_one(source: Path) -> None:
    folder = explored(source, "sheet", "--count", "4").with_suffix("")
    for name in ("mine.xml", "09.xml"):
        (folder / name).write_text("mine")
    explored(source, "sheet", "--count", "2")
    assert sorted(path.name for path in folder.iterdir()) == ["00.xml", "01.xml", "09.xml", "mine.xml"]


def test_a_sheet_does_not_replace_its_own_scene(source: Path, capsys: pytest.CaptureFixture[str]) -> None:
    sheet = explored(source, "sheet", "--count", "2")
    scene = sheet.with_suffix("") / "01.xml"
    before = scene.read_text()
    assert run(["explore", str(scene), "-o", str(sheet)]) == 2
    assert f"sheet.png: its scenes replace {scene}: expected another name" in capsys.readouterr().err
    assert scene.read_text() == before


def test_nothing_is_written_for_bad_input(source: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = sorted(source.parent.iterdir())
    target = str(source.parent / "sheet.png")
    for options in (["-o", "x.jpg"], ["-o", target, "--spread", "0"]):
        assert run(["explore", str(source), *options]) == 2
        assert len(capsys.readouterr().err.splitlines()) == 1
    assert sorted(source.parent.iterdir()) == before


def test_numbers_stay_within_their_ranges_and_the_look_stays() -> None:
    root = union(
        material(transform(superquadric(exponent=90), translate=(0.3, 0, 0)), colour=(0.2, 0.3, 0.4)),
        julia(iterations="auto"),
        menger(level=3),
        sphere(radius=0.5),
        smooth=0.05,
    )
    for k in range(4):
        new = varied(Scene(root, 40.0), (0, k), 2.0).root
        painted, bulb, sponge, _ = new.children
        assert painted.values == root.children[0].values
        assert painted.children[0].values == root.children[0].children[0].values
        assert 2 <= painted.children[0].children[0]["exponent"] <= 100
        assert bulb["iterations"] == "auto" and max(map(abs, bulb["c"])) <= 4
        assert 0 <= sponge["level"] <= 20 and new != root


@pytest.mark.nightly
def test_steps_of_a_hybrid_are_varied() -> None:
    """Their bailout and iterations are those of the hybrid; only they repeat."""
    root = orbit(mandelbulb(8), transform(mandelbulb(3, repeat=2), scale=1.1), iterations=1)
    new = varied(Scene(root, 40.0), (0, 0), 1.5).root
    assert new != root
    assert {step["bailout"] for step in (new.children[0], *new.children[1].children)} == {2}
    assert varied(Scene(mandelbulb(iterations=2), 40.0), (0, 0), 4.0).root["repeat"] == 1


def test_every_variation_is_another_scene() -> None:
    """Whole numbers stay in most draws."""
    root = menger(level=2)
    assert all(varied(Scene(root, 40.0), (2, k), 0.3).root != root for k in range(5))


def test_every_variation_holds_a_solid() -> None:
    for k in range(3):
        root = varied(Scene(mandelbulb(iterations=4, julia=(0.9, -0.6, 0.5)), 40.0), (1, k), 1.0).root
        points = np.random.default_rng(5).uniform(root.bounds.box.lo, root.bounds.box.hi, (20000, 3))
        assert (root.distance(points) < 0).any()
