"""Seeded defects are found, clean solids are not blamed, and time grows with the outline only."""

from __future__ import annotations

import time
import tracemalloc
from typing import Any

import numpy as np
import pytest

from fracslice.checks.fitting import misfit
from fracslice.checks.layer_checks import PrintReport, check_layers
from fracslice.checks.problems import Limits, Problem, verdict
from fracslice.formulas import (
    Node,
    box,
    cone,
    cylinder,
    difference,
    intersection,
    menger,
    sphere,
    transform,
    union,
)
from fracslice.scene import Print
from fracslice.slicing import SliceJob, Slicer, plan_stack
from fracslice.slicing.feature_graph import (
    Graph,
    Runs,
    farthest,
    layer_components,
    overlaps,
    unsupported_pixels,
    widths,
)
from fracslice.slicing.printers import PRINTERS
from fracslice.volume import extent
from fracslice.work import Work

pytestmark = pytest.mark.once


COARSE = Limits(wall=0.4, floor=0.4)
"""The solid is sampled as finely as its limits ask."""


def checked(root: Node, limits: Limits = COARSE) -> PrintReport:
    return check_layers(plan_stack(root, SliceJob(size=10, layer=0.1)), limits)


def runs_of(image: np.ndarray) -> Runs:
    """The pixels of an image that are not 0."""
    turns = np.diff(image.astype(bool), axis=1, prepend=False, append=False)
    rows, columns = np.nonzero(turns)
    ends = np.searchsorted(rows[::2], np.arange(len(image) + 1)).astype(np.int32)
    begin, end = (np.ascontiguousarray(columns[k::2], np.int32) for k in (0, 1))
    return Runs(ends, begin, end, image.shape[1])


def at(node: Node, x: float, y: float, z: float) -> Node:
    return transform(node, translate=(x, y, z))


CUBE = box(size=(1, 1, 1))


@pytest.mark.parametrize(
    "root",
    [CUBE, at(CUBE, 0.3, 0.1, 0.2), cylinder(), union(CUBE, at(box(size=(0.5, 0.5, 1)), 0, 0, 0.9))],
    ids=["cube", "moved", "cylinder", "tower"],
)
def test_clean_solids(root: Node) -> None:
    report = checked(root)
    assert report.problems == []
    assert len(report.bodies) == 1
    assert not (report.islands)
    assert not (report.cups)
    assert not (report.traps)
    assert not (report.cavities)
    assert not (report.specks)
    assert report.overhang_area == 0
    assert report.worst == []


def test_volume_and_weight() -> None:
    report = checked(CUBE)
    assert report.volume == pytest.approx(1000, rel=2e-3)
    assert report.weight_g == pytest.approx(1.1, rel=2e-3)


def test_sealed_cavity() -> None:
    report = checked(difference(CUBE, sphere(radius=0.2)))
    assert [round(c.volume) for c in report.cavities] == [34]
    assert [p.kind for p in report.problems] == ["cavities"]
    assert report.problems[0].mend == (("cavities", "fill"),)
    assert report.cavities[0].layers == (30, 69)
    assert report.cavities[0].at == pytest.approx((0, 0), abs=0.05)


def test_cavities_of_less_than_a_square_millimetre_are_no_problem() -> None:
    report = checked(difference(CUBE, sphere(radius=0.05)))
    assert report.cavities == [] and report.problems == []


def test_a_body_of_few_pixels_is_a_speck() -> None:
    """2 x 2 pixels, and 3 x 3, beside a cube."""
    for side, bodies in ((0.2, 1), (0.3, 2)):
        beside = at(box(size=(side / 10, side / 10, 1)), 0.9, 0, 0)
        sides = SliceJob(size=(1.4 + side / 20) * 10, layer=0.5, pixel=0.1)
        report = check_layers(plan_stack(union(CUBE, beside), sides))
        assert len(report.bodies) == bodies and (report.specks > 0) == (bodies == 1)


