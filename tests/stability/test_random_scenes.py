"""Random scenes are solids of their own volume; `make nightly` tries hundreds."""

from __future__ import annotations

import pytest

from fracslice.formulas import Node, names
from fracslice.kernel.depth import AUTO

from .random_scenes import FAMILIES, random_scene
from .volumes import volumes

TREES, EACH = (0, 2, 9, 15, 16, 21, 22, 29, 36, 38), 4
"""Trees with every kind of element that need little to be compiled, and four times other numbers."""

RESOLUTION = 48


@pytest.mark.parametrize("tree", TREES)
def test_a_random_scene_is_a_solid_of_its_own_volume(tree: int) -> None:
    result = {numbers: volumes(random_scene(tree, numbers), RESOLUTION) for numbers in range(EACH)}
    assert {numbers: one.faults for numbers, one in result.items() if one.faults} == {}


def test_the_same_seeds_make_the_same_scene() -> None:
    assert [random_scene(3, k) for k in range(EACH)] == [random_scene(3, k) for k in range(EACH)]
    assert len({random_scene(3, k) for k in range(EACH)}) == EACH


def test_every_formula_is_in_some_scene_and_automatic_depths_too() -> None:
    nodes: list[Node] = [node for tree in range(60) for node in random_scene(tree, 0).walk()]
    assert {node.formula.name for node in nodes} >= set(names()) - {"material", "orbit", *FAMILIES}
    assert {node["iterations"] == AUTO for node in nodes if "iterations" in node.values} == {True, False}
