"""The intrinsics of loops, beside the vocabulary of formulas: lanes, memory and the scene's field.

Here they mean NumPy arrays, so that a loop runs as the Python that it is: lanes are a slice, and P is the
field itself, a function of ``x, y, z``. The compiler gives the same names their meaning in machine code.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np

Function = TypeVar("Function", bound=Callable[..., Any])

WIDTH = sys.maxsize
"""Lanes at once; in Python all elements of an array."""

_INTRINSICS: set[Callable[..., Any]] = set()


def intrinsic(function: Function) -> Function:
    """Decorates a function that the compiler or the linked scene provides under the same name."""
    _INTRINSICS.add(function)
    return function


def is_intrinsic(value: Any) -> bool:
    """Whether loops may call a function that is linked from elsewhere."""
    return callable(value) and value in _INTRINSICS


@intrinsic
def load(array: np.ndarray, i: int) -> Any:
    """The lanes from element i on."""
    return array[i : i + WIDTH].copy()


@intrinsic
def store(array: np.ndarray, i: int, lanes: Any) -> None:
    """Writes lanes from element i on."""
    array[i : i + WIDTH] = lanes


@intrinsic
def field(x: Any, y: Any, z: Any, P: Any) -> Any:
    """The scene's signed field."""
    return P(x, y, z)