def test_cup_that_is_open_above_and_trap_that_is_open_below() -> None:
    """Above in the scene is below on the printer: what is open above drains but sucks; what is open below
    does both.
    """
    cup = checked(difference(CUBE, at(box(size=(0.5, 0.5, 0.8)), 0, 0, 0.4)))
    assert [c.layers for c in cup.cups] == [(50, 99)]
    assert not cup.traps
    assert not cup.cavities
    trap = checked(difference(CUBE, at(box(size=(0.5, 0.5, 0.8)), 0, 0, -0.4)))
    assert [c.layers for c in trap.traps] == [(0, 49)]
    assert not trap.cavities
    assert trap.traps[0].area == pytest.approx(25, rel=0.03)


@pytest.mark.parametrize(("depth", "count"), [(0.04, 0), (0.2, 1)])
def test_a_film_of_resin_is_no_trap(depth: float, count: int) -> None:
    """Two mm2 above the plate hold 0.8 or 4 mm3, for a limit of one."""
    side = 0.1 * 2**0.5
    report = checked(difference(CUBE, at(box(size=(side, side, 2 * depth)), 0, 0, -0.5)))
    assert len(report.traps) == count


@pytest.mark.parametrize(("depth", "count"), [(0.4, 0), (0.6, 1)])
def test_cups_on_the_plate_count_when_they_are_deep(depth: float, count: int) -> None:
    """A hole through all, with a way out to the sides `depth` mm above the plate."""
    hole, way = box(size=(0.5, 0.5, 3)), box(size=(2, 0.1, 0.1))
    limits = Limits(wall=0.4, floor=0.4, deep=0.5)
    report = checked(difference(CUBE, hole, at(way, 0, 0, -0.45 + depth / 10)), limits=limits)
    assert len(report.cups) == len(report.problems) == count


def test_a_drain_hole_ends_the_cup() -> None:
    bowl = difference(CUBE, at(box(size=(0.5, 0.5, 0.8)), 0, 0, 0.4))
    drained = difference(bowl, at(box(size=(1, 0.1, 0.1)), 0.5, 0, 0.06))
    assert not checked(drained).cups or checked(drained).cups[0].volume < 60


def test_islands_and_overhang() -> None:
    """A gallows: from its arm a bar hangs down, and begins in the air."""
    post, arm, bar = (
        at(box(size=(0.2, 0.2, 1)), 0.4, 0, 0.5),
        at(box(size=(1, 0.2, 0.1)), 0, 0, 1.05),
        at(box(size=(0.2, 0.2, 0.4)), -0.4, 0, 0.8),
    )
    report = checked(union(box(size=(1, 1, 0.2)), post, arm, bar))
    assert len(report.islands) == 1
    assert len(report.bodies) == 1
    island = report.islands[0]
    assert island.at == pytest.approx((-3.3, 0), abs=0.15)
    assert island.layers[0] in report.worst
    assert report.largest_overhang > 5
    assert any("1 island in the air" in str(p) for p in report.problems)


def test_an_island_above_an_empty_layer_overhangs() -> None:
    floating = union(box(size=(1, 1, 0.2)), at(box(size=(0.4, 0.4, 0.4)), 0, 0, 0.8))
    report = checked(floating)
    assert report.largest_overhang == pytest.approx(16 / 1.21, rel=0.05)


@pytest.mark.parametrize(("layers", "found"), [(1, False), (2, True)])
def test_a_slit_of_one_layer_carries_what_is_above_it(layers: int, found: bool) -> None:
    """A cube of 10 mm, cut in two but for one side: the upper part reaches 8 mm."""
    height = 0.01 * layers
    slit = at(box(size=(1, 2, height)), 0.2, 0, height / 2)
    report = checked(difference(CUBE, slit))
    assert [area < 25 for area in report.areas[49:53]] == [False, True, found, False]
    assert (report.overhang is not None) == found
    assert report.overhang is None or report.overhang.layer == 52


