"""Boxes of orbits, proved by intervals."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from fracslice.expr.intervals import Interval
from fracslice.fields.box import proved_half
from fracslice.fields.devices import enclosure, reference
from fracslice.fields.registry import Node
from fracslice.formulas import (
    bristorbrot,
    burning_ship,
    kifs_octahedron,
    lambda_bulb,
    mandelbox,
    orbit,
    transform,
)

pytestmark = pytest.mark.once

ROOTS = {
    "mandelbox": mandelbox(iterations=6),
    "bristorbrot": bristorbrot(iterations=8),
    "lambda bulb": lambda_bulb(iterations=4),
    "kifs": kifs_octahedron(iterations=5),
    "hybrid": orbit(transform(bristorbrot(), rotate=(1, 2, 3, 40)), mandelbox(scale=-1.5), iterations=2),
}


def signs(root: Node) -> Callable[..., Interval]:
    return enclosure(root.signs())


@pytest.mark.parametrize("name", ROOTS)
def test_no_point_outside_of_the_box_is_inside(name: str) -> None:
    root = ROOTS[name]
    half = np.array(root.proved_box.hi)
    points = np.random.default_rng(0).uniform(-1, 1, (3, 20000)) * 1.6 * half[:, None]
    outside = (abs(points) > half[:, None]).any(0)
    assert outside.sum() > 5000 and not (reference(root)(*points[:, outside]) <= 0).any()


def test_a_proved_box_of_a_tight_orbit_is_the_stated_one() -> None:
    assert ROOTS["mandelbox"].proved_box == ROOTS["mandelbox"].bounds.box


def test_the_proved_box_lies_in_the_ball_that_no_orbit_comes_back_from() -> None:
    """Fold and constant cancel, by intervals they do not: the box was the ball where orbits stop, 300."""
    root = orbit(mandelbox(scale=1.0, inner=1.0), burning_ship(power=12, repeat=2), iterations=4)
    assert max(root.proved_box.hi) < 1.2 * max(root.bounds.box.hi)


def test_a_box_that_is_too_small_grows() -> None:
    root = ROOTS["bristorbrot"]
    full = np.array(root.proved_box.hi)
    half = proved_half(signs(root), 4.0, tuple((0.2 * full).tolist()))
    points = np.random.default_rng(0).uniform(-1, 1, (3, 20000)) * full[:, None]
    inside = points[:, reference(root)(*points) < 0]
    assert (abs(inside).max(1) > 0.3 * full).any() and (abs(inside) <= np.array(half)[:, None]).all()
