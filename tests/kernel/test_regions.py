"""Loops over a long union look at the elements near a point only, and change no bit."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fracslice import render
from fracslice.fields import linker
from fracslice.fields.cpu import CpuKernel, compile_scene, regions_of
from fracslice.fields.devices import cells, reference
from fracslice.formulas import (
    Node,
    box,
    difference,
    intersection,
    julia,
    material,
    repeat,
    shell,
    sphere,
    torus,
    transform,
    union,
)

from ..examples import link_whole, stamped

pytestmark = pytest.mark.once

RNG = np.random.default_rng(5)


def elements(count: int, *kinds: Node) -> list[Node]:
    """Elements of some kinds at random places, turned."""
    turns = [(*RNG.normal(size=3), RNG.uniform(0, 180)) for _ in range(count)]
    places = RNG.uniform(-1, 1, (count, 3))
    return [
        transform(kinds[k % len(kinds)], translate=tuple(p), rotate=turn, scale=RNG.uniform(0.05, 0.2))
        for k, (p, turn) in enumerate(zip(places, turns, strict=True))
    ]


KINDS = sphere(), box(), torus()
SCENES = {
    "balls": union(*elements(200, sphere())),
    "of three kinds": union(*elements(150, *KINDS)),
    "cut": transform(
        difference(union(*elements(120, *KINDS)), sphere(radius=0.6)), scale=0.7, translate=(0.1, 0.2, 0.3)
    ),
    "in groups": union(material(union(*elements(100, box()))), sphere(radius=0.3)),
    "the same forty times": union(*[sphere(radius=0.5)] * 40),
    "of unions": union(*(union(*elements(20, sphere())) for _ in range(40))),
    "of long unions": union(*(union(*elements(32, sphere())) for _ in range(32))),
    "within": intersection(union(*elements(64, sphere())), box(size=(1, 1, 1))),
    "hollow": shell(union(*elements(64, torus())), thickness=0.01),
    "two": intersection(union(*elements(64, sphere())), union(*elements(64, box()))),
    "seams": union(*elements(200, sphere()), smooth=0.05),
    "seams of three kinds": shell(union(*elements(150, *KINDS), smooth=0.1), thickness=0.02),
    "turned": transform(union(*elements(100, sphere())), rotate=(1, 2, 3, 50)),
    "torn": repeat(union(*elements(100, sphere())), period=(1.1, 2.1, 2.1), count=(2, 1, 1)),
    "wide seams": union(*elements(60, *KINDS), smooth=1.0),
}
PRECISIONS = pytest.mark.parametrize("precision", ["float32", "float64"])


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("precision", stamped(["float32", "float64"], ["float32"]))
def test_no_bit_changes(name: str, precision) -> None:  # type: ignore[no-untyped-def]
    root = SCENES[name]
    assert root.linked.regions
    near, whole = compile_scene(root, precision), CpuKernel(link_whole(root), precision)
    assert np.isnan(near.points(*np.full((3, 32), np.nan))).all()
    corners = RNG.integers(-40, 40, (60, 3)).astype(np.int32)
    values = [np.empty((60, 512), near.dtype) for _ in range(2)]
    for kernel, out in zip((near, whole), values, strict=True):
        kernel.bricks(corners, (-0.01, 0.02, 0.03), 0.03, out)
    assert values[0].tobytes() == values[1].tobytes()
    far = np.full((3, 1), 1e6)
    points = np.concatenate([RNG.uniform(-2, 2, (3, 3000)), RNG.normal(0, 0.4, (3, 3000)), far], axis=1)
    points[RNG.integers(0, 3, 50), RNG.integers(0, points.shape[1], 50)] = np.nan
    assert near.points(*points).tobytes() == whole.points(*points).tobytes()
    np.testing.assert_allclose(near.points(*points), reference(root)(*points), rtol=1e-6, atol=4e-6)


@PRECISIONS
def test_enclosures_hold_what_is_in_the_cell(precision) -> None:  # type: ignore[no-untyped-def]
    """Of the elements near a cell alone, and for cells that reach beyond all."""
    root = SCENES["seams of three kinds"]
    centres, half = RNG.uniform(-1.5, 1.5, (3, 200)), 0.05
    for reach in (half, 3.0):
        low, high = cells(root, precision).bounds(centres, reach)
        for _ in range(20):
            f = reference(root)(*(centres + RNG.uniform(-reach, reach, (3, 200))))
            assert np.all(low <= f + 1e-6) and np.all(f <= high + 1e-6)
    proved, _ = cells(root, precision)(centres, half)
    assert proved.mean() > 0.2


def test_pictures_are_those_of_all_elements(monkeypatch) -> None:  # type: ignore[no-untyped-def]
    """Of elements of the same distance, too: the first one's paint is taken."""
    balls, colours = elements(100, sphere(), box()), ((1, 0, 0), (0, 1, 0), (0, 0, 1))

    def picture() -> np.ndarray:
        painted = (material(ball, colour=colours[k % 3]) for k, ball in enumerate([*balls, *balls]))
        return render(union(*painted), size=(48, 32), samples=2)

    near = picture()
    monkeypatch.setattr(linker, "is_long", lambda node: False)
    np.testing.assert_array_equal(near, picture())
    assert len(np.unique(near.reshape(-1, near.shape[-1]), axis=0)) > 100


def test_regions_of_equal_unions_are_one() -> None:
    """So that samples, roots and pictures share what is known."""
    one, other = (union(*[sphere(radius=0.5)] * 40, smooth=0.1).linked for _ in range(2))
    assert regions_of(one.regions[0][1]) is regions_of(other.regions[0][1])


def test_which_unions_are_looked_at_by_region() -> None:
    assert not union(*elements(8, sphere())).linked.regions
    assert not union(*[julia(iterations=5)] * 40).linked.regions  # its bound is measured
    assert not union(*elements(40, sphere()), smooth="0.1 + 0.01 * x").linked.regions
    assert len(SCENES["two"].linked.regions) == 2
    assert len(SCENES["of long unions"].linked.regions) == 1


def test_scenes_of_other_numbers_of_elements_are_one_program() -> None:
    few, many = (union(*elements(count, sphere())).linked.program for count in (40, 300))
    assert few == many


def resident_pages() -> int:
    return int(Path("/proc/self/statm").read_text().split()[1])


@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="needs /proc")
def test_cells_of_a_dense_union_take_bounded_memory() -> None:
    """Points at random ask for a smaller cell each, in which as many elements matter as in a larger one."""
    places, rng = np.random.default_rng(6).uniform(-1, 1, (600, 3)), np.random.default_rng(7)
    root = union(*(transform(sphere(radius=0.1), translate=tuple(p)) for p in places), smooth=0.1)
    points, before = rng.uniform(-1, 1, (3, 200_000)), resident_pages()
    near = compile_scene(root).points(*points)
    assert resident_pages() - before < 10_000
    np.testing.assert_array_equal(near, CpuKernel(link_whole(root)).points(*points))
