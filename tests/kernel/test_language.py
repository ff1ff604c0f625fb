"""What a formula may say: Python's own words, those of the vocabulary, and one line for all the rest."""

from __future__ import annotations

import sys
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from fracslice.errors import FracsliceError, SceneError
from fracslice.fields.cpu import compile_scene
from fracslice.fields.devices import reference
from fracslice.fields.node import FORMULAS
from tests.kernel.idioms import HEAD, SAME, P, X, Y, Z, imported


@pytest.fixture
def module(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):  # type: ignore[no-untyped-def]
    """Runs a text as a file of its own; its formulas are forgotten afterwards."""
    known = dict(FORMULAS)

    def run(text: str, name: str = "own_formulas") -> ModuleType:
        monkeypatch.setitem(sys.modules, name, None)
        return imported(text, tmp_path, name)

    yield run
    FORMULAS.clear()
    FORMULAS.update(known)


@pytest.mark.parametrize("body", SAME)
def test_pythons_own_words_are_those_of_the_vocabulary(module, body: str) -> None:  # type: ignore[no-untyped-def]
    root = module(HEAD + "    " + body).mine(radius=0.7)
    np.testing.assert_allclose(reference(root)(*P), SAME[body], rtol=1e-13, atol=1e-13)
    np.testing.assert_allclose(compile_scene(root, "float64").points(*P), SAME[body], rtol=1e-12, atol=1e-12)


REFUSED = {
    "return sqr(x) - radius": "11: formula mine: 'sqr' is not in the language .*did you mean sqrt?",
    "return np.arcsinh(x)": "11: formula mine: 'np.arcsinh' is not in the language",
    "for s in x:\n        y = s\n    return y": "11: formula mine: 'for s in x: y = s' .*a range or a tuple",
    "for s in (1.0, 2.0):\n        break\n    return x": "12: formula mine: 'break' .*a loop over a range",
    "return not (x > y)": "11: .*expected ~",
    "q = x\n    if q > 0:\n        q = y\n    return q": "12: formula mine: if 'q > 0' may differ.*where",
    "return x if x > y else y": "11: formula mine: if 'x > y' may differ",
    "return x if 0 < radius and y < z else y": "11: .*expected where",
    "while radius:\n        x = y\n    return x": "11: .*not in the language",
    "return [x][0]": "11: .*not in the language",
    "return x ** radius": "11: .*whole exponent",
    "return x.sum()": "11: .*'x.sum' is not in the language",
    "return (lambda a: a)(x)": "11: .*not in the language",
    "return 'radius'": "11: .*not in the language",
    "return max(a=x, b=y)": "11: .*by their place",
}


@pytest.mark.parametrize("body", REFUSED)
def test_what_is_outside_the_language_is_one_line_with_its_place(module, body: str) -> None:  # type: ignore[no-untyped-def]
    root = module(HEAD + "\n    " + body).mine()
    with pytest.raises(FracsliceError, match=r"own_formulas.py:" + REFUSED[body]) as caught:
        reference(root)(*P)
    assert "\n" not in str(caught.value)


HELPERS = """\
from fracslice.formulas import shape
FAR = {far}
def norm(x, y):
    return x {op} y * FAR
@shape()
def {name}(x, y, z):
    return norm(x, y)
"""


def test_helpers_of_one_name_in_two_files_are_two(module) -> None:  # type: ignore[no-untyped-def]
    from fracslice.formulas import union

    one = module(HELPERS.format(far=2.0, op="+", name="one"), "first").one()
    other = module(HELPERS.format(far=3.0, op="-", name="other"), "second").other()
    for root in (union(one, other), union(other, one)):
        expected = np.minimum(X + 2 * Y, X - 3 * Y)
        np.testing.assert_allclose(reference(root)(*P), expected, rtol=1e-13)
        np.testing.assert_allclose(compile_scene(root, "float64").points(*P), expected, atol=1e-13)


def test_a_helper_may_be_called_as_a_loop_is(module) -> None:  # type: ignore[no-untyped-def]
    text = HELPERS.format(far=2.0, op="+", name="plain").replace("norm", "points")
    root = module(text).plain()
    np.testing.assert_allclose(compile_scene(root, "float64").points(*P), X + 2 * Y, atol=1e-13)


SWAPPED = """\
from fracslice.formulas import Number, shape
@shape(near=Number(1.0, ""), far=Number(2.0, ""))
def slab(x, y, z, far, near):
    return x * far + y * near
@slab.arguments
def slab_arguments(node):
    return {arguments}
"""


def test_arguments_are_bound_by_name(module) -> None:  # type: ignore[no-untyped-def]
    root = module(SWAPPED.format(arguments='{"near": node["near"], "far": node["far"]}')).slab(near=5, far=7)
    np.testing.assert_allclose(reference(root)(*P), 7 * X + 5 * Y, rtol=1e-13)


def test_an_argument_that_is_not_given_is_named(module) -> None:  # type: ignore[no-untyped-def]
    root = module(SWAPPED.format(arguments='{"near": 1.0}')).slab()
    with pytest.raises(FracsliceError, match=r"py:2: formula slab: .* to take near .*, found far, near"):
        reference(root)(*P)


def test_one_name_is_one_formula(module) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(SceneError, match=r"own_formulas.py:8: formula 'sphere': expected another name"):
        module(HEAD.replace("mine", "sphere") + "    return x")


def test_numbers_around_a_formula_are_part_of_it(module) -> None:  # type: ignore[no-untyped-def]
    text = (
        "from fracslice.formulas import shape\n"
        "def made(k, ends):\n"
        "    def inner(x, y, z):\n"
        "        low, high = ends\n"
        "        return k * x + low * y - high * z\n"
        "    inner.__name__ = f'inner{k}'\n"
        "    return shape()(inner)\n"
        "two, three = made(2, (1.0, 4.0)), made(3, (0.0, 1.0))\n"
    )
    own = module(text)
    np.testing.assert_allclose(reference(own.two())(*P), 2 * X + Y - 4 * Z, rtol=1e-12)
    np.testing.assert_allclose(reference(own.three())(*P), 3 * X - Z, rtol=1e-12)
