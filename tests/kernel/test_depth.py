"""Levels too fine for a voxel are left out, and told of."""

from __future__ import annotations

import pytest

from fracslice import MeshJob, make_mesh
from fracslice.formulas import Box, Node, mandelbulb, menger, sphere, transform, union
from fracslice.kernel.depth import resolve_depths, visible
from fracslice.scene import scene


def shown(root: Node, voxel: float) -> list[int]:
    return [node["level"] for node in visible(root, voxel)[0].walk() if node.formula.name == "menger"]


@pytest.mark.parametrize(
    ("voxel", "level"), [(3, 0), (2 / 3, 0), (0.66, 1), (2 / 81, 3), (2 / 82, 4), (1e-9, 9)]
)
def test_bars_are_wider_than_a_voxel(voxel, level):
    assert shown(menger(level=9), voxel) == [level]


def test_a_transform_scales_the_voxel():
    pair = union(
        menger(level=9), transform(menger(level=9), scale=1 / 3), transform(menger(level=1), scale=9)
    )
    assert shown(pair, 2 / 30) == [3, 2, 1]


def test_what_can_be_seen_is_the_scene_itself():
    whole = union(sphere(), menger(level=3))
    assert visible(whole, 2 / 28) == (whole, ())


def test_a_deep_sponge_is_the_solid_that_the_voxel_shows():
    result = make_mesh(scene(menger(level=9), size="2mm"), MeshJob(resolution=40))
    assert result.mesh.volume == pytest.approx(8 * (20 / 27) ** 3, rel=1e-6)
    assert result.report.mesh.components == 1
    assert result.report.notes == ("menger: level 3 of 9; finer parts are thinner than a voxel",)


def test_depths_follow_a_formula_that_was_edited(monkeypatch: pytest.MonkeyPatch) -> None:
    before = resolve_depths(mandelbulb(), 0.02)
    assert before["iterations"] > 1
    monkeypatch.setitem(mandelbulb.hooks, "bounds", lambda _: Box((5, 5, 5), (6, 6, 6)))
    assert resolve_depths(mandelbulb(), 0.02)["iterations"] == 1
    monkeypatch.undo()
    assert resolve_depths(mandelbulb(), 0.02) == before
