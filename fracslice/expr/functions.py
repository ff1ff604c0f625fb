"""Python functions: their parameters, the names they use from outside, and their fingerprints."""

from __future__ import annotations

import builtins
from collections.abc import Callable, Hashable
from dataclasses import dataclass
from functools import lru_cache
from types import CodeType, FunctionType, ModuleType
from typing import Any

import numpy as np


def parameters(function: Callable[..., Any]) -> list[str]:
    """Return the names of a function's parameters."""
    code = function.__code__
    return list(code.co_varnames[: code.co_argcount])


def scope(function: Callable[..., Any]) -> dict[str, Any]:
    """Return the names visible to a function from outside: builtins, its module's globals and its
    closure.
    """
    assert isinstance(function, FunctionType)
    cells = zip(function.__code__.co_freevars, function.__closure__ or (), strict=True)
    return {**vars(builtins), **function.__globals__, **{name: cell.cell_contents for name, cell in cells}}


def is_number(value: Any) -> bool:
    """Return True for a number, or a tuple of numbers, that a function takes from outside."""
    if isinstance(value, tuple):
        return all(map(is_number, value))
    return isinstance(value, (int, float))


def fingerprint(function: Callable[..., Any]) -> Hashable:
    """Return a fingerprint, equal while a function's code and all values it uses from outside are the same.

    In a notebook, the values that a function's text depends on may change.
    """
    assert isinstance(function, FunctionType)
    code, names = function.__code__, outer_names(function.__code__)
    cells = zip(code.co_freevars, function.__closure__ or (), strict=True)
    around = {name: cell.cell_contents for name, cell in cells}
    return code, tuple(_mark(around.get(n, function.__globals__.get(n)), names) for n in names)


@lru_cache(maxsize=4096)
def outer_names(code: CodeType) -> tuple[str, ...]:
    """Return the names that a function uses from outside, and their attributes."""
    inner = (outer_names(c) for c in code.co_consts if isinstance(c, CodeType))
    return tuple(sorted({*code.co_names, *code.co_freevars, *(n for names in inner for n in names)}))


def _mark(value: Any, attributes: tuple[str, ...] = ()) -> Hashable:
    """Fingerprint of a value: functions by identity, numbers by type and every digit."""
    if isinstance(value, FunctionType):
        return value
    if isinstance(value, ModuleType):
        return value, tuple(_mark(vars(value).get(name)) for name in attributes)
    return type(value), repr(value) if isinstance(value, (int, float, tuple)) else None


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


WORDS = 4
"""Numbers of P that an address takes, of 16 bits each: every float holds them."""


@dataclass(frozen=True, eq=False)
class InMemory:
    """An argument that lies in memory, where native code reads it. In P stands the hash of its contents, and
    in its place, in a loaded kernel, its address.

    Attributes
    ----------
    digest : int
        64 bits of a hash of the contents.
    native : object
        Native object that owns them, with `address`, where they are, and `distances` of points [n, axes].
    """

    digest: int
    native: Any

    @property
    def address(self) -> int:
        """Where the contents are, while this object exists."""
        address: int = self.native.address
        return address

    def distances(self, *coordinates: np.ndarray) -> np.ndarray:
        """Signed distances of points, by their coordinates along each axis, arrays of one shape."""
        points = np.stack([np.asarray(a, np.float64).ravel() for a in coordinates], 1)
        return np.asarray(self.native.distances(points)).reshape(np.shape(coordinates[0]))


def words(number: int) -> tuple[float, ...]:
    """Words of a number of 64 bits, the lowest first."""
    return tuple(float(number >> 16 * k & 0xFFFF) for k in range(WORDS))


def evaluated(function: Callable[..., Any]) -> Callable[..., Any]:
    """Decorate a function that is evaluated where a step is read."""
    EVALUATED.add(function)
    return function
