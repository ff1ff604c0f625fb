"""What is allowed, what there is, and which of it is too much."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path

from .evaluations import evaluations
from .instructions import instructions

PATH = Path(__file__).with_name("budgets.json")
TOLERANCE = 0.03
"""What a count may grow by: a compiler's whim, not a change of method."""


def budgets() -> dict[str, float]:
    """The recorded counts."""
    result: dict[str, float] = json.loads(PATH.read_text())
    return result


def counts() -> dict[str, float]:
    """The counts of the code as it is."""
    return {**evaluations(), **instructions()}


def exceeded(result: Mapping[str, float], allowed: Mapping[str, float]) -> list[str]:
    """A line for every count that is more than its budget and the tolerance, or has no budget."""
    return [
        f"{name}: {count:g}, budget {allowed.get(name, 0):g}"
        for name, count in result.items()
        if not count <= allowed.get(name, 0) * (1 + TOLERANCE)
    ]
