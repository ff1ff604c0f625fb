"""Random scenes are solids of their own volume; `make nightly` tries hundreds."""

from __future__ import annotations

import numpy as np
import pytest

from fracslice.fields.depth import AUTO
from fracslice.formulas import Formula, Node
from tests.examples import stamped

from .random_scenes import LEAVES, OTHERS, leaf, random_scene
from .volumes import volumes

pytestmark = pytest.mark.once

TREES, EACH = (2, 10, 18, 25, 32, 52), 2
"""Trees with every kind of element that need little to be compiled, and twice other numbers."""

RESOLUTION = 32


@pytest.mark.parametrize("tree", stamped(TREES, TREES[1:2]))
def test_a_random_scene_is_a_solid_of_its_own_volume(tree: int) -> None:
    result = {numbers: volumes(random_scene(tree, numbers), RESOLUTION) for numbers in range(EACH)}
    assert {numbers: one.faults for numbers, one in result.items() if one.faults} == {}


def test_the_same_seeds_make_the_same_scene() -> None:
    assert [random_scene(3, k) for k in range(EACH)] == [random_scene(3, k) for k in range(EACH)]
    assert len({random_scene(3, k) for k in range(EACH)}) == EACH


@pytest.mark.parametrize(
    "formula", stamped(LEAVES, [f for f in LEAVES if f.name != "orbit"]), ids=lambda formula: formula.name
)
def test_every_shape_can_be_drawn(formula: Formula) -> None:
    """The trees draw from all shapes with equal chances; here one of each that is a solid."""
    drawn = (leaf(formula, np.random.default_rng(seed)) for seed in range(20))
    assert any(node is not None and formula in {n.formula for n in node.walk()} for node in drawn)


def test_every_operator_is_in_some_scene_and_automatic_depths_too() -> None:
    nodes: list[Node] = [node for tree in TREES for node in random_scene(tree, 0).walk()]
    assert {node.formula for node in nodes} >= set(OTHERS)
    assert {node["iterations"] == AUTO for node in nodes if "iterations" in node.values} == {True, False}