@pytest.mark.parametrize("pixel", [0.1, 0.5, 1.0, 2.0])
def test_cantilevers_are_measured_by_the_limit_with_any_pixel(pixel: float) -> None:
    below, above = np.zeros((2, 20, 60), bool)
    below[5:15, 10:20] = above[5:15, 10:20] = True

    def reaches(count: int) -> bool:
        above[5:15, 20 : 20 + count] = True
        solid = runs_of(above)
        bare = unsupported_pixels(runs_of(below), solid, 1.0)
        return farthest(solid, bare, 1, (pixel, pixel), 10 * pixel, 100 * pixel) is not None

    assert not reaches(11)  # the first pixel rests on the one below
    assert reaches(12)


def test_bodies_that_stand_on_the_plate_are_parts_and_others_are_loose() -> None:
    parts = [at(box(size=(0.4, 0.4, 1)), -0.5, 0, 0), at(box(size=(0.4, 0.4, 1)), 0.5, 0, 0)]
    report = checked(union(*parts))
    assert len(report.bodies) == 2
    assert report.problems == []
    assert "bodies" in [
        p.kind for p in checked(union(*parts, at(box(size=(0.4, 0.4, 0.2)), 0, 0.5, 0.2))).problems
    ]
    assert report.gaps is not None
    assert report.gaps.smallest == pytest.approx(0.6 * 10 / 1.4, abs=0.06)


SLOW = pytest.mark.nightly
CONES = [(10, 20), pytest.param(10, 5, marks=SLOW), pytest.param(3, 3, marks=SLOW), (2, 10), (1, 6)]
"""Radius and height of cones that stand on their point, mm."""


@pytest.mark.parametrize(("radius", "height"), CONES)
def test_a_cone_on_its_point_needs_supports_or_a_base(radius: float, height: float) -> None:
    cut = transform(cone(radius=radius, height=height), rotate=(1, 0, 0, 180))

    def problems(root: Node) -> list[Problem]:
        size = max(extent(root).box.size)
        return check_layers(plan_stack(root, SliceJob(size=size, layer=0.1, pixel=(0.1, 0.1)))).problems

    found = problems(cut)
    assert verdict(found) == "would print with supports"
    assert [p.kind for p in found] == ["necks"]
    foot = at(box(size=(3 * radius, 3 * radius, height)), 0, 0, 0.4 * height)  # a foot of 0.4 of the radius
    assert verdict(problems(intersection(cut, foot))) == "would print"


def test_a_ball_on_the_plate_would_print_with_supports() -> None:
    report = checked(sphere())
    assert verdict(report.problems) == "would print with supports"


@pytest.mark.parametrize("width", [0.008, 0.016, 0.05])
def test_thin_walls(width: float) -> None:
    wall = 10 * width
    report = checked(union(box(size=(1, 1, 0.2)), at(box(size=(1, width, 0.7)), 0, 0, 0.35)), Limits())
    assert report.walls is not None
    assert report.walls.smallest == pytest.approx(wall, abs=0.055)
    assert ("walls" in [p.kind for p in report.problems]) == (wall < 0.1)


def test_menger_walls_and_gaps_are_known() -> None:
    report = checked(menger(level=2))
    assert report.walls is not None
    assert report.gaps is not None
    assert report.walls.smallest == pytest.approx(10 / 9, abs=0.11)
    assert report.gaps.smallest == pytest.approx(10 / 9, abs=0.11)
    assert sum(report.gaps.counts) > 100


@pytest.mark.parametrize(
    "given",
    [
        {},
        {"scale": 1.1},
        {"printing": Print(raft=2)},
        {"printing": Print(base=20), "scale": (1.1, 1.2, 1.05)},
        {"up": (1, 0, 2)},
    ],
)
def test_an_object_of_the_size_that_is_advised_fits(given: dict[str, Any]) -> None:
    machine = PRINTERS["sl1s"]
    bar = box(size=(2, 1, 0.5))
    unfit = misfit(plan_stack(bar, SliceJob(size=400, layer=1, pixel=1, **given)), machine)
    assert unfit is not None
    ((name, size),) = unfit.mend
    assert name == "size"
    assert misfit(plan_stack(bar, SliceJob(size=size, layer=1, pixel=1, **given)), machine) is None


