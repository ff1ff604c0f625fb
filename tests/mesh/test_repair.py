"""Repairs of models that are no solid: the solid that was meant, and what is said of the changes."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from fracslice.cli.main import run

from fracslice.common.arrays import concatenate
from fracslice.mesh import Mesh
from fracslice.mesh.checks import repair
from fracslice.mesh.cleaning import quantise_mesh
from fracslice.mesh.models import faults, read_mesh

from . import shapes

pytestmark = pytest.mark.once
pytest.importorskip("pymeshlab")


def with_t_vertex() -> Mesh:
    """A cube one of whose triangles is cut in two, and its neighbour is not."""
    cube = shapes.cube()
    a, b, c = cube.triangles[0].tolist()
    vertices = np.vstack([cube.vertices, cube.vertices[[a, b]].mean(0)])
    return Mesh(vertices, np.vstack([cube.triangles[1:], np.array([(a, 8, c), (8, b, c)], np.int32)]))


def everything() -> Mesh:
    """A ball inside out with a hole, two cubes that overlap, and a fin."""
    ball = shapes.inverted(shapes.without(shapes.sphere(5, (-20, 0, 0)), 7))
    return concatenate([ball, shapes.with_fin(shapes.cube()), shapes.cube(at=(5, 5, 5))])


FAULTS: dict[str, tuple[Callable[[], Mesh], float, tuple[str, ...]]] = {
    "none": (shapes.cube, 1000, ()),
    "cavity": (lambda: concatenate([shapes.cube(), shapes.inverted(shapes.cube(2, (4, 4, 4)))]), 992, ()),
    "hole": (
        lambda: shapes.without(shapes.without(shapes.cube(), 3), 8), 1000,
        ("1 hole closed with 2 triangles",),
    ),
    "T-vertex": (with_t_vertex, 1000, ("1 hole closed with 1 triangle, T-vertices joined",)),
    "turned": (
        lambda: shapes.with_flipped(shapes.with_flipped(shapes.cube(), 2), 5), 1000, ("2 triangles turned",),
    ),
    "inside out": (lambda: shapes.inverted(shapes.cube()), 1000, ("1 shell turned outwards",)),
    "fin": (lambda: shapes.with_fin(shapes.cube()), 1000, ("1 hanging triangle removed",)),
    "twice": (
        lambda: concatenate([shapes.cube(), shapes.cube()]), 1000,
        ("12 repeated or empty triangles removed",),
    ),
    "overlapping": (
        lambda: concatenate([shapes.cube(), shapes.cube(at=(5, 5, 5))]), 1875,
        ("12 triangles that cut or touched others replaced",),
    ),
    "nested": (
        lambda: concatenate([shapes.cube(), shapes.cube(2, (4, 4, 4))]), 1000,
        ("1 shell within another body removed",),
    ),
    "everything": (
        everything, 1875 + shapes.sphere(5).volume,
        (
            "1 hanging triangle removed", "1 hole closed with 1 triangle", "1 shell turned outwards",
            "12 triangles that cut or touched others replaced",
        ),
    ),
}  # fmt: skip


@pytest.mark.parametrize("fault", FAULTS)
def test_the_solid_that_was_meant_is_made(fault: str) -> None:
    make, volume, changes = FAULTS[fault]
    made = repair(quantise_mesh(make()))
    assert made.changes == changes and faults(made.report) == ()
    assert made.report.volume_mm3 == pytest.approx(volume, rel=1e-6)


def test_the_command_writes_the_solid_and_says_what_changed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    everything().export("bad.stl")
    assert run(["repair", "bad.stl", "-o", "good.ply"]) == 0
    out = capfd.readouterr().out.splitlines()
    assert out[0].startswith("bad.stl: 1 hanging triangle removed, 1 hole closed with 1 triangle, 1 shell")
    assert out[1].startswith("good.ply: ") and out[1].endswith("watertight, manifold")
    assert run(["mesh", "good.ply", "-o", "mesh.stl", "--resolution", "16", "-q"]) == 0
    assert read_mesh("mesh.stl").volume == pytest.approx(read_mesh("good.ply").volume, rel=0.02)


def test_what_cannot_be_repaired_is_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    shapes.cube().selected(np.arange(12) == 0).export("one.stl")
    assert run(["repair", "one.stl", "-o", "x.stl"]) == 1
    assert "x.stl: 1 triangle" in (out := capfd.readouterr().out) and "3 open edges" in out
    assert run(["repair", "none.stl", "-o", "x.stl"]) == 2
    assert capfd.readouterr().err == "fracslice: none.stl: no such file\n"
    assert run(["repair", "one.stl", "-o", "x.xml"]) == 2
    assert "x.xml: unknown kind of file; known are .3mf" in capfd.readouterr().err
