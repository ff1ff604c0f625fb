"""Holes by which resin leaves: at a place, along a direction, or wherever it could not get out."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fracslice.cli.main import run
from scipy.ndimage import label

from fracslice.errors import SceneError, VolumeError
from fracslice.formulas import Node, box, cylinder, difference, gyroid, infill, sphere, transform
from fracslice.mesh.models import read_mesh
from fracslice.records import Print
from fracslice.scene import read
from fracslice.slicing import SliceJob, Slicer, Stack, plan_layers
from fracslice.volume.amount import sizing
from fracslice.work import Work
from tests.examples import stamped

pytestmark = pytest.mark.once

SIDE, WALL = 20.0, 3.0
CASE = difference(box(size=(SIDE,) * 3), box(size=(SIDE - 2 * WALL,) * 3))
"""A box around a sealed cavity."""

CUP = difference(
    cylinder(radius=10, height=20), transform(cylinder(radius=8, height=20), translate=(0, 0, 3))
)
"""Open upwards: a suction cup, as it hangs from the plate."""

BELL = transform(CUP, rotate=(1, 0, 0, 180))
"""Open to the plate, which closes it: a resin trap."""


def planned(node: Node, layer: float = 0.25, **how: Any) -> Stack:
    job = SliceJob(size=SIDE, layer=layer, pixel=0.25, printing=Print(**how))
    return plan_layers(node, job, Work(1))


def held(node: Node, **how: Any) -> float:
    """Volume without a way out through the layers up to its own, from either end, by flooding all of them."""
    stack = planned(node, layer=0.5, **how)
    solid = np.array(list(Slicer(stack, Work(1)).map(lambda layer: layer.coverage >= 128)))
    shut = [_shut(part, top) for part, top in ((solid, False), (solid[::-1], True))]
    return float((shut[0] | shut[1][::-1]).sum()) * stack.pixel[0] * stack.pixel[1] * float(stack.heights[0])


def _shut(solid: np.ndarray, begins_open: bool) -> np.ndarray:
    shut = np.zeros_like(solid)
    for k in range(len(solid)):
        number, _ = label(~solid[: k + 1])
        rim = {*number[:, 0].flat, *number[:, -1].flat, *number[:, :, 0].flat, *number[:, :, -1].flat}
        free = rim | ({*number[0].flat} if begins_open else set())
        shut[k] = ~solid[k] & ~np.isin(number[k], list(free - {0}))
    return shut


def volume(stack: Stack) -> float:
    return float(sum(Slicer(stack, Work(1)).map(lambda layer: layer.area * layer.height)))


@pytest.mark.parametrize(
    ("place", "length"),
    [
        ("8.5,2,6", WALL),  # in a wall
        ("6,2,6", WALL),  # in the cavity, near to it
        ("9.99,2,6", WALL),  # at its outside
        ("0,0,6,1,0,0", WALL),  # from the middle, as it is told
        ("0,0,6,1,1,0", WALL * math.sqrt(2)),  # into the edge, which is as thick everywhere along it
    ],
)
def test_a_hole_removes_its_cylinder_from_the_wall(place: str, length: float) -> None:
    """The volume that a hole of 2 mm removes from a wall of a known thickness."""
    made = planned(CASE, drain=2, drain_at=place)
    removed = volume(planned(CASE)) - volume(made)
    assert removed == pytest.approx(math.pi * length, rel=0.02)
    assert len(made.drains) == 1


@pytest.mark.parametrize(
    ("node", "volume"),
    stamped([(CASE, 14**3), (CUP, np.pi * 64 * 17), (BELL, np.pi * 64 * 17)], [(CUP, np.pi * 64 * 17)]),
)
def test_holes_are_drilled_until_everything_drains(node: Node, volume: float) -> None:
    assert held(node) == pytest.approx(volume, rel=0.04)
    assert held(node, drain_at="auto") < 2


def test_a_hollow_with_a_lattice_drains() -> None:
    filled = infill(sphere(radius=10), gyroid(period=8, volume_fraction=0.15), shell=1)
    assert held(filled, drain=2, drain_at="auto") < 0.02 * held(filled)


def test_the_example_with_struts_in_it_drains() -> None:
    scene = read(Path(__file__).parents[2] / "examples" / "light-ball.xml")
    job = SliceJob(layer=0.5, pixel=0.5, printing=scene.printing)
    stack = plan_layers(scene.root, job, Work(1), sizing(scene))
    assert len(stack.drains) == 2
    assert not stack.notes


def test_what_cannot_drain_is_noted() -> None:
    """Two holes in the roof leave what is below them; nothing is said of a hollow that drains."""
    notes = planned(CASE, drain=2, drain_at="0,0,18 3,0,18").notes
    assert len(notes) == 1
    assert notes[0].startswith("1 space of 2.")
    assert "--drain-at auto" in notes[0]
    assert not planned(box(size=(SIDE,) * 3), hollow=2).notes


@pytest.mark.nightly
def test_a_plug_is_what_a_hole_removed_less_the_clearance(tmp_path: Path) -> None:
    """Of a shell, a pin between two spheres, upright, whichever way the hole leads; each in its file."""
    shell = '<difference><sphere radius="12"/><sphere radius="9"/></difference>'
    (tmp_path / "a.xml").write_text(f'<scene version="1"><solid unit="1mm">{shell}</solid></scene>')
    given = [
        "--drain",
        "4mm",
        "--plugs",
        "--clearance",
        "0.2mm",
        "--resolution",
        "24",
        "--threads",
        "1",
        "-q",
    ]
    holes = ["--drain-at", "0,0,23,0,0,1", "--drain-at", "6.4,6.4,18,1,1,1"]
    run(["mesh", str(tmp_path / "a.xml"), "-o", str(tmp_path / "a.stl"), *holes, *given])
    caps = [(2 * np.pi / 3) * (r**3 - (r**2 - 1.8**2) ** 1.5) for r in (12, 9)]
    for n in (1, 2):
        plug = read_mesh(tmp_path / f"a-plug-{n}.stl")
        assert plug.to_trimesh().is_watertight
        assert plug.volume == pytest.approx(caps[0] - caps[1], rel=5e-3)
        across = np.hypot(*plug.vertices[:, :2].T).max()
        assert across == pytest.approx(1.8, abs=0.02) and plug.bounds[0][2] == pytest.approx(0, abs=1e-6)
    assert not (tmp_path / "a-plug-3.stl").exists()


@pytest.mark.parametrize(
    ("options", "reported"),
    [
        ([], "plugs: expected drain holes, by drain_at or hollow"),
        (["--drain-at", "auto", "--clearance", "1.5mm"], "less than half of the diameter of the drain holes"),
        (["--hollow", "1mm", "--parts", "2x1x1"], "plugs and parts: expected one of them"),
        (["--hollow", "1mm", "--picture", "a.png"], "--picture: not with --plugs"),
    ],
)
def test_plugs_without_holes_are_refused(
    options: list[str], reported: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    source = tmp_path / "a.xml"
    shell = '<difference><sphere radius="6"/><sphere radius="4"/></difference>'
    source.write_text(f'<scene version="1"><solid unit="1mm">{shell}</solid></scene>')
    given = ["--plugs", "--resolution", "16", "--threads", "1", *options]
    assert run(["mesh", str(source), "-o", str(tmp_path / "a.stl"), *given]) == 2
    error = capfd.readouterr().err
    assert reported in error and error.count("\n") == 1
    assert list(tmp_path.iterdir()) == [source]


@pytest.mark.parametrize(
    ("place", "reported"),
    [
        ("0,0,30", "drain-at 0,0,30: outside of the object"),
        ("0,0,10,0,0,-1", "drain-at 0,0,10: no wall with a way out behind it in that direction"),
    ],
)
def test_a_place_without_a_wall_is_refused(place: str, reported: str) -> None:
    """Downwards the plate closes the hole."""
    with pytest.raises(VolumeError, match=reported):
        planned(CASE, drain_at=place)


@pytest.mark.parametrize("text", ["1,2", "1,2,3,0,0,0", "1,2,3,0,0,1,-2", "here", "1,2,nan"])
def test_what_is_no_place_is_refused(text: str) -> None:
    with pytest.raises(SceneError, match="places x,y,z"):
        Print(drain_at=text)
