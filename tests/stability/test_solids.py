"""Shipped scenes with other numbers are solids too; `tests.benchmarks stability.scenes` tries hundreds."""

from __future__ import annotations

import re

import pytest

from fracslice.fields.depth import resolve_depths
from fracslice.formulas import intersection, sphere, transform
from fracslice.scene import library
from tests.benchmarks.stability.scenes import drawn_settings
from tests.examples import stamped

from .solids import Outcome, outcome

pytestmark = pytest.mark.once


OFTEN = "mandelbulb", "trophy"


@pytest.mark.parametrize(
    "name", stamped(sorted({*library.names()} - {"hybrid"}), OFTEN)
)  # its steps are no solids
def test_other_numbers_make_a_solid(name: str) -> None:
    root = drawn_settings(name, 1)[1]
    result = outcome(root, 24, threads=2)
    assert result == Outcome() or re.search("there is no surface|is outside", result.refused)


@pytest.mark.parametrize(
    ("name", "setup"),
    stamped([("raspberry", 20), ("spinning-top", 7), ("spinning-top", 12)], [("raspberry", 20)]),
)
def test_nothing_to_repair_where_there_was(name: str, setup: int) -> None:
    """Dust of powers 18 and 27, and torn dust of power 7.5: 22, 92 and 34 violations once."""
    root = drawn_settings(name, setup)[setup]
    shown = resolve_depths(root, max(root.bounds.box.size) / 48)  # a deeper solid is finer than these voxels
    assert outcome(shown, 48, threads=2) == Outcome()


def test_what_is_nothing_is_refused() -> None:
    disjoint = intersection(sphere(), transform(sphere(), translate=(3, 0, 0)))
    assert outcome(disjoint, 32).refused.startswith("the scene is empty")
