"""Levels too fine for a voxel are left out, and told of."""

from __future__ import annotations

from dataclasses import replace

import pytest

from fracslice import MeshJob, make_mesh
from fracslice.common.parameters import AUTO
from fracslice.errors import EmptyError
from fracslice.expr.vocabulary import sqrt
from fracslice.fields import depth
from fracslice.fields.depth import (
    Known,
    _step,
    _surface_points,
    depth_notes,
    resolve_depths,
    shallower,
    visible,
    with_depths_of,
)
from fracslice.fields.node import FORMULAS
from fracslice.formulas import (
    Box,
    Count,
    Formula,
    Node,
    julia,
    kifs_octahedron,
    kifs_tetrahedron,
    mandelbulb,
    menger,
    shape,
    sphere,
    transform,
    union,
)
from fracslice.scene import scene
from fracslice.slicing import SliceJob, plan_stack
from fracslice.volume import plan, sample_scene_signs, with_depths

pytestmark = pytest.mark.once

DUST = julia(c=(0.6551, 0.6083, -0.5699, 0.6641), iterations=10)


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


def step(root: Node, depth: int) -> float:
    return _step(*(Known(root.changed(iterations=d)) for d in (depth, depth + 1)))


def depths(root: Node) -> list[int]:
    return [node["iterations"] for node in root.walk() if "iterations" in node.values]


@pytest.mark.parametrize("root", [mandelbulb(), union(julia(), transform(mandelbulb(power=3), scale=0.3))])
def test_an_automatic_depth_is_the_objects_own_whatever_it_is_made_for(root):
    """Meshes of 48 and 512 voxels, and layers, were of other solids: 2.32 and 2.22 cm3."""
    known = depths(with_depths(root))
    job = SliceJob(size=20, layer=0.1, pixel=(0.05, 0.05))
    stacks = [plan_stack(root, replace(job, up=up)).root for up in ((0, 0, 1), (1, 1, 1))]
    assert all(depths(plan(root, n).root) == known for n in (9, 48, 512))
    assert all(depths(stack) == known for stack in stacks)
    assert [int(reported.split()[1]) for reported in plan(root, 48).depths] == known
    assert known > depths(resolve_depths(root, 0.05))


def test_the_extent_is_that_of_the_solid_with_its_depth():
    root = mandelbulb(power=3, bailout=50)
    planned = plan(root, 64)
    assert planned.box == plan(planned.root, 64).box


def test_dust_in_a_crude_box_has_surface_points():
    """One of 4,000 points at random was inside."""
    assert _surface_points(Known(DUST)).shape[1] > 100
    assert 0 < step(DUST, 10) < step(DUST, 5)


def test_what_a_step_adds_counts_as_what_it_takes_away():
    """Beyond a small bailout orbits come back: the step from 3 to 4 was 0.077, what it adds not counted."""
    root = julia(c=(-0.9, 0.2, 0, 0), bailout=1.01)
    assert step(root, 3) > 0.1


def test_nothing_has_no_surface():
    nothing = julia(c=(3, 2, 1, 0), iterations=30)
    assert _surface_points(Known(nothing)).shape == (3, 0)
    assert resolve_depths(julia(c=(3, 2, 1, 0)), 1e-6)["iterations"] < 30


def test_automatic_depths_are_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    """Searching them takes a fifth of a picture of one sample."""
    root = mandelbulb(power=7)
    known = resolve_depths(root, 0.01)
    depth._steps.cache_clear()
    monkeypatch.setattr(depth, "_step", None)
    assert resolve_depths(root, 0.01) == known
    with pytest.raises(TypeError):
        resolve_depths(root, 1e-5)


@shape(folds=Count(AUTO, "halvings", least=1, most=60, words=(AUTO,)))
def shrinking(x, y, z, folds):  # type: ignore[no-untyped-def]
    """A ball whose radius loses half of the last loss with each halving. L = 1."""
    loss = 1.0
    for _ in range(folds):
        loss = 0.5 * loss
    return sqrt(x * x + y * y + z * z) - 1.0 - loss


FORMULAS.pop("shrinking")


@shrinking.bounds  # type: ignore[untyped-decorator]
def shrinking_bounds(node: Node) -> Box:
    return Box.centred(2.0)


def test_an_automatic_depth_may_have_any_name() -> None:
    root = transform(shrinking(), scale=2.0)
    known = resolve_depths(root, 0.04)
    assert known.children[0]["folds"] == 6  # which moves the ball by 1 / 128
    assert depth_notes(root, known) == ("shrinking 6",)
    assert shallower(shrinking(folds=30), 0.02) == ("shrinking.folds=3",)


@pytest.mark.nightly
@pytest.mark.parametrize(("deep", "whole"), [(kifs_tetrahedron, 3), (kifs_octahedron, 2)])
def test_notes_advise_the_iterations_that_the_voxels_show(deep: Formula, whole: int) -> None:
    """At 64 voxels, 12 iterations leave nothing."""
    job, advice = MeshJob(resolution=64), f"{deep.name}.iterations={whole}"
    with pytest.raises(EmptyError, match=f"expected more voxels or {advice}"):
        sample_scene_signs(plan(deep(iterations=12), 64))
    assert shallower(deep(iterations=whole), plan(deep(iterations=whole), 64).voxel) == ()
    made = make_mesh(scene(deep(iterations=whole), size="4cm"), job)
    assert made.report.notes == () and made.report.mesh.components == 1


def test_dust_that_no_search_meets_is_refused_with_advice() -> None:
    with pytest.raises(
        EmptyError, match=r"no point is inside; expected .* or kifs_tetrahedron\.iterations=3"
    ):
        plan(kifs_tetrahedron(iterations=30), 64)
    assert max(kifs_tetrahedron(iterations=12).bounds.box.hi) > 0.57  # it was 0.004: no sample was inside


def test_another_scene_of_the_same_elements_gives_its_depths() -> None:
    before = union(mandelbulb(), transform(julia(), translate=(3, 0, 0)))
    known = resolve_depths(before, 0.05)
    after = union(mandelbulb(power=8.5), transform(julia(iterations=4), translate=(3, 1, 0)))
    made = with_depths_of(after, known)
    assert made.children[0]["iterations"] == known.children[0]["iterations"]
    assert made.children[1] == after.children[1]
    assert with_depths_of(sphere(), known) == sphere()
