"""What is registered of the formulas that fracslice has."""

from __future__ import annotations

from fracslice import formulas


def test_tracebacks_name_the_formula_and_the_hook() -> None:
    """Hooks that formulas share are named for what these have in common."""
    hooks = [
        (function.__name__, name)
        for formula in map(formulas.get, formulas.names())
        for name, function in formula.hooks.items()
        if function.__module__.startswith("fracslice.")
    ]
    assert len(hooks) > 50
    assert not [found for found, name in hooks if not found.strip("_").endswith(f"_{name}")]
