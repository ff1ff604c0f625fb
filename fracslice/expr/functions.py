"""Python functions: their parameters, the names they use from outside, and their fingerprints."""

from __future__ import annotations

import builtins
import linecache
from collections.abc import Callable, Hashable
from dataclasses import dataclass, is_dataclass
from enum import Enum
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
    if is_dataclass(value) and not isinstance(value, type):
        return value  # type: ignore[return-value]
    return type(value), repr(value) if isinstance(value, (int, float, tuple)) else None


def identity(*values: Any) -> str:
    """Describe functions, the functions that they call, and all values that these use from outside."""
    described = _Described()
    for value in values:
        described.add(value)
    described.add_records()
    return "\n".join(described.lines)


class _Described:
    """Lines on values and on everything that they refer to, each once."""

    def __init__(self) -> None:
        self.lines: list[str] = []
        self.seen: dict[tuple[int, tuple[str, ...]], Any] = {}
        self.names = set[str]()  # names that the functions use
        self.records: list[Any] = []  # those whose attributes of these names are used

    def add(self, value: Any, names: tuple[str, ...] = ()) -> None:
        """Add a value; of a module or a class the attributes with some names."""
        if value is None or isinstance(value, (bool, int, float, str, Enum)):
            self.lines.append(repr(value))
            return
        self.lines.append(_label(value))
        if isinstance(value, FunctionType):
            names = outer_names(value.__code__)
        if (id(value), names) in self.seen:
            return
        self.seen[id(value), names] = value
        if isinstance(value, FunctionType):
            outside = scope(value)
            self.names.update(names)
            self.lines += _source(value.__code__)
            self.add_named({name: outside[name] for name in names if name in outside}, names)
        elif type(value) is tuple:
            for item in value:
                self.add(item, names)
        elif isinstance(value, (ModuleType, type)):
            self.add_named({name: getattr(value, name) for name in names if hasattr(value, name)}, names)
        elif isinstance(value, tuple) or is_dataclass(value):
            self.records.append(value)

    def add_named(self, values: dict[str, Any], names: tuple[str, ...]) -> None:
        """Add values with their names."""
        for name, value in values.items():
            self.lines.append(name)
            self.add(value, names)

    def add_records(self) -> None:
        """Add the attributes of records that functions use, now that all functions are known."""
        known = None
        while known != len(self.names):  # attributes may be functions
            known, names = len(self.names), tuple(sorted(self.names))
            for record in self.records:
                self.lines.append(_label(record))
                self.add_named(
                    {name: getattr(record, name) for name in names if hasattr(record, name)}, names
                )


def _label(value: Any) -> str:
    """Kind and name of a value, without its address."""
    name = getattr(value, "__qualname__", getattr(value, "__name__", ""))
    return f"{type(value).__qualname__} {getattr(value, '__module__', '')}.{name}"


def _source(code: CodeType) -> list[str]:
    """Lines of a function; its instructions if it has none."""
    linecache.checkcache(code.co_filename)
    lines, first = linecache.getlines(code.co_filename), code.co_firstlineno
    if not lines:
        return [code.co_code.hex(), repr(code.co_consts), repr(code.co_names), repr(code.co_varnames)]
    return [line.rstrip() for line in lines[first - 1 : _last_line(code)]]


def _last_line(code: CodeType) -> int:
    """Last line of a function with an instruction."""
    inner = [_last_line(c) for c in code.co_consts if isinstance(c, CodeType)]
    return max([code.co_firstlineno, *(line for *_, line in code.co_lines() if line), *inner])


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


@dataclass(frozen=True)
class OfPoint:
    """An argument that differs from point to point.

    Attributes
    ----------
    function : callable
        Function of x, y and z in the language of formulas.
    """

    function: Callable[..., Any]


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
