"""Signs of orbits on cells: boxes and balls."""

from __future__ import annotations

import numpy as np
import pytest

from fracslice.expr.intervals import ARRAYS, Interval
from fracslice.fields.cpu import compile_scene
from fracslice.fields.devices import enclosure, reference
from fracslice.fields.field import Precision
from fracslice.formulas import (
    Node,
    burning_ship,
    kifs_icosahedron,
    mandelbox,
    mandelbulb,
    orbit,
    quaternion_mandelbrot,
    transform,
)

pytestmark = pytest.mark.once

RNG = np.random.default_rng(8)
KALEIDOSCOPE = orbit(
    kifs_icosahedron(),
    transform(burning_ship(power=4), rotate=(-0.2, -1, -1.5, 292), scale=1.3),
    iterations=2,
)
"""Intervals of the kaleidoscope's folds and turns are many times as wide as its images."""


@pytest.mark.parametrize(
    ("root", "precision", "n"),
    [
        (quaternion_mandelbrot(julia=(-0.2, 0.8, 0.0), iterations=12), "float32", 32),
        (quaternion_mandelbrot(julia=(-0.2, 0.8, 0.0), iterations=12), "float64", 32),
        (mandelbulb(power=3, iterations=5), "float32", 24),
        (orbit(mandelbulb(power=4), mandelbox(scale=-1.5), iterations=2), "float32", 12),
    ],
)
def test_no_cell_of_the_surface_is_proved(root: Node, precision: Precision, n: int) -> None:
    """Cells around the solid; some orbits leave the range of float32 in a part of a cell."""
    half = max(root.bounds.box.hi) * 1.05
    centres = half * ((2 * np.indices((n,) * 3).reshape(3, -1) + 1) / n - 1)
    cells = root.cells(precision)
    assert cells is not None
    empty, full = cells(centres, half / n)
    offsets = 0.999 * half / n * (np.indices((3,) * 3).reshape(3, 1, -1) - 1)
    inside = compile_scene(root, "float64").points(*(centres[:, :, None] + offsets)) < 0
    assert not (empty & inside.any(1)).any() and not (full & ~inside.all(1)).any()
    assert empty.sum() > 50


def test_balls_enclose_a_kaleidoscope() -> None:
    """Half of the cells at 1.5 times the radius of the solid are proved; by boxes alone, none is."""
    half = max(KALEIDOSCOPE.bounds.box.hi)
    centres = RNG.normal(size=(3, 500))
    centres *= 1.5 * half / np.linalg.norm(centres, axis=0)
    sides = (Interval(c - half / 32, c + half / 32, ARRAYS).outward() for c in centres)
    assert (enclosure(KALEIDOSCOPE.signs())(*sides).lo > 0).mean() > 0.5
    assert max(KALEIDOSCOPE.proved_box.hi) < 1.2 * half


def test_the_sign_of_a_point_is_that_of_the_field() -> None:
    points = RNG.uniform(-1, 1, (3, 5000))
    assert ((reference(KALEIDOSCOPE.signs())(*points) < 0) == (reference(KALEIDOSCOPE)(*points) < 0)).all()
