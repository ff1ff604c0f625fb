"""Copies of formulas as text, kept in the cache of kernels."""

from __future__ import annotations

import linecache
from collections.abc import Callable, Hashable
from types import FunctionType, ModuleType
from typing import Any

from . import functions
from .kept_texts import kept_text

Texts = tuple[str, str, list[str]]
"""Name and text of a copy, and the names of the functions that it calls."""


def kept(function: Callable[..., Any], made_of: tuple[object, ...], make: Callable[[], Texts]) -> Texts:
    """Return the texts of a copy: cached, or made and cached.

    A file that other users could have written is not used. A function without a source is not cached.

    Parameters
    ----------
    function
        Formula.
    made_of
        Everything else that the copy depends on, as for `keys.key`.
    make
        Makes the texts.

    Returns
    -------
    tuple
        The texts.
    """
    code = function.__code__
    linecache.checkcache(code.co_filename)
    lines = "".join(linecache.getlines(code.co_filename, function.__globals__))
    if not lines:
        return make()
    outside = _stable(functions.fingerprint(function))
    place = lines, code.co_firstlineno, function.__qualname__, outside

    def written() -> str:
        copy, text, calls = make()
        return f"{copy}\n{' '.join(calls)}\n{text}"

    name, calls, text = kept_text("copies", (*place, *made_of), written).split("\n", 2)
    return name, text, calls.split()


def _stable(mark: Hashable) -> str:
    """Fingerprint that is the same in every process. The code itself is in the source."""
    if isinstance(mark, tuple):
        return f"({', '.join(map(_stable, mark))})"
    if isinstance(mark, (FunctionType, type)):
        return f"{mark.__module__}.{mark.__qualname__}"
    if isinstance(mark, ModuleType):
        return mark.__name__
    return mark if isinstance(mark, str) else ""
