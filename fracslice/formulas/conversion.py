"""Conversion of numbers, and of values of any kind, from and to text."""

from __future__ import annotations

import math
from collections.abc import Sequence
from numbers import Real
from typing import Any


def shown(value: Any) -> str:
    """Representation of any value on one line of at most 60 characters."""
    try:
        line = " ".join(repr(value).split())
    except ValueError:  # a whole number with more digits than Python prints
        line = f"a huge {type(value).__name__}"
    return line if len(line) <= 60 else line[:57] + "..."


def printable(text: str) -> str:
    """Text with "?" for what cannot be printed, such as a byte of a file's name that is not UTF-8."""
    return "".join(c if c.isprintable() else "?" for c in text)


def finite(value: Any) -> float | None:
    """Convert a real number to a float.

    Parameters
    ----------
    value : object
        Any value; NumPy scalars count as numbers, booleans do not.

    Returns
    -------
    float or None
        None if the value is not a real number, or not finite.
    """
    if isinstance(value, bool) or not isinstance(value, Real):
        return None
    try:
        number = float(value)
    except OverflowError:
        return None
    return number if math.isfinite(number) else None


def items(value: Any) -> Sequence[Any]:
    """Items of a sequence or an array; any other value is one item."""
    value = value.tolist() if hasattr(value, "tolist") else value
    return value if isinstance(value, Sequence) and not isinstance(value, (str, bytes)) else (value,)


def plain(text: str) -> str:
    """Reject numbers in Python's extended syntax: underscores and non-ASCII digits."""
    if "_" in text or not text.isascii():
        raise ValueError
    return text


def shortest(value: Any) -> str:
    """Shortest text of a number that reads back as the same."""
    return repr(int(value)) if float(value).is_integer() and abs(value) < 1e15 else repr(float(value))
