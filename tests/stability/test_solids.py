"""Shipped scenes with other numbers are solids too; `tests.benchmarks.stability.scenes` tries hundreds."""

from __future__ import annotations

from dataclasses import replace

import pytest

from fracslice.formulas import intersection, sphere, transform
from fracslice.scene import library
from tests.benchmarks.stability.scenes import settings

from .draws import torn
from .solids import Outcome, outcome


@pytest.mark.parametrize("name", library.names())
def test_other_numbers_make_a_solid(name: str) -> None:
    root = settings(name, 1)[1]
    found = outcome(root, 24, threads=2)
    if torn(root):
        found = replace(found, repaired=0)
    assert found == Outcome() or "there is no surface" in found.refused


def test_what_is_nothing_is_refused() -> None:
    apart = intersection(sphere(), transform(sphere(), translate=(3, 0, 0)))
    assert outcome(apart, 32).refused.startswith("the scene is empty")
