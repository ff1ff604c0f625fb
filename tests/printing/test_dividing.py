"""Objects in parts: planes, pegs, numbers, beds and files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from fracslice.cli.main import run

from fracslice.errors import SceneError
from fracslice.formulas import Node, box, cylinder, difference, transform, union
from fracslice.jobs.divided import make_parts, write_parts
from fracslice.jobs.plates import BED_TO_BED
from fracslice.mesh.models import read_mesh
from fracslice.printing.dividing import (
    DEPTH,
    SPARE,
    Divided,
    _Division,
    _Whole,
    divide,
)
from fracslice.records import MeshJob, PartsJob, Print
from fracslice.scene import scene
from fracslice.volume import plan
from fracslice.work import Work

pytestmark = pytest.mark.once

BLOCK = difference(box(size=(120, 60, 40)), cylinder(radius=15, height=100))


def divided(root: Node, how: PartsJob) -> Divided:
    """Parts of a scene in mm."""
    return divide(plan(root, 128), 1.0, how)


def test_parts_are_solids_that_add_up(tmp_path: Path) -> None:
    """But for the holes of pegs, of which two are chosen, and for the numbers."""
    solid = scene(box(size=(60, 30, 20)), unit=1.0)
    made = make_parts(solid, MeshJob(voxel="1.2mm", chord="0.01mm"), PartsJob(parts="2x1x1", clearance=0.2))
    divided = made.divided
    assert len(divided.pegs) == 2 and divided.diameter == 8 and divided.bare == 0
    assert [(part.cell, part.number) for part in divided.parts] == [((0, 0, 0), 1), ((1, 0, 0), 2)]
    assert all(mesh.is_watertight and not mesh.report.problems for mesh in made.meshes)
    holes = 2 * np.pi * 4.2**2 * (divided.length + 2 * SPARE)
    height = 8.0  # of the digits: a 1 of two bars that overlap, a 2 of five
    bar, wide = height / 7, height / 2
    one, two = bar * height, 3 * wide * bar + 2 * bar * ((height + bar) / 2 - 1.5 * bar)
    made_of = sum(mesh.volume for mesh in made.meshes)
    assert made_of == pytest.approx(60 * 30 * 20 - holes - DEPTH * (one + two), abs=6.0)
    ends = sorted(float(mesh.size[0]) for mesh in made.meshes)
    assert sum(ends) == pytest.approx(60, rel=1e-6)
    write_parts(made, tmp_path / "a.3mf", {}, Work())
    read = read_mesh(tmp_path / "a.3mf")
    assert made.peg is not None
    assert read.volume == pytest.approx(made_of + 2 * made.peg.volume, rel=1e-6)
    assert made.peg.volume == pytest.approx(np.pi * 16 * divided.length, rel=2e-3)


def test_the_whole_is_changed_for_printing_before_it_is_cut() -> None:
    """A bar whose base is cut off: its parts add up to it, but for the holes of pegs."""
    solid = scene(box(size=(24, 24, 61)), unit=1.0)
    made = make_parts(solid, MeshJob(voxel="3mm", printing=Print(base=1.0)), PartsJob(parts="1x1x2"))
    pegs = made.divided.pegs
    holes = len(pegs) * np.pi * (made.divided.diameter / 2 + 0.15) ** 2 * (made.divided.length + 2 * SPARE)
    assert sum(mesh.volume for mesh in made.meshes) == pytest.approx(24 * 24 * 60 - holes, rel=2e-3)
    assert sum(float(mesh.size[2]) for mesh in made.meshes) == pytest.approx(60, abs=1e-3)


def test_pegs_have_holes_with_their_clearance_on_both_sides() -> None:
    made = divided(BLOCK, PartsJob(parts="2x1x1", clearance="0.2mm"))
    for part in made.parts:
        side, solid = 1 if part.cell[0] else -1, part.root.tree
        assert solid is not None
        for peg in made.pegs:
            middle = np.array(peg.middle) + made.low
            within, around = (middle + np.array([side * 8, r, 0]) for r in (4.15, 4.25))
            assert solid.distance(within) > 0 > solid.distance(around)
            deep = [middle + np.array([side * x, 0, 0]) for x in (10.4, 10.6)]
            assert solid.distance(deep[0]) > 0 > solid.distance(deep[1])


def test_a_plane_passes_thin_things_by() -> None:
    """Two blocks that ten thin rods join in the middle, and one thick bar farther right."""
    rods = [transform(box(size=(30, 1, 1)), translate=(0, 4 * k - 18, 8)) for k in range(10)]
    blocks = [transform(box(size=(30, 50, 30)), translate=(x, 0, 0)) for x in (-25, 35)]
    bar = transform(box(size=(20, 12, 12)), translate=(10, 0, 0))
    bridge = transform(box(size=(12, 12, 12)), translate=(-4, 0, 0))
    (peg, *_) = divided(union(*rods, *blocks, bar, bridge), PartsJob(parts="2x1x1")).pegs
    at = peg.middle[0] - 40  # from the middle of the box, in scene units
    assert -40 < at < -13 or 23 < at < 50


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("above", [False, True])
def test_numbers_are_read_from_outside(axis: int, above: bool) -> None:
    whole = _Whole(BLOCK, BLOCK.bounds.box, 1.0, Work())
    division = _Division(whole, [[], [], []], [], 0.15, [])
    middle = (60.0, 30.0, 20.0)
    bars = union(*division.digits("2", middle, axis, above, 7.0))
    outward = (-1.0 if above else 1.0) * np.eye(3)[axis]
    up = np.eye(3)[1 if axis == 2 else 2]
    right = np.cross(up, outward)  # of who looks against the outward direction
    at = {"a": (0, 3), "b": (1.5, 1.5), "c": (1.5, -1.5), "d": (0, -3), "e": (-1.5, -1.5), "f": (-1.5, 1.5)}
    low = np.array(whole.box.lo)
    found = {
        name
        for name, (u, v) in at.items()
        if bars.distance((low + middle + u * right + v * up - 0.5 * DEPTH * outward).tolist()) < 0
    }
    assert found == set("abed")


def test_the_command_writes_beds_or_files(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("a.xml").write_text('<scene version="1"><solid unit="1mm"><box size="50 30 20"/></solid></scene>')
    assert run(["mesh", "a.xml", "-o", "a.3mf", "--bed", "30x35x25mm", "--voxel", "1mm"]) == 0
    shown = capfd.readouterr().out.splitlines()
    assert shown[0].startswith("a.3mf, part 1: ") and shown[-3:-1] == [
        "2 pegs, 8 mm thick, 20 mm long",
        "3 beds",
    ]
    lib3mf = pytest.importorskip("lib3mf")
    model = lib3mf.get_wrapper().CreateModel()
    reader = model.QueryReader("3mf")
    reader.SetStrictModeActive(True)
    reader.ReadFromFile("a.3mf")
    assert reader.GetWarningCount() == 0 and model.GetBuildItems().Count() == 4
    vertices = read_mesh("a.3mf").vertices
    x = vertices[:, 0] % (30 * BED_TO_BED)
    assert vertices[:, 1].min() > -1e-4 and vertices[:, 1].max() < 35 and (x < 30.001).all()
    assert run(["mesh", "a.xml", "-o", "a.stl", "--parts", "1x1x1", "--voxel", "1mm", "-q"]) == 0
    assert run(["mesh", "a.xml", "-o", "b.stl", "--parts", "2x1x1", "--voxel", "1mm", "-q"]) == 0
    assert {path.name for path in Path().glob("*.stl")} == {"a-1.stl", "b-1.stl", "b-2.stl", "b-peg.stl"}


@pytest.mark.parametrize(
    ("options", "line"),
    [
        ("--bed 10x10x10mm", "bed 10x10x10mm: expected at least 20mm along each side, for pegs"),
        ("--bed 30x30", "'30x30': expected three lengths such as 220x220x250mm"),
        ("--bed 40x40x40mm --parts 1x1x1", "parts of 50 x 30 x 20 mm do not fit a bed of 40x40x40mm"),
        ("--parts auto", "parts auto: expected a bed, too, such as 220x220x250mm"),
        ("--parts 2x2", "'2x2': expected auto or parts along x, y and z, such as 2x1x1"),
        ("--parts 8x1x1", "8 parts along x, each 6.25 mm long: expected at least 10 mm, for pegs"),
        ("--parts 5x5x5", "5 x 5 x 5 parts: expected at most 64"),
        ("--parts 2x1x1 --supports light", "parts: expected no supports"),
    ],
)
def test_what_is_wrong_is_one_line(
    options: str, line: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    source = tmp_path / "a.xml"
    source.write_text('<scene version="1"><solid unit="1mm"><box size="50 30 20"/></solid></scene>')
    assert run(["mesh", str(source), "-o", str(tmp_path / "x.3mf"), *options.split()]) == 2
    found = capfd.readouterr().err
    assert line in found and found.count("\n") == 1 and list(tmp_path.iterdir()) == [source]


def test_python_says_what_it_expects() -> None:
    assert PartsJob(bed="22x22x25cm").bed == (220, 220, 250)
    with pytest.raises(SceneError, match="bed='big': expected three lengths"):
        PartsJob(bed="big")
