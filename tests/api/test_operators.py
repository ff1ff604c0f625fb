"""Operators and methods of shapes, against NumPy on the values of the reference."""

from __future__ import annotations

from functools import reduce
from operator import or_

import numpy as np
import pytest
from hypothesis import given, settings

from fracslice import box, difference, intersection, sphere, torus, transform, union
from fracslice.errors import SceneError
from fracslice.fields.devices import reference
from fracslice.formulas import Node, get, names
from tests.examples import EXAMPLES, stamped
from tests.formulas.test_bounds import TREES

POINTS = np.random.default_rng(5).uniform(-1.5, 1.5, (3, 500))


def values(shape: Node) -> np.ndarray:
    return reference(shape)(*POINTS)


@settings(max_examples=40, deadline=None)
@given(TREES, TREES)
def test_operators_are_minima_and_maxima(a: Node, b: Node) -> None:
    try:
        f, g = values(a), values(b)
    except SceneError:
        return  # a repetition denser than it may be
    assert np.array_equal(values(a | b), np.minimum(f, g))
    assert np.array_equal(values(a & b), np.maximum(f, g))
    assert np.array_equal(values(a - b), np.maximum(f, -g))


@settings(max_examples=20, deadline=None)
@given(TREES)
def test_adding_moves(a: Node) -> None:
    try:
        there = reference(a + (0.3, -0.2, 0.5))(*(POINTS + [[0.3], [-0.2], [0.5]]))
        np.testing.assert_allclose(there, values(a), rtol=0, atol=1e-12)
    except SceneError:
        return


@settings(max_examples=50, deadline=None)
@given(TREES)
def test_what_is_printed_can_be_typed_again(a: Node) -> None:
    assert eval(repr(a), {name: get(name) for name in names()}) == a


@pytest.mark.parametrize("name", stamped(EXAMPLES))
def test_every_example_can_be_typed_again(name: str) -> None:
    assert eval(repr(EXAMPLES[name]), {name: get(name) for name in names()}) == EXAMPLES[name]


def test_long_sums_are_one_element() -> None:
    balls = [sphere(0.1) + (k, 0, 0) for k in range(300)]
    assert reduce(or_, balls) == union(*balls)
    a, b, c = sphere(), box(), torus()
    assert a & b & c == a & (b & c) == intersection(a, b, c)
    assert a - b - c == difference(a, b, c)
    assert a - (b - c) == difference(a, difference(b, c))
    assert (a - b) - (a - b) == difference(a, b, difference(a, b))
    assert a.union(b, smooth=0.1) | c == union(union(a, b, smooth=0.1), c)


def test_methods_are_formulas() -> None:
    a = box()
    assert a.translate((1, 2, 3)) == a + np.array([1, 2, 3]) == transform(a, translate=(1, 2, 3))
    assert a.scale(2) == transform(a, scale=2)
    assert a.scale((1, 2, 3)) == transform(a, scale=(1, 2, 3))
    assert a.rotate(30) == a.rotate(30, (0, 0, 1)) == transform(a, rotate=(0, 0, 1, 30))
    assert a.repeat(2, 3) == get("repeat")(a, period=(2, 2, 2), count=(3, 3, 3))
    assert a.twist(30, "x") == get("twist")(a, axis="x", degrees=30)
    assert a.bend(30) == get("bend")(a, degrees=30)
    assert a.mirror("x") == get("mirror")(a, axis="x")
    assert a.offset(-0.1) == get("offset")(a, distance=-0.1)
    assert a.shell(0.1) == get("shell")(a, thickness=0.1)
    assert a.material(colour=(1, 0, 0)) == get("material")(a, colour=(1, 0, 0))
    assert a.intersection(sphere(), smooth=0.2) == intersection(a, sphere(), smooth=0.2)
    assert a.difference(sphere(), smooth=0.2) == difference(a, sphere(), smooth=0.2)


@pytest.mark.parametrize("wrong", [lambda: box() | 3, lambda: box() - (1, 2, 3), lambda: box() + sphere()])
def test_operators_refuse_what_is_no_shape(wrong) -> None:
    with pytest.raises(TypeError, match="unsupported operand"):
        wrong()


def test_numpy_leaves_operators_to_the_shape() -> None:
    with pytest.raises(TypeError, match="unsupported operand"):
        np.ones(3) - box()


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (lambda: box().rotate(30, "q"), r"<transform> rotate=\('q', 30\): expected 4 numbers"),
        (lambda: box().rotate(30, 2), r"<transform> rotate=\(2, 30\): expected 4 numbers"),
        (lambda: box() + (1, 2), r"<transform> translate=\(1, 2\): expected 3 numbers"),
        (lambda: box().shell("thick"), "<shell> thickness='thick': expected a number > 0, or an expr"),
    ],
)
def test_values_that_cannot_be_are_named(wrong, message: str) -> None:
    with pytest.raises(SceneError, match=message):
        wrong()
