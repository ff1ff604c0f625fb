"""Adaptive layers: cusps no higher than asked for, thick where the surface is steep."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fracslice.errors import SliceError
from fracslice.formulas import Node, cylinder, menger, sphere
from fracslice.slicing import SliceJob, Slicer, Stack, adapted, plan_stack
from fracslice.work import Work

pytestmark = pytest.mark.once

LEAST, MOST = 0.05, 0.2


def planned(root: Node) -> Stack:
    return plan_stack(root, SliceJob(size=20, layer=LEAST, pixel=(0.1, 0.1)))


def test_cusps_of_a_sphere() -> None:
    stack = adapted(planned(sphere()), MOST)
    bottoms = stack.tops - stack.heights
    # The vertical part of the normal at a height is its distance from the middle; a tenth may be steeper.
    steepest = np.maximum(abs(bottoms - 10), abs(stack.tops - 10)) / 10
    assert (stack.heights * steepest <= LEAST * 1.05 + 1e-9)[stack.heights > LEAST + 1e-9].all()
    assert stack.heights.min() == pytest.approx(LEAST)
    assert stack.heights.max() == pytest.approx(MOST)
    assert stack.tops[-1] == pytest.approx(20)
    middle = abs(stack.tops - 10 - MOST / 2).argmin()
    assert stack.heights[middle] == pytest.approx(MOST)


@pytest.mark.parametrize("root", [cylinder(), menger(level=1)])
def test_walls_take_the_highest_layers(root: Node) -> None:
    fine = planned(root)
    stack = adapted(fine, MOST)
    assert len(stack.z) < 0.32 * len(fine.z)
    assert stack.tops[-1] == pytest.approx(fine.tops[-1])


@pytest.mark.nightly
def test_layers_are_cut_in_their_middle_and_fill_the_object() -> None:
    stack = adapted(planned(sphere()), MOST)
    np.testing.assert_allclose((stack.z + 1) * 10, stack.tops - stack.heights / 2, atol=2e-5)
    areas = list(Slicer(stack).map(lambda layer: layer.contours.area))
    assert np.dot(areas, stack.heights) == pytest.approx(4 / 3 * math.pi * 1000, rel=1e-3)


def test_the_same_for_any_number_of_threads() -> None:
    stack = planned(menger(level=2))
    assert (adapted(stack, MOST, Work(threads=1)).tops == adapted(stack, MOST, Work(threads=3)).tops).all()


@pytest.mark.parametrize("most", [0.01, math.nan, math.inf])
def test_impossible_ranges(most: float) -> None:
    with pytest.raises(SliceError, match=r"expected a (range|length)"):
        adapted(planned(sphere()), most)
