"""Functions of NumPy arrays that take intervals, too."""

from __future__ import annotations

from collections.abc import Callable
from types import FunctionType
from typing import Any

import numpy as np

from ..formulas import vocabulary
from .interval_numbers import ARRAYS
from .intervals import Interval, Possible


def on_cells(name: str) -> Callable[..., Any]:
    """Return a function of the vocabulary for NumPy that takes intervals, too.

    Returns
    -------
    callable
        Function of intervals, conditions on cells and numbers.
    """
    plain = getattr(vocabulary, name)

    def function(first: Any, *others: Any) -> Any:
        if name == "any_of" and isinstance(first, Possible):
            return bool(first.may.any())
        given = (first, *others)
        if not any(isinstance(v, (Interval, Possible)) for v in given):
            return plain(*given)
        if name == "where":
            yes, no = map(_on_arrays, others)
            return (first if isinstance(first, Possible) else Possible(first, first)).where(yes, no)
        return getattr(_on_arrays(first), name)(*others)

    return function


def _on_arrays(value: Any) -> Interval:
    """Interval of numbers; an interval unchanged."""
    return value if isinstance(value, Interval) else Interval.at(np.asarray(value, np.float64), ARRAYS)


def on_intervals(function: Callable[..., Any]) -> Callable[..., Any]:
    """Return a function in the language of formulas that takes intervals.

    Parameters
    ----------
    function
        Function that uses the vocabulary and nothing else from outside.

    Returns
    -------
    callable
        The same code with functions of intervals.
    """
    assert isinstance(function, FunctionType)
    names = vocabulary.NAMES | vocabulary.OF_CELLS
    return FunctionType(function.__code__, {name: on_cells(name) for name in names})
