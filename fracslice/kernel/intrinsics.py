"""Intrinsics of loops, besides those of formulas: lanes, memory and the scene's field.

Here they are implemented on NumPy arrays, so that a loop also runs as plain Python: lanes are a slice, and P
is the field itself, a function of ``x, y, z``. The compiler implements the same names in machine code.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np

Function = TypeVar("Function", bound=Callable[..., Any])

WIDTH = sys.maxsize
"""Number of lanes; in Python all elements of an array."""

_INTRINSICS: set[Callable[..., Any]] = set()


def intrinsic(function: Function) -> Function:
    """Decorate a function that the compiler or the linked scene provides under the same name."""
    _INTRINSICS.add(function)
    return function


def is_intrinsic(value: Any) -> bool:
    """Return True if a value is an intrinsic, which loops may call."""
    return callable(value) and value in _INTRINSICS


@intrinsic
def load(array: np.ndarray, i: int) -> Any:
    """Return the lanes that start at element i."""
    return array[i : i + WIDTH].copy()


@intrinsic
def store(array: np.ndarray, i: int, lanes: Any) -> None:
    """Write lanes, starting at element i."""
    array[i : i + WIDTH] = lanes


@intrinsic
def field(x: Any, y: Any, z: Any, P: Any) -> Any:
    """Evaluate the scene's signed field."""
    return P(x, y, z)
