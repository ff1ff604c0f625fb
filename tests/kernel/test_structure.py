"""Parts that differ in numbers only are one function, however many there are, and deep scenes compile."""

from __future__ import annotations

import llvmlite.binding as llvm
import numpy as np
import pytest

from fracslice.errors import SceneError
from fracslice.expr import emitter
from fracslice.expr.loops import points
from fracslice.expr.runtime import REGISTERS, host
from fracslice.expr.values import Lanes
from fracslice.fields.cpu import compile_scene
from fracslice.fields.devices import reference
from fracslice.fields.linker import link
from fracslice.formulas import (
    Node,
    bounds,
    box,
    difference,
    intersection,
    julia,
    material,
    offset,
    repeat,
    sphere,
    torus,
    transform,
    twist,
    union,
)
from fracslice.rendering.linking import link_frame
from fracslice.rendering.setup import optics
from fracslice.scene.view import Camera, Light, View

pytestmark = pytest.mark.once

P = np.random.default_rng(2).uniform(-1.5, 1.5, (3, 500))


def ball(k: int) -> Node:
    return transform(sphere(radius=0.1 + 0.01 * k), translate=(0.02 * k - 0.8, 0.3 * (k % 7) - 1.0, 0.1))


def block(k: int) -> Node:
    return transform(box(size=(0.1 + 0.01 * k, 0.2, 0.3)), rotate=(1, k, 0, 7 * k + 1), scale=1 + 0.01 * k)


def nested(depth: int) -> Node:
    root = sphere()
    for k in range(depth - 1):
        root = bounds(root, min=(-9 - k, -9, -9), max=(9, 9, 9 + k))
    return root


def instructions(root: Node) -> int:
    """Of LLVM's, in the kernel."""
    target = emitter.Target(32, 32, REGISTERS, *host())
    lanes = Lanes(target.bits, target.width, target.registers)
    module = llvm.parse_assembly(
        emitter._text(link(root).program, lanes, llvm.get_process_triple(), [points])
    )
    emitter._optimise(module, emitter._target_machine(target), 2)
    return sum(1 for f in module.functions for b in f.blocks for _ in b.instructions)


FOLDS = {
    "union": union,
    "intersection": intersection,
    "difference": difference,
    "smooth union": lambda *e: union(*e, smooth=0.1),
    "smooth difference": lambda *e: difference(*e, smooth=0.05),
}
KINDS = {
    "of one kind": [ball(k) for k in range(9)],
    "of two kinds in turn": [f(k) for k in range(8) for f in (ball, block)],
    "of runs": [
        sphere(),
        *(ball(k) for k in range(5)),
        sphere(radius=0.4),
        *(block(k) for k in range(6)),
        torus(),
    ],
    "nested": [twist(union(*(ball(k + j) for j in range(5))), degrees=10 * k + 5) for k in range(6)],
}


@pytest.mark.parametrize("fold", FOLDS)
@pytest.mark.parametrize("kind", KINDS)
def test_every_element_has_its_own_numbers(fold: str, kind: str) -> None:
    root = FOLDS[fold](*KINDS[kind])
    values = [reference(element)(*P) for element in KINDS[kind]]
    if " " not in fold:
        first, rest = values[0], values[1:]
        folds = {
            "union": lambda: np.minimum.reduce(values),
            "intersection": lambda: np.maximum.reduce(values),
            "difference": lambda: np.maximum(first, -np.minimum.reduce(rest)),
        }
        np.testing.assert_array_equal(reference(root)(*P), folds[fold]())
    np.testing.assert_allclose(compile_scene(root, "float64").points(*P), reference(root)(*P), atol=1e-12)


@pytest.mark.parametrize(("counts", "seam"), [((5, 15), 0.0), ((20, 80), 0.0), ((20, 80), 0.1)])
def test_the_number_of_elements_costs_nothing(counts: tuple[int, ...], seam: float) -> None:
    few, many = (union(*(f(k) for k in range(n) for f in (ball, block)), smooth=seam) for n in counts)
    assert len(link(many).program.parts) == len(link(few).program.parts)
    assert instructions(many) < 1.1 * instructions(few)


def test_seams_of_kinds_in_turn_cost_a_call_each() -> None:
    few, many = (union(*(f(k) for k in range(n) for f in (ball, block)), smooth=0.1) for n in (5, 15))
    assert len(link(many).program.parts) == len(link(few).program.parts)
    assert instructions(many) < 3.3 * instructions(few)


def test_depth_costs_as_much_as_it_is_deep() -> None:
    """Forty levels of different structure: each is compiled once, and no function holds more than a few."""
    assert instructions(nested(80)) < 2.2 * instructions(nested(40))
    assert len(link(nested(40)).program.parts) == 40


def test_a_hundred_levels_compute_what_they_should() -> None:
    root = nested(100)
    got = compile_scene(root, "float64").points(*P)
    np.testing.assert_allclose(got, np.linalg.norm(P, axis=0) - 1, atol=1e-12)


def test_more_than_a_hundred_levels_are_refused_where_they_are_made() -> None:
    with pytest.raises(SceneError, match=r"^<bounds> is nested too deeply: expected at most 100 elements"):
        nested(101)


def test_facts_and_texts_of_a_deep_tree_need_no_deep_recursion() -> None:
    root = julia(iterations=2)
    for _ in range(48):
        root = offset(repeat(root, period=(9, 9, 9), count=(1, 1, 1)), distance=0.001)
    assert root.bounds.box.finite
    assert hash(root) == hash(root.changed()) and root == root.changed()
    assert "julia" in repr(root)
    assert root.conservative().is_conservative
    assert root.key == root.changed().key
    assert len(list(root.walk())) == 97


def test_a_tree_without_fractals_is_its_own_conservative_and_proved_tree() -> None:
    """So that a long one is linked, compiled and asked for its elements once."""
    root = union(*(transform(sphere(radius=0.1), translate=(k, 0, 0)) for k in range(4)))
    assert root.conservative() is root and root.signs() is root
    mixed = union(root, julia(iterations=2)).conservative()
    assert mixed.is_conservative and mixed.children[0] is root and mixed.conservative() is mixed


def test_paints_of_many_materials_are_numbers() -> None:
    def parts(count: int) -> list[str]:
        root = union(*(material(ball(k), colour=(0.1, 0.01 * k, 0.2)) for k in range(count)))
        camera = Camera(eye=(2, -2, 1))
        view = View(camera=camera, lights=(Light(shadows="no"),))
        program = link_frame(root, view, camera, optics(camera, (32, 32), root, 1e-7)).linked.program
        return [part.name[0] for part in program.parts]

    assert parts(60) == parts(10) and "T" in parts(10)
