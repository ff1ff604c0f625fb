"""The program of a scene follows its formulas as they are now, though most of it was read before."""

from __future__ import annotations

import importlib
import linecache
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import pytest

from fracslice.expr import frontend
from fracslice.expr.graph import text
from fracslice.fields.linker import FIELD, link
from fracslice.fields.registry import Formula
from fracslice.formulas import Node, sphere

SOURCE = """
import constants
from fracslice.expr.vocabulary import sqrt
SCALE = 2.0

def helper(r):
    return r * SCALE

def shape(x, y, z, radius):
    return helper(sqrt(x * x + y * y + z * z)) - radius * constants.SCALE
"""


@pytest.fixture
def cell(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[ModuleType]:
    """A module that is edited, as the cell of a notebook."""
    monkeypatch.syspath_prepend(str(tmp_path))
    (tmp_path / "constants.py").write_text("SCALE = 3.0\n")
    (tmp_path / "cell.py").write_text(SOURCE)
    yield importlib.import_module("cell")
    for name in ("cell", "constants"):
        del sys.modules[name]


def linked(function: object) -> str:
    formula = Formula("cell", "shape", function, sphere.parameters, hooks=dict(sphere.hooks))
    program = link(formula(radius=0.5)).program
    return f"{program.identity}\n{text(program.functions[FIELD])}"


def test_a_number_that_a_formula_takes_from_its_module(cell: ModuleType) -> None:
    assert "mul r, 2.0" in linked(cell.shape)
    cell.SCALE = 2
    assert "mul r, 2\n" in linked(cell.shape)
    cell.SCALE = 5.0
    assert "mul r, 5.0" in linked(cell.shape)
    before = linked(cell.shape)
    cell.constants.SCALE = 7.0
    assert "mul radius, 7.0" in linked(cell.shape) and linked(cell.shape)[:32] != before[:32]


def test_a_function_that_a_formula_calls(cell: ModuleType) -> None:
    before = linked(cell.shape)
    assert "mul r, 2.0" in before
    cell.helper = one_more
    assert "add r, 1.0" in linked(cell.shape) and linked(cell.shape)[:32] != before[:32]


def one_more(r):  # type: ignore[no-untyped-def]
    return r + 1.0


def test_code_that_is_exchanged_in_its_function(cell: ModuleType, tmp_path: Path) -> None:
    """As a notebook does that loads modules again."""
    function = cell.shape
    before = linked(function)
    assert "= sub" in before
    (tmp_path / "cell.py").write_text(SOURCE.replace("- radius", "+ radius") + "\n")
    linecache.checkcache()
    again = importlib.reload(cell)
    function.__code__ = again.shape.__code__
    assert "= sub" not in linked(function) and linked(function)[:32] != before[:32]


@pytest.mark.parametrize("values", [(1, 1.0), (1.0, 1), (0.0, -0.0)])
def test_fixed_numbers_that_are_equal_and_not_the_same(values: tuple[float, float]) -> None:
    made = [frontend.formula(sphere.function, (("radius", v),)) for v in values]
    assert made[0].identity != made[1].identity and text(made[0]) != text(made[1])


def test_a_scene_that_did_not_change_is_not_read_again(monkeypatch: pytest.MonkeyPatch) -> None:
    root: Node = sphere()
    program = link(root).program
    text(program.functions[FIELD])
    monkeypatch.setattr(frontend, "syntax", None)
    assert link(root).program == program
    text(program.functions[FIELD])


def test_a_program_is_the_same_in_every_process() -> None:
    code = (
        "from fracslice.formulas import mandelbulb, menger, union; from fracslice.fields.linker import link; "
        "print(link(union(mandelbulb(iterations=4), menger(level=2), smooth=0.1)).program.identity)"
    )
    one, other = (
        subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
        for _ in range(2)
    )
    assert one == other and len(one.strip()) == 32
