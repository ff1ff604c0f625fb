"""The field that space is skipped by: the scene's own, but beside tears and at seams."""

from __future__ import annotations

import numpy as np
import pytest

from fracslice.fields.cpu import compile_scene
from fracslice.fields.devices import reference
from fracslice.fields.field import Precision
from fracslice.fields.linker import link
from fracslice.fields.maps import sure_distance
from fracslice.formulas import Node, julia, mandelbulb, sphere, transform, union
from tests.examples import EXAMPLES

pytestmark = pytest.mark.once

TORN = mandelbulb(iterations=4, power=7.5)
SEAM = union(mandelbulb(iterations=4), sphere(radius=1.02), smooth=0.1)
DIFFERENT: dict[str, Node] = {
    "torn": TORN,
    "torn pieces": mandelbulb(iterations=3, power=7.5, julia=(1.0, -0.7, 0.4)),
    "seam": SEAM,
    "seam with a torn one": union(TORN, sphere(radius=1.02), smooth=0.1),
    "example of the documentation": EXAMPLES["example of the documentation"],
    "hybrid": EXAMPLES["hybrid"],
    "hybrid transformed": EXAMPLES["hybrid transformed"],
}
SAME = sorted(set(EXAMPLES) - {"mandelbulb 7.5", *DIFFERENT})


def anywhere(count: int = 40_000) -> np.ndarray:
    points = np.random.default_rng(4).uniform(-1.4, 1.4, (3, count)).astype(np.float32)
    return points.astype(np.float64)


@pytest.mark.parametrize("name", SAME)
def test_most_scenes_are_their_own_guard(name: str) -> None:
    """The same code and numbers: nothing is compiled for it."""
    own, conservative = link(EXAMPLES[name]), link(EXAMPLES[name].conservative())
    assert own.program == conservative.program and np.array_equal(own.parameters, conservative.parameters)


@pytest.mark.parametrize("name", DIFFERENT)
def test_a_guard_is_less_where_it_differs(name: str) -> None:
    points, root = anywhere(), DIFFERENT[name]
    own, conservative = reference(root)(*points), reference(root.conservative())(*points)
    assert (own[conservative > 0] >= 0).all()
    assert (conservative <= own + 1e-12)[own > 0].all() and (conservative < own - 1e-3)[own > 0].any()


@pytest.mark.parametrize("precision", ["float32", "float64"])
@pytest.mark.parametrize("name", DIFFERENT)
def test_the_kernel_is_the_reference(name: str, precision: Precision) -> None:
    points, conservative = anywhere(5000), DIFFERENT[name].conservative()
    got = compile_scene(conservative, precision).points(*points)
    limit = 1e-4 if precision == "float32" else 1e-11
    np.testing.assert_allclose(got, reference(conservative)(*points), rtol=limit, atol=limit)


def test_a_guard_vanishes_on_the_tear() -> None:
    """The half plane y = 0, x < 0: the solid goes on elsewhere on the other side."""
    x, z = np.random.default_rng(0).uniform((-1.1, -0.5), (-0.7, 0.5), (500, 2)).T
    own, conservative = (reference(r)(x, np.full_like(x, 1e-7), z) for r in (TORN, TORN.conservative()))
    assert own.max() > 0.01 and 0 < conservative[own > 0].max() < 1e-6


def test_a_seam_costs_nothing_elsewhere() -> None:
    """Far from one of the two, L is what it is without a seam, not 1.25 times that."""
    far = union(mandelbulb(iterations=4), transform(sphere(), translate=(4, 0, 0)), smooth=0.1).conservative()
    points = anywhere()
    own, alone = reference(far)(*points), reference(mandelbulb(iterations=4))(*points)
    assert far.bounds.lipschitz == 2.0
    np.testing.assert_array_equal(own[alone > 0], alone[alone > 0])


def test_the_highest_power_steepens() -> None:
    assert sphere().bounds.steepening == 0 and julia().bounds.steepening == 2
    half = transform(mandelbulb(power=5), scale=(0.5,))
    assert union(half, julia()).bounds.steepening == 5


@pytest.mark.parametrize("precision", ["float32", "float64"])
@pytest.mark.parametrize(
    "root", [mandelbulb(power=2, bailout=5e5, iterations=3), julia(bailout=1e6, iterations=4)]
)
def test_inside_is_inside_for_large_bailouts(root: Node, precision: Precision) -> None:
    points = anywhere(5000)
    inside = reference(root)(*points) < 0
    assert inside.any() and ((compile_scene(root, precision).points(*points) < 0) == inside).all()


@pytest.mark.parametrize("power", [2, 3, 8, 7.5, 12])
def test_a_sure_distance_is_sure(power: float) -> None:
    """Two steps of z^p + c in the complex plane: no point nearer than that is moved by `margin`."""
    rng = np.random.default_rng(1)
    start = rng.uniform(0.5, 1.1, 2000) * np.exp(1j * rng.uniform(-0.2, 0.2, 2000))
    c = rng.uniform(0, 1, 2000) + 0.2j
    slope, bend, w = np.ones(len(start)), np.zeros(len(start)), start
    for _ in range(2):
        bend = bend + slope * (power - 1) / (2 * np.abs(w))
        slope = slope * power * np.abs(w) ** (power - 1)
        w = _step(w, power, c)
    margin = np.abs(w) * 10 ** rng.uniform(-3, 3, len(start))
    sure = sure_distance(margin, slope, bend)
    direction = np.exp(2j * np.pi * rng.uniform(size=(200, len(start))))
    near = start + 0.999 * sure * direction
    moved = np.abs(_step(_step(near, power, c), power, c) - w)
    assert (moved < margin).all() and (moved > 0.8 * margin).any()


def _step(w: np.ndarray, power: float, c: np.ndarray) -> np.ndarray:
    result: np.ndarray = w**power + c
    return result