def test_fit() -> None:
    stack = plan_stack(CUBE, SliceJob(size=100, layer=1, pixel=(0.5, 0.5)))
    report = check_layers(stack, printer=PRINTERS["sl1"])
    assert report.fits is False
    assert any("does not fit" in str(p) for p in report.problems)
    assert check_layers(stack, printer=PRINTERS["saturn-4-ultra"]).fits is True


@pytest.mark.parametrize(
    "thin",
    [
        at(box(size=(0.5, 0.006, 1)), 0, 0.56, 0),
        transform(box(size=(0.006, 0.3, 1)), rotate=(0, 0, 1, 40), translate=(0.7, 0, 0)),
        at(cylinder(radius=0.003, height=1), 0.52, 0, 0),
    ],
    ids=["beside", "tilted", "pillar"],
)
def test_thin_walls_beside_thick_bodies(thin: Node) -> None:
    """Large bodies are measured in coarse pixels, what is thin never is."""
    stack = plan_stack(union(CUBE, thin), SliceJob(size=100, layer=10, pixel=(0.1, 0.1)))
    runs = next(Slicer(stack).map(lambda layer: layer.runs, [5]))
    walls, gaps = widths(runs, stack.pixel)
    assert walls[:, 0].min() == pytest.approx(0.006 * stack.scale, abs=0.15)
    assert len(gaps)


def test_memory_follows_the_outline_not_the_area() -> None:
    """Of 36 million solid pixels each would take dozens of bytes. One thread has the same peak each time."""
    stack = plan_stack(CUBE, SliceJob(size=60, layer=30, pixel=(0.01, 0.01)))
    check_layers(plan_stack(CUBE, SliceJob(size=10, layer=5)))  # what is loaded once
    tracemalloc.start()
    try:
        assert check_layers(stack, work=Work(1)).problems == []
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert stack.shape[0] * stack.shape[1] > 36e6
    assert peak < 36e6


def test_parts_by_hand() -> None:
    """Solid pixels that touch at a corner are one part; empty ones are not."""
    image = 255 * np.array(
        [[0, 0, 0, 0, 0], [0, 1, 1, 0, 0], [0, 1, 0, 1, 0], [0, 0, 1, 0, 0], [0, 0, 0, 0, 0]], np.uint8
    )
    solid, empty = layer_components(runs_of(image))
    assert solid.nodes.area.tolist() == [5]
    assert sorted(empty.nodes.area.tolist()) == [1, 19]
    assert empty.nodes.open[np.argsort(empty.nodes.area)].tolist() == [False, True]
    other, _ = layer_components(runs_of(np.roll(image, 1, 1)))
    assert overlaps(solid, other).tolist() == [[0, 0]]
    bare = unsupported_pixels(solid.runs, other.runs, 0.0)
    assert (bare.end - bare.begin).sum() == 5 - (image & np.roll(image, 1, 1) > 0).sum()
    assert not len(unsupported_pixels(solid.runs, other.runs, 1.0).begin)


def test_time_is_linear_in_the_holes() -> None:
    """10^4 holes: the parts of a layer and their graph take at most a few times what 100 holes do in as
    many pixels.
    """

    def seconds(holes: int) -> float:
        side = 1600 // holes
        image = np.full((1604, 1604), 255, np.uint8)
        y, x = np.mgrid[:1600, :1600]
        image[2:-2, 2:-2][(y % side < side // 2) & (x % side < side // 2)] = 0
        begin, graph = time.perf_counter(), Graph()
        for _ in range(3):
            graph.add(layer_components(runs_of(image))[1])
        assert len(graph.groups(~graph.nodes.open, np.ones(3), (1, 1), image.shape)) == holes**2
        return time.perf_counter() - begin

    seconds(10)
    assert min(seconds(100) for _ in range(3)) < 20 * min(seconds(10) for _ in range(3))
