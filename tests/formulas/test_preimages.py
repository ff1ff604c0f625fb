"""Solids that the steps of an orbit lead to."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fracslice.errors import SceneError
from fracslice.fields.definitions import Definition, formula
from fracslice.formulas import box, mandelbox, orbit, preimage, sphere, transform
from fracslice.scene import reads

pytestmark = pytest.mark.once

HALVES = formula(Definition("halves", (), "return 2 * positive(w) - (1, 1, 1)"))
"""Twice the absolute coordinates, less 1: eight copies of half the size in each step."""

POINTS = np.random.default_rng(0).uniform(-1.5, 1.5, (3, 2000))


def image(w: np.ndarray, rounds: int) -> np.ndarray:
    for _ in range(rounds):
        w = 2 * abs(w) - 1
    return w


def test_last_points_are_measured_with_the_solid() -> None:
    solid = preimage(HALVES(iterations=3), sphere(radius=0.5))
    expected = (np.linalg.norm(image(POINTS, 3), axis=0) - 0.5) / 8
    assert solid.distance(POINTS.T) == pytest.approx(expected, abs=1e-6)
    assert solid.bounds.lipschitz == 1


def test_every_point_is_measured_and_the_least_counts() -> None:
    solid = preimage(HALVES(iterations=3), sphere(radius=0.5), of="every")
    rounds = [(np.linalg.norm(image(POINTS, k), axis=0) - 0.5) / 2**k for k in (1, 2, 3)]
    assert solid.distance(POINTS.T) == pytest.approx(np.min(rounds, axis=0), abs=1e-6)


def test_box_encloses_the_solid_and_an_endless_one_has_none() -> None:
    whole = preimage(HALVES(iterations=3), sphere(0.5)).bounds.box
    low, high = np.array(whole.lo), np.array(whole.hi)
    assert (low <= -0.9375).all() and (high >= 0.9375).all() and (high - low <= 2.2).all()
    tiled = formula(Definition("tiled", (), "x, y, z = w\nreturn (x - floor(x) - 0.5, y, z)"))
    box_ = preimage(tiled(iterations=1), sphere(radius=0.3)).bounds.box
    assert math.isinf(box_.hi[0]) and math.isfinite(box_.hi[1])


def test_several_solids_are_united_and_steps_may_be_a_hybrid() -> None:
    steps = orbit(mandelbox(), transform(HALVES(), rotate=(0, 0, 1, 30)), iterations=2)
    one, two = sphere(radius=2), transform(box(size=(1, 1, 1)), translate=(4, 0, 0))
    both = preimage(steps, one, two).distance(POINTS.T)
    assert both == pytest.approx(
        np.minimum(preimage(steps, one).distance(POINTS.T), preimage(steps, two).distance(POINTS.T)), rel=1e-6
    )


@pytest.mark.parametrize(
    ("steps", "message"),
    [
        ('<sphere radius="1"/>', "expected an escape-time fractal or <orbit> as the first element"),
        ("<mandelbox/>", "expected a number of iterations of its <mandelbox>, not auto"),
        ('<orbit iterations="2"><sphere radius="1"/></orbit>', "has no step"),
    ],
)
def test_first_element_is_checked(steps: str, message: str) -> None:
    inside = f'<preimage>{steps}<sphere radius="1"/></preimage>'
    text = f'<scene version="1"><solid size="60mm">\n{inside}</solid></scene>'
    with pytest.raises(SceneError, match=message) as caught:
        reads(text)
    assert "\n" not in str(caught.value)
