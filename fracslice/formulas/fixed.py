"""Arguments that are compiled into kernels."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

EVALUATED: set[Callable[..., Any]] = set()
"""Functions of numbers that are evaluated where a step is read: their values are constants of the code."""


@dataclass(frozen=True)
class Fixed:
    """An argument that is compiled into the kernel instead of being passed to it, because the code depends on
    it.

    Attributes
    ----------
    value : object
        The constant.
    """

    value: Any


def evaluated(function: Callable[..., Any]) -> Callable[..., Any]:
    """Decorate a function that is evaluated where a step is read.

    Parameters
    ----------
    function : callable
        Function of numbers; NaN stands for one that is no constant of the code.
    """
    EVALUATED.add(function)
    return function
