"""Kinds of formula parameters: parsing, validation, writing and description.

Each kind parses text from a scene file (`read`), validates a value (`check`, which raises a `ValueError` that
says what is expected) and writes it back (`text`). The schema and the documentation are made from the same
objects; `validate` applies them to the fields of a record.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from numbers import Integral, Real
from typing import Any

REQUIRED: Any = ...
AUTO = "auto"

SMALLEST, LARGEST = 1e-15, 1e9
"""Range of magnitudes whose squares and products float32 kernels can represent."""


@dataclass(frozen=True)
class Number:
    """One finite number.

    Attributes
    ----------
    default : float, None or REQUIRED
        Default value.
    doc : str
        Description.
    above, below : float
        Exclusive limits.
    least, most : float
        Inclusive limits.
    """

    default: Any
    doc: str
    above: float = -math.inf
    least: float = -math.inf
    most: float = math.inf
    below: float = math.inf

    @property
    def expects(self) -> str:
        return "a number" + _range(self)

    def read(self, text: str) -> Any:
        return self.check(_number(text, self.expects))

    def check(self, value: Any) -> Any:
        return _checked(value, self)

    def text(self, value: Any) -> str:
        return _shortest(value)


@dataclass(frozen=True)
class Count:
    """A whole number.

    Attributes
    ----------
    default : int, str, None or REQUIRED
        Default value.
    doc : str
        Description.
    least, most : int
        Inclusive limits.
    auto : bool
        True if the word "auto" is allowed, too.
    """

    default: Any
    doc: str
    least: int = 0
    most: int = 10_000
    auto: bool = False

    @property
    def expects(self) -> str:
        return f"a whole number from {self.least} to {self.most}" + (' or "auto"' if self.auto else "")

    def read(self, text: str) -> Any:
        text = text.strip()
        if self.auto and text == AUTO:
            return AUTO
        try:
            return self.check(int(_plain(text)))
        except ValueError:
            raise ValueError(self.expects) from None

    def check(self, value: Any) -> Any:
        if self.auto and isinstance(value, str) and value == AUTO:
            return AUTO
        whole = isinstance(value, Integral) and not isinstance(value, bool)
        if not whole or not self.least <= value <= self.most:
            raise ValueError(self.expects)
        return int(value)

    def text(self, value: Any) -> str:
        return str(value)


@dataclass(frozen=True)
class Vector:
    """Several finite numbers, separated by spaces.

    Attributes
    ----------
    default : tuple of float, None or REQUIRED
        Default value.
    doc : str
        Description.
    sizes : tuple of int
        Allowed lengths.
    above, below : float
        Exclusive limits of each number.
    least, most : float
        Inclusive limits of each number.
    nonzero : bool
        True if the numbers must not all be zero.
    whole : bool
        True if the numbers must be whole.
    """

    default: Any
    doc: str
    sizes: tuple[int, ...] = (3,)
    above: float = -math.inf
    least: float = -math.inf
    most: float = math.inf
    below: float = math.inf
    nonzero: bool = False
    whole: bool = False

    @property
    def expects(self) -> str:
        kind = "whole numbers" if self.whole else "numbers"
        nonzero = ", not all zero" if self.nonzero else ""
        return f"{' or '.join(map(str, self.sizes))} {kind}{_range(self)}{nonzero}"

    def read(self, text: str) -> Any:
        return self.check(tuple(_number(word, self.expects) for word in text.split()))

    def check(self, value: Any) -> Any:
        items = _items(value)
        if len(items) not in self.sizes:
            raise ValueError(self.expects)
        numbers = tuple(_checked(item, self) for item in items)
        if self.nonzero and not any(abs(n) >= SMALLEST for n in numbers):
            raise ValueError(self.expects)
        if self.whole and any(n != int(n) for n in numbers):
            raise ValueError(self.expects)
        return tuple(int(n) for n in numbers) if self.whole else numbers

    def text(self, value: Any) -> str:
        return " ".join(map(_shortest, value))


@dataclass(frozen=True)
class Axis:
    """One of the letters x, y and z.

    Attributes
    ----------
    default : str or REQUIRED
        Default value.
    doc : str
        Description.
    expects : str
        Allowed values, in words.
    """

    default: Any
    doc: str
    expects: str = field(default='"x", "y" or "z"', init=False)

    def read(self, text: str) -> Any:
        return self.check(text.strip())

    def check(self, value: Any) -> Any:
        if not isinstance(value, str) or value not in ("x", "y", "z"):
            raise ValueError(self.expects)
        return value

    def text(self, value: Any) -> str:
        return str(value)


@dataclass(frozen=True)
class Choice:
    """One word of a list.

    Attributes
    ----------
    default : str or REQUIRED
        Default value.
    doc : str
        Description.
    words : tuple of str
        Allowed words.
    """

    default: Any
    doc: str
    words: tuple[str, ...]

    @property
    def expects(self) -> str:
        return f"{', '.join(self.words[:-1])} or {self.words[-1]}"

    def read(self, text: str) -> Any:
        return self.check(text.strip())

    def check(self, value: Any) -> Any:
        if not isinstance(value, str) or value not in self.words:
            raise ValueError(self.expects)
        return value

    def text(self, value: Any) -> str:
        return str(value)


Parameter = Number | Count | Vector | Axis | Choice


def validate(record: Any, kinds: Mapping[str, Any], fail: Callable[[str], Exception]) -> None:
    """Validate and convert fields of a frozen record in place. None is kept where it is the default.

    Parameters
    ----------
    record : dataclass
        The record.
    kinds : mapping of str to Parameter
        Kind of each field.
    fail : callable
        Makes the exception to raise from the message "name=value: expected ...".
    """
    for name, kind in kinds.items():
        value = getattr(record, name)
        if value is not None or kind.default is not None:
            object.__setattr__(record, name, validated(name, value, kind, fail))


def validated(name: str, value: Any, kind: Any, fail: Callable[[str], Exception]) -> Any:
    """Validate and convert one value.

    Parameters
    ----------
    name : str
        Name in the message.
    value : object
        The value.
    kind : Parameter
        Its kind.
    fail : callable
        Makes the exception to raise from the message "name=value: expected ...".

    Returns
    -------
    object
        The value in the kind's type.
    """
    try:
        return kind.check(value)
    except ValueError as error:
        raise fail(f"{name}={shown(value)}: expected {error}") from None


def shown(value: Any) -> str:
    """Representation of any value on one line of at most 60 characters."""
    try:
        line = " ".join(repr(value).split())
    except ValueError:  # a whole number with more digits than Python prints
        line = f"a huge {type(value).__name__}"
    return line if len(line) <= 60 else line[:57] + "..."


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


def _items(value: Any) -> Sequence[Any]:
    """Items of a sequence or an array; any other value is one item."""
    plain = value.tolist() if hasattr(value, "tolist") else value
    return plain if isinstance(plain, Sequence) and not isinstance(plain, (str, bytes)) else (plain,)


def _number(text: str, expects: str) -> float:
    try:
        return float(_plain(text))
    except ValueError:
        raise ValueError(expects) from None


def _plain(text: str) -> str:
    """Reject numbers in Python's extended syntax: underscores and non-ASCII digits."""
    if "_" in text or not text.isascii():
        raise ValueError
    return text


def _checked(value: Any, kind: Number | Vector) -> float:
    number = finite(value)
    if number is None:
        raise ValueError(kind.expects)
    if not (kind.above < number < kind.below and kind.least <= number <= kind.most):
        raise ValueError(kind.expects)
    if abs(number) > LARGEST or (kind.above == 0 and number < SMALLEST):
        raise ValueError(f"{kind.expects}, of a size from {SMALLEST:g} to {LARGEST:g}")
    return number


def _range(kind: Number | Vector) -> str:
    low = (
        f" > {kind.above:g}"
        if math.isfinite(kind.above)
        else f" >= {kind.least:g}"
        if math.isfinite(kind.least)
        else ""
    )
    high = (
        f" < {kind.below:g}"
        if math.isfinite(kind.below)
        else f" <= {kind.most:g}"
        if math.isfinite(kind.most)
        else ""
    )
    return low + (" and" if low and high else "") + high


def _shortest(value: Any) -> str:
    return repr(int(value)) if float(value).is_integer() and abs(value) < 1e15 else repr(float(value))
