"""Intrinsics of loops, besides those of formulas: lanes, memory and the scene's field.

Here they are implemented on NumPy arrays, so that a loop also runs as plain Python: lanes are a slice, and P
is the field itself, a function of ``x, y, z``. The compiler implements the same names in machine code.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np

from .interval_numbers import ARRAYS
from .intervals import Interval

Function = TypeVar("Function", bound=Callable[..., Any])

WIDTH = sys.maxsize
"""Number of lanes; in Python all elements of an array."""

_INTRINSICS: set[Callable[..., Any]] = set()


def intrinsic(function: Function) -> Function:
    """Decorate a function that the compiler or the linked scene provides under the same name.

    Parameters
    ----------
    function
        NumPy implementation.

    Returns
    -------
    Callable
        The function itself.
    """
    _INTRINSICS.add(function)
    return function


def is_intrinsic(value: Any) -> bool:
    """Return True if a value is an intrinsic, which loops may call."""
    return callable(value) and value in _INTRINSICS


@intrinsic
def load(array: np.ndarray, i: int) -> Any:
    """Load lanes.

    Parameters
    ----------
    array
        Array, [n].
    i
        First element.

    Returns
    -------
    Any
        Copy of the elements from i on, at most WIDTH.
    """
    return array[i : i + WIDTH].copy()


@intrinsic
def store(array: np.ndarray, i: int, lanes: Any) -> None:
    """Store lanes.

    Parameters
    ----------
    array
        Array to modify, [n].
    i
        First element.
    lanes
        Values, WIDTH of them.
    """
    array[i : i + WIDTH] = lanes


@intrinsic
def around(centre: Any, half: float) -> Interval:
    """Interval around a centre.

    Parameters
    ----------
    centre
        Lanes.
    half
        Half its size.

    Returns
    -------
    Interval
        Interval that encloses all numbers that are not farther from the centre.
    """
    return Interval(centre - half, centre + half, ARRAYS).outward()


@intrinsic
def lower(interval: Interval) -> Any:
    """Lower bound of an interval.

    Returns
    -------
    Any
        Lanes.
    """
    return interval.lo


@intrinsic
def upper(interval: Interval) -> Any:
    """Upper bound of an interval.

    Returns
    -------
    Any
        Lanes.
    """
    return interval.hi


@intrinsic
def gather(i: Any, P: np.ndarray) -> Any:
    """Load an element of P for each lane.

    Parameters
    ----------
    i
        Whole, possible indices, as reals.
    P
        Parameters of the scene.
    """
    return P[np.asarray(i).astype(np.intp)]


@intrinsic
def field(x: Any, y: Any, z: Any, P: Any) -> Any:
    """Evaluate the scene's signed field.

    Parameters
    ----------
    x, y, z
        Coordinates, scene units.
    P
        Parameters of the scene; in Python the field itself.
    """
    return P(x, y, z)
