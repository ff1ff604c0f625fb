"""Evaluations and instructions stay within `budgets.json`; `python -m tests.budgets --record` writes it."""

from __future__ import annotations

import platform
from dataclasses import replace

import pytest

from fracslice.fields.linker import link
from fracslice.formulas import sphere, union

from .evaluations import evaluations, per_sample
from .instructions import assembly, instructions, sizes
from .ledger import budgets, exceeded

pytestmark = pytest.mark.once

X86 = platform.machine() in ("x86_64", "AMD64")


def test_evaluations() -> None:
    result = evaluations()
    assert exceeded(result, budgets()) == []
    assert set(result) == {name for name in budgets() if "instructions" not in name}


@pytest.mark.skipif(not X86, reason="the code is compiled for x86-64")
def test_instructions() -> None:
    result = instructions()
    assert exceeded(result, budgets()) == []
    assert set(result) == {name for name in budgets() if "instructions" in name}


def test_more_than_a_budget_is_reported() -> None:
    allowed = {"a": 2.0, "b": 100}
    assert exceeded({"a": 2.05, "b": 103}, allowed) == []
    assert exceeded({"a": 2.1, "b": 104, "c": 1}, allowed) == [
        "a: 2.1, budget 2",
        "b: 104, budget 100",
        "c: 1, budget 0",
    ]
    assert exceeded({"a": float("nan")}, allowed)


def test_counts_grow_with_what_is_counted() -> None:
    """A bound twice as wide as it need be, as a careless change would make it."""
    wider = sphere(radius=1.0)
    wider.__dict__["bounds"] = replace(wider.bounds, lipschitz=2.0)
    assert per_sample(wider) > 1.05 * per_sample(sphere())


@pytest.mark.skipif(not X86, reason="the code is compiled for x86-64")
def test_instructions_are_counted_in_the_innermost_loop() -> None:
    text = ["f:", "\tmov", "A:", "\tadd", "B:", "\tmul", "\tmul", "\tjne\t.B", "\tjne\t.A", "\tret"]
    assert sizes([line.replace("A:", ".A:").replace("B:", ".B:") for line in text]) == (3, 7)
    once, twice = (
        sizes(assembly(link(root), 32))[1] for root in (sphere(), union(sphere(), sphere(radius=2)))
    )
    assert twice > once + 4
