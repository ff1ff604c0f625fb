"""Descriptions of functions that are the same in every process: keys of the code made from them."""

from __future__ import annotations

from dataclasses import is_dataclass
from enum import Enum
from types import CodeType, FunctionType, ModuleType
from typing import Any

from . import functions


def identity(*values: Any) -> str:
    """Describe functions, the functions that they call, and all values that these use from outside.

    Parameters
    ----------
    *values
        Functions, and their arguments: numbers, functions, and records of both.

    Returns
    -------
    str
        Equal for functions of the same bytecode that use the same values.
    """
    described = _Described()
    for value in sorted(values, key=lambda value: not isinstance(value, FunctionType)):
        described.add(value, tuple(sorted(described.names)))
    return "\n".join(described.lines)


class _Described:
    """Lines on values and on everything that they refer to, each once."""

    def __init__(self) -> None:
        self.lines: list[str] = []
        self.seen: dict[tuple[int, tuple[str, ...]], Any] = {}
        self.names = set[str]()
        """Names that the functions so far use: their arguments are used by these."""

    def add(self, value: Any, names: tuple[str, ...]) -> None:
        """Add a value; of a module, class or record the attributes with some names."""
        if value is None or isinstance(value, (bool, int, float, str, Enum)):
            self.lines.append(repr(value))
            return
        self.lines.append(_label(value))
        if isinstance(value, FunctionType):
            names = functions.outer_names(value.__code__)
        if (id(value), names) in self.seen:
            return
        self.seen[id(value), names] = value
        if isinstance(value, FunctionType):
            self.names.update(names)
            self.lines += _bytecode(value.__code__)
            outside = functions.scope(value)
            self.named({name: outside[name] for name in names if name in outside}, names)
        elif type(value) is tuple:
            for item in value:
                self.add(item, names)
        elif isinstance(value, (ModuleType, type, tuple)) or is_dataclass(value):
            self.named({name: getattr(value, name) for name in names if hasattr(value, name)}, names)

    def named(self, values: dict[str, Any], names: tuple[str, ...]) -> None:
        """Add values with their names."""
        for name, value in values.items():
            self.lines.append(name)
            self.add(value, names)


def _label(value: Any) -> str:
    """Kind and name of a value, without its address."""
    name = getattr(value, "__qualname__", getattr(value, "__name__", ""))
    return f"{type(value).__qualname__} {getattr(value, '__module__', '')}.{name}"


def _bytecode(code: CodeType) -> list[str]:
    """Instructions and constants of a function, and of those inside it."""
    own = [repr(c) for c in code.co_consts if not isinstance(c, CodeType)]
    inner = [line for c in code.co_consts if isinstance(c, CodeType) for line in _bytecode(c)]
    return [code.co_code.hex(), repr(code.co_varnames), repr(code.co_names), *own, *inner]
