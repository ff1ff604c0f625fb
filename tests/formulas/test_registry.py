"""What is registered of the formulas that fracslice has."""

from __future__ import annotations

import pickle

import pytest

from fracslice import formulas
from tests.examples import EXAMPLES


def test_tracebacks_name_the_formula_and_the_hook() -> None:
    """Hooks that formulas share are named for what these have in common."""
    hooks = [
        (function.__name__, name)
        for formula in map(formulas.get, formulas.names())
        for name, function in formula.hooks.items()
        if function.__module__.startswith("fracslice.")
    ]
    assert len(hooks) > 50
    assert not [result for result, name in hooks if not result.strip("_").endswith(f"_{name}")]


@pytest.mark.parametrize("name", EXAMPLES)
def test_nodes_pickle(name: str) -> None:
    """Jobs go to other processes as they are."""
    node = EXAMPLES[name].conservative()
    again = pickle.loads(pickle.dumps(node))
    assert again == node and again.place == node.place and again.bounds == node.bounds
    assert again.formula is node.formula and again.is_conservative == node.is_conservative


def test_every_formula_is_among_the_pickled() -> None:
    assert {node.formula.name for root in EXAMPLES.values() for node in root.walk()} == set(formulas.names())
