"""Loops over a long union look at the elements near a point only, and change no bit."""

from __future__ import annotations

import numpy as np
import pytest

from fracslice.fields.cpu import CpuKernel, Region, compile_scene
from fracslice.fields.devices import reference
from fracslice.formulas import (
    Node,
    box,
    difference,
    intersection,
    material,
    shell,
    sphere,
    torus,
    transform,
    union,
)

pytestmark = pytest.mark.once

RNG = np.random.default_rng(5)


def elements(count: int, *kinds: Node) -> list[Node]:
    """Elements of some kinds at random places, turned."""
    turns = [(*RNG.normal(size=3), RNG.uniform(0, 180)) for _ in range(count)]
    places = RNG.uniform(-1, 1, (count, 3))
    return [
        transform(kinds[k % len(kinds)], translate=tuple(p), rotate=turn, scale=RNG.uniform(0.05, 0.2))
        for k, (p, turn) in enumerate(zip(places, turns, strict=True))
    ]


KINDS = sphere(), box(), torus()
SCENES = {
    "balls": union(*elements(200, sphere())),
    "of three kinds": union(*elements(150, *KINDS)),
    "cut": transform(
        difference(union(*elements(120, *KINDS)), sphere(radius=0.6)), scale=0.7, translate=(0.1, 0.2, 0.3)
    ),
    "in groups": union(material(union(*elements(100, box()))), sphere(radius=0.3)),
    "the same forty times": union(*[sphere(radius=0.5)] * 40),
    "of unions": union(*(union(*elements(20, sphere())) for _ in range(40))),
    "within": intersection(union(*elements(64, sphere())), box(size=(1, 1, 1))),
}


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("precision", ["float32", "float64"])
def test_no_bit_changes(name: str, precision) -> None:  # type: ignore[no-untyped-def]
    root = SCENES[name]
    near, whole = compile_scene(root, precision), CpuKernel(root.linked, precision)
    corners = RNG.integers(-40, 40, (60, 3)).astype(np.int32)
    values = [np.empty((60, 512), near.dtype) for _ in range(2)]
    for kernel, out in zip((near, whole), values, strict=True):
        kernel.bricks(corners, (-0.01, 0.02, 0.03), 0.03, out)
    assert values[0].tobytes() == values[1].tobytes()
    far = np.full((3, 1), 1e6)
    points = np.concatenate([RNG.uniform(-2, 2, (3, 3000)), RNG.normal(0, 0.4, (3, 3000)), far], axis=1)
    points[0, 0] = np.nan
    assert near.points(*points).tobytes() == whole.points(*points).tobytes()
    np.testing.assert_allclose(near.points(*points), reference(root)(*points), atol=2e-6)


def test_long_unions_are_listed_and_no_others() -> None:
    """Lists of one element are those of the union; a field that a shell folds is not a union's."""
    assert {name for name, root in SCENES.items() if Region.of(root.linked) is not None} == {*SCENES} - {
        "of unions"
    }
    assert Region.of(shell(union(*elements(50, sphere())), thickness=0.01).linked) is None
    assert Region.of(union(*elements(8, sphere())).linked) is None
    sizes = [one.count for one in SCENES["of three kinds"].linked.lists]
    assert sorted(sizes) == [50, 50, 50]


def test_scenes_of_other_numbers_of_elements_are_one_program() -> None:
    few, many = (union(*elements(count, sphere())).linked.program for count in (20, 300))
    assert few == many
