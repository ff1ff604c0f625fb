"""Float32 and float64 kernels against the float64 reference, over decades of scale, depth and parameters."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fracslice.fields.cpu import compile_scene
from fracslice.fields.field import Precision
from fracslice.formulas import names, sphere, transform
from tests.examples import EXAMPLES, OF_FILES, STRUCTURES, stamped
from tests.stability.random_scenes import ORBITS

from .extremes import ends
from .measure import coordinate_error, depth_error, nan_count, scale_error
from .scaling import LENGTHS, scaled

pytestmark = pytest.mark.once

LIMIT: dict[Precision, float] = {"float32": 1e-5, "float64": 2e-14}
QUICK = STRUCTURES - {"hybrid transformed"}
"""Each of the hybrid's extreme versions proves a radius of escape."""
DEEP = {name: root for name, root in EXAMPLES.items() if "iterations" in root.values}


@pytest.mark.parametrize("precision", LIMIT)
@pytest.mark.parametrize("name", stamped(EXAMPLES, QUICK))
class TestEveryFormula:
    def test_ten_decades_of_scale(self, name: str, precision: Precision) -> None:
        assert scale_error(EXAMPLES[name], precision, 500) < LIMIT[precision]

    def test_ten_decades_of_coordinates(self, name: str, precision: Precision) -> None:
        assert coordinate_error(EXAMPLES[name], precision, 1000) < LIMIT[precision]

    def test_extreme_parameters_and_points_give_numbers(self, name: str, precision: Precision) -> None:
        lost, seen = nan_count(EXAMPLES[name], precision)
        assert lost == 0 and seen > 1000


@pytest.mark.parametrize("precision", LIMIT)
@pytest.mark.parametrize("name", stamped(DEEP, QUICK))
def test_a_thousand_steps(name: str, precision: Precision) -> None:
    assert depth_error(DEEP[name], precision, 400) < LIMIT[precision]


def test_every_formula_is_scaled() -> None:
    fractals = {name for name in names() if name not in LENGTHS}
    by_hand = {"mandelbulb", "julia", "menger", "flake", "cells", "jerusalem", "tetrabrot", "hilbert", "tree"}
    of_files = {EXAMPLES[name].formula.name for name in OF_FILES if not EXAMPLES[name].fields}
    by_hand |= {"apollonian", "honeycomb", "pseudo_kleinian", "orbit", "preimage"}
    assert fractals == by_hand | of_files | {*ORBITS}
    assert scaled(sphere(radius=2), 3.0) == sphere(radius=6)
    assert scaled(transform(sphere(), translate=(1, 0, 0)), 2.0).values["translate"] == (2, 0, 0)


def test_the_ends_of_a_range_are_in_it() -> None:
    for root in EXAMPLES.values():
        for kind in root.formula.parameters.values():
            for value in ends(kind):
                if not getattr(kind, "nonzero", False):
                    kind.check(value)


def test_the_derivative_overflows_and_is_survived() -> None:
    """c = -2 doubles the derivative for ever and sends the centre 0 -> -2 -> 2 -> 2."""
    from fracslice.formulas import julia

    axis = np.linspace(-2, 2, 257)
    for precision in LIMIT:
        kernel = compile_scene(julia(c=(-2, 0, 0, 0), iterations=1000), precision)
        f = kernel.points(axis, 0 * axis, 0 * axis)
        assert np.isfinite(f).all() and (f <= 0).all() and math.isclose(f.max(), 0, abs_tol=1e-6)
