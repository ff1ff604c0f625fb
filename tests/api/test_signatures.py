"""How formulas look to Python, editors and type checkers."""

from __future__ import annotations

import inspect
import pydoc
from pathlib import Path
from types import ModuleType

import pytest

import fracslice
from fracslice import capsule, formulas, sphere, torus
from fracslice.common.parameters import REQUIRED, python_name
from fracslice.errors import SceneError
from fracslice.formulas import get, names
from fracslice.scene.manual import package_stub, stub
from tests.examples import EXAMPLES, OF_FILES

SHIPPED = [name for name in names() if get(name).function.__module__.startswith("fracslice.")]


@pytest.mark.parametrize(
    ("package", "text"), [(formulas, stub()), (fracslice, package_stub(fracslice._WHERE))]
)
def test_the_stub_files_are_up_to_date(package: ModuleType, text: str) -> None:
    made = Path(str(package.__file__)).with_suffix(".pyi").read_text(encoding="utf-8")
    assert made == text, "run `python docs/generate.py`"


def test_every_formula_is_a_public_name() -> None:
    public = set(SHIPPED) - {"volume", "sweep"}  # a package, and a call of Python, too
    assert {n for n in fracslice.__all__ if n in names()} - {"sweep"} == public
    assert all(getattr(fracslice, name) is get(name) for name in public)


@pytest.mark.parametrize("name", SHIPPED)
def test_the_signature_is_the_registrys(name: str) -> None:
    formula, signature = get(name), inspect.signature(get(name))
    elements = [] if formula.kind == "shape" and name != "orbit" else ["elements"]
    assert {*signature.parameters} == {*elements, *map(python_name, formula.parameters)}
    for parameter, kind in formula.parameters.items():
        result = signature.parameters[python_name(parameter)]
        assert result.default == (inspect.Parameter.empty if kind.default is REQUIRED else kind.default)
        assert result.kind is (result.KEYWORD_ONLY if elements else result.POSITIONAL_OR_KEYWORD)
        assert kind.doc in formula.__doc__
    assert signature.return_annotation is formulas.Node
    assert formula.doc.splitlines()[0] in pydoc.render_doc(formula)


@pytest.mark.parametrize("name", [n for n in SHIPPED if get(n).kind == "shape" and n != "orbit"])
def test_positions_fill_parameters_in_the_order_of_the_signature(name: str) -> None:
    required = [kind for kind in get(name).parameters.values() if kind.default is REQUIRED]
    given = list(EXAMPLES[name].values.values())[: len(required)] if name in OF_FILES else []
    bound = inspect.signature(get(name)).bind(*given)
    bound.apply_defaults()
    assert get(name)(*bound.args) == get(name)(*given)
    named = dict(list(bound.arguments.items())[: max(1, len(given))])
    assert get(name)(*named.values()) == get(name)(**named)


def test_a_shape_takes_its_values_by_position_or_name() -> None:
    assert sphere(0.5) == sphere(radius=0.5)
    assert torus(1, 0.1) == torus(1, tube=0.1)
    assert capsule((0, 0, 0), to=(1, 0, 0)) == capsule(**{"from": (0, 0, 0), "to": (1, 0, 0)})


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        (lambda: sphere(1, 2), "<sphere> has 2 values: expected at most 1: radius"),
        (lambda: sphere(1, radius=2), "<sphere> has two values of radius: expected one"),
        (lambda: sphere(raduis=2), r"<sphere> has no attribute 'raduis'; did you mean radius\?"),
        (lambda: capsule(form=(0, 0, 0)), r"did you mean from_\?"),
        (lambda: sphere(sphere()), r"<sphere> radius=sphere\(\): expected a number > 0"),
    ],
)
def test_calls_that_cannot_be_are_one_line(wrong, message: str) -> None:
    with pytest.raises(SceneError, match=message):
        wrong()
