"""The text of a scene follows its formulas as they are now, though most of it was written before."""

from __future__ import annotations

import importlib
import linecache
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import pytest

from fracslice.fields import source
from fracslice.fields.linker import link
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
    return link(formula(radius=0.5)).source


def test_a_number_that_a_formula_takes_from_its_module(cell: ModuleType) -> None:
    assert "r * 2.0" in linked(cell.shape)
    cell.SCALE = 2
    assert "r * 2\n" in linked(cell.shape)
    cell.SCALE = 5.0
    assert "r * 5.0" in linked(cell.shape)
    cell.constants.SCALE = 7.0
    assert "* 7.0" in linked(cell.shape)


def test_a_function_that_a_formula_calls(cell: ModuleType) -> None:
    assert "r * 2.0" in linked(cell.shape)
    cell.helper = one_more
    assert "r + 1.0" in linked(cell.shape)


def one_more(r):  # type: ignore[no-untyped-def]
    return r + 1.0


def test_code_that_is_exchanged_in_its_function(cell: ModuleType, tmp_path: Path) -> None:
    """As a notebook does that loads modules again."""
    before = cell.shape
    assert "- radius" in linked(before)
    (tmp_path / "cell.py").write_text(SOURCE.replace("- radius", "+ radius") + "\n")
    linecache.checkcache()
    again = importlib.reload(cell)
    before.__code__ = again.shape.__code__
    assert "+ radius" in linked(before)


@pytest.mark.parametrize("values", [(1, 1.0), (1.0, 1), (0.0, -0.0)])
def test_fixed_numbers_that_are_equal_and_not_the_same(values: tuple[float, float]) -> None:
    texts = [source.shared_copy(sphere.function, (("radius", v),), frozenset()).text for v in values]
    assert [repr(v) in text for v, text in zip(values, texts, strict=True)] == [True, True]
    assert texts[0] != texts[1]


def test_a_scene_that_did_not_change_is_not_written_again() -> None:
    root: Node = sphere()
    link(root)
    before = source._cached_shared_copy.cache_info()
    link(root)
    after = source._cached_shared_copy.cache_info()
    assert after.misses == before.misses and after.hits > before.hits
