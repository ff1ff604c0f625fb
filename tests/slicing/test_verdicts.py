"""Fifty models that would not print and fifty that would, with what a person says of each.

One of each kind in every run, four more in a night.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from fracslice.checks.layer_checks import PrintReport, check_layers
from fracslice.checks.problems import Limits, Problem, verdict
from fracslice.formulas import (
    Node,
    box,
    cone,
    cylinder,
    difference,
    intersection,
    plane,
    sphere,
    torus,
    transform,
    union,
)
from fracslice.scene import Print
from fracslice.slicing import SliceJob, plan_stack
from fracslice.volume import extent
from tests.examples import stamped

pytestmark = pytest.mark.once

each_seed = pytest.mark.parametrize("seed", stamped(range(5), [0]))
Random = np.random.Generator
Family = Callable[[Random], Node]


def at(node: Node, x: float, y: float, z: float) -> Node:
    return transform(node, translate=(x, y, z))


def block(x: float, y: float, z: float) -> Node:
    """A box that stands on z = 0."""
    return at(box(size=(x, y, z)), 0, 0, z / 2)


def rod(radius: float, height: float) -> Node:
    return at(cylinder(radius=radius, height=height), 0, 0, height / 2)


def above(node: Node) -> Node:
    return intersection(node, plane(normal=(0, 0, -1)))


def examined(root: Node, layer: float | None = None, **printing: float) -> PrintReport:
    """One scene unit is 1 mm."""
    size = max(extent(root).box.size)
    height = layer or size / 100
    job = SliceJob(size=size, layer=height, pixel=(height, height), printing=Print(**printing))  # type: ignore[arg-type]
    return check_layers(plan_stack(root, job))


def cantilever(r: Random) -> Node:
    long, thick = r.uniform(15, 50), r.uniform(2, 5)
    return union(block(10, 10, 20), at(block(long + 5, 8, thick), (long + 5) / 2, 0, 20 - thick))


def bridge(r: Random) -> Node:
    span, thick = r.uniform(30, 60), r.uniform(2, 5)
    posts = [at(block(8, 8, 15), x * (span + 8) / 2, 0, 0) for x in (-1, 1)]
    return union(*posts, at(block(span + 16, 8, thick), 0, 0, 14))


def ball_on_a_pin(r: Random) -> Node:
    radius, pin = r.uniform(10, 20), r.uniform(0.8, 1.2)
    return union(block(20, 20, 2), rod(pin / 2, 10), at(sphere(radius=radius), 0, 0, 9 + radius))


def ball_on_a_point(r: Random) -> Node:
    radius, high = r.uniform(8, 20), r.uniform(8, 14)
    return union(
        rod(6, 2),
        at(cone(radius=5, height=high), 0, 0, 1 + high / 2),
        at(sphere(radius=radius), 0, 0, high + radius - 0.2),
    )


def floating_ball(r: Random) -> Node:
    radius = r.uniform(1, 8)
    return union(block(20, 20, 2), at(sphere(radius=radius), 0, 0, 3 + r.uniform(1, 5) + radius))


def sealed(r: Random) -> Node:
    side = r.uniform(20, 40)
    return difference(block(side, side, side), at(sphere(radius=side * r.uniform(0.15, 0.4)), 0, 0, side / 2))


def long_bar(r: Random) -> Node:
    return block(r.uniform(450, 700), r.uniform(8, 20), r.uniform(8, 20))


def sheet(r: Random) -> Node:
    return union(block(20, 20, 2), block(15, r.uniform(0.03, 0.08), r.uniform(8, 20)))


def cup(r: Random) -> Node:
    radius, high = r.uniform(8, 20), r.uniform(10, 30)
    return difference(rod(radius, high), at(rod(radius - 2, high), 0, 0, 2))


def standing_on_its_tip(r: Random) -> Node:
    high = r.uniform(15, 30)
    return union(
        rod(0.4, 1), at(transform(cone(radius=high / 2, height=high), rotate=(1, 0, 0, 180)), 0, 0, high / 2)
    )


BAD: dict[Family, str] = {
    cantilever: "overhangs",
    bridge: "overhangs",
    ball_on_a_pin: "necks",
    ball_on_a_point: "necks",
    floating_ball: "islands",
    sealed: "cavities",
    long_bar: "fit",
    sheet: "walls",
    cup: "cups",
    standing_on_its_tip: "necks",
}


def brick(r: Random) -> Node:
    return block(*r.uniform(3, 40, 3))


def disc(r: Random) -> Node:
    return rod(r.uniform(2, 20), r.uniform(1, 30))


def upright_cone(r: Random) -> Node:
    return cone(radius=r.uniform(5, 15), height=r.uniform(10, 30))


def ring(r: Random) -> Node:
    return torus(radius=r.uniform(6, 12), tube=r.uniform(0.5, 0.8))


def tunnel(r: Random) -> Node:
    radius = r.uniform(4, 12)
    hole = transform(cylinder(radius=radius, height=60), rotate=(1, 0, 0, 90))
    return above(difference(block(2 * radius + 8, 15, radius + 5), hole))


def ledge(r: Random) -> Node:
    return union(block(12, 12, 15), at(block(12 + r.uniform(2, 6), 12 + r.uniform(2, 6), 4), 0, 0, 11))


def dome(r: Random) -> Node:
    return above(sphere(radius=r.uniform(5, 20)))


def tower(r: Random) -> Node:
    steps = [
        at(block(s, s, 6), 0, 0, 5 * k) for k, s in enumerate(np.sort(r.uniform(4, 20, 4))[::-1].tolist())
    ]
    return union(*steps)


def trestle(r: Random) -> Node:
    """A flat bridge that is short."""
    span = r.uniform(6, 16)
    posts = [at(block(5, 8, 10), x * (span + 5) / 2, 0, 0) for x in (-1, 1)]
    return union(*posts, at(block(span + 10, 8, 3), 0, 0, 9))


def tree(r: Random) -> Node:
    """A ball on a trunk that can carry it."""
    radius = r.uniform(6, 10)
    return union(rod(8, 2), rod(radius / 3, 12), at(sphere(radius=radius), 0, 0, 11 + radius))


def test_a_ring_on_the_plate_needs_supports_only() -> None:
    """The plate closes it, and supports open it; a cup stays one."""
    ring, cup_of_resin = torus(radius=10, tube=2), cup(np.random.default_rng(0))
    assert verdict(examined(ring, 0.4).problems) == "would print with supports"
    assert verdict(examined(cup_of_resin, 0.4).problems) == "would not print"


@pytest.mark.nightly
def test_a_drain_hole_that_may_close_is_named() -> None:
    def problems(drain: float) -> list[Problem]:
        job = SliceJob(size=12, layer=0.3, pixel=(0.3, 0.3), printing=Print(hollow=2, drain=drain))
        coarse = Limits(wall=1, floor=1)  # which need few samples; that of holes is the default
        return check_layers(plan_stack(box(), job), coarse).problems

    (hole,) = (p for p in problems(0.4) if p.kind == "holes")
    assert (
        "0.4 mm, narrower than 0.5 mm" in hole.text and hole.count == 2 and hole.mend == (("drain", "3mm"),)
    )
    assert "holes" not in [p.kind for p in problems(2)]


GOOD: list[Family] = [brick, disc, upright_cone, ring, tunnel, ledge, dome, tower, trestle, tree]


@each_seed
@pytest.mark.parametrize("family", BAD, ids=lambda f: f.__name__)
def test_bad_models_are_refused_for_their_own_fault(family: Family, seed: int) -> None:
    problems = examined(family(np.random.default_rng(seed))).problems
    assert BAD[family] in [p.kind for p in problems]
    (mine, *_) = (p for p in problems if p.kind == BAD[family])
    assert mine.mend or mine.advice
    assert mine.at is not None or mine.kind == "fit"


@each_seed
@pytest.mark.parametrize("family", GOOD, ids=lambda f: f.__name__)
def test_good_models_are_not_blamed(family: Family, seed: int) -> None:
    assert examined(family(np.random.default_rng(seed))).problems == []
