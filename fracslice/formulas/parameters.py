"""Parameters of formulas and of records: kinds, conversion from and to text, validation and description.

Each kind parses text from a scene file (`read`), validates a value (`check`, which raises a `ValueError` that
says what is expected) and writes it back (`text`). The schema and the documentation are made from the same
objects; `records.validate` applies them to the fields of a record.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from numbers import Integral, Real
from typing import Any, TypeVar


def short_repr(value: Any) -> str:
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
    """Convert a real number to a float."""
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


REQUIRED: Any = ...
AUTO = "auto"

SMALLEST, LARGEST = 1e-15, 1e9
"""Range of magnitudes whose squares and products float32 kernels can represent."""


@dataclass(frozen=True)
class Parameter(ABC):
    """Kind of a parameter.

    Attributes
    ----------
    default : value, None or REQUIRED
        Default value.
    doc : str
        Description.
    """

    default: Any
    doc: str

    @property
    @abstractmethod
    def expects(self) -> str:
        """Description of the accepted values."""

    @abstractmethod
    def check(self, value: Any) -> Any:
        """Validate and convert a value.

        Parameters
        ----------
        value : object
            Any value.

        Returns
        -------
        object
            The value in the type of this kind.

        Raises
        ------
        ValueError
            With `expects`, for any other value.
        """

    def read(self, text: str) -> Any:
        """Parse a value; see `check`."""
        return self.check(text.strip())

    def text(self, value: Any) -> str:
        """Format a value as text for `read`; see `read`."""
        return str(value)


@dataclass(frozen=True)
class Bounded(Parameter):
    """Kind of finite numbers within limits.

    Attributes
    ----------
    above, below : float
        Exclusive limits.
    least, most : float
        Inclusive limits.
    """

    above: float = -math.inf
    least: float = -math.inf
    most: float = math.inf
    below: float = math.inf

    @property
    def range(self) -> str:
        """Description of the limits, such as " > 0 and <= 4"."""
        signs = {">": self.above, ">=": self.least, "<": self.below, "<=": self.most}
        limits = [f" {sign} {limit:g}" for sign, limit in signs.items() if math.isfinite(limit)]
        return " and".join(limits)

    def parsed(self, text: str) -> float:
        """Number that a text spells."""
        try:
            return float(plain(text))
        except ValueError:
            raise ValueError(self.expects) from None

    def checked(self, value: Any) -> float:
        """Number within the limits."""
        number = finite(value)
        if number is None or not (self.above < number < self.below and self.least <= number <= self.most):
            raise ValueError(self.expects)
        if abs(number) > LARGEST or (self.above == 0 and number < SMALLEST):
            raise ValueError(f"{self.expects}, of a size from {SMALLEST:g} to {LARGEST:g}")
        return number


@dataclass(frozen=True)
class Number(Bounded):
    """One finite number."""

    @property
    def expects(self) -> str:
        return "a number" + self.range

    def read(self, text: str) -> Any:
        return self.check(self.parsed(text))

    def check(self, value: Any) -> Any:
        return self.checked(value)

    def text(self, value: Any) -> str:
        return shortest(value)


@dataclass(frozen=True)
class Count(Parameter):
    """A whole number.

    Attributes
    ----------
    least, most : int
        Inclusive limits.
    words : tuple of str
        Words that are allowed, too.
    """

    least: int = 0
    most: int = 10_000
    words: tuple[str, ...] = ()

    @property
    def expects(self) -> str:
        whole = f"a whole number from {self.least} to {self.most}"
        *others, last = whole, *(f'"{word}"' for word in self.words)
        return f"{', '.join(others)} or {last}" if others else last

    def read(self, text: str) -> Any:
        try:
            return self.check(text.strip() if text.strip() in self.words else int(plain(text)))
        except ValueError:
            raise ValueError(self.expects) from None

    def check(self, value: Any) -> Any:
        if isinstance(value, str) and value in self.words:
            return value
        whole = isinstance(value, Integral) and not isinstance(value, bool)
        if not whole or not self.least <= value <= self.most:
            raise ValueError(self.expects)
        return int(value)


@dataclass(frozen=True)
class Vector(Bounded):
    """Several finite numbers, separated by spaces; the limits hold for each.

    Attributes
    ----------
    sizes : tuple of int
        Allowed lengths.
    nonzero : bool
        True if the numbers must not all be zero.
    whole : bool
        True if the numbers must be whole.
    """

    sizes: tuple[int, ...] = (3,)
    nonzero: bool = False
    whole: bool = False

    @property
    def expects(self) -> str:
        kind = "whole numbers" if self.whole else "numbers"
        nonzero = ", not all zero" if self.nonzero else ""
        *others, last = map(str, self.sizes)
        count = f"{', '.join(others)} or {last}" if others else last
        return f"{count} {kind}{self.range}{nonzero}"

    def read(self, text: str) -> Any:
        if "," in text:
            raise ValueError(f"{self.expects}, separated by spaces")
        return self.check(tuple(map(self.parsed, text.split())))

    def check(self, value: Any) -> Any:
        given = items(value)
        if len(given) not in self.sizes:
            raise ValueError(self.expects)
        numbers = tuple(map(self.checked, given))
        zero = self.nonzero and not any(abs(n) >= SMALLEST for n in numbers)
        if zero or (self.whole and any(n != int(n) for n in numbers)):
            raise ValueError(self.expects)
        return tuple(map(int, numbers)) if self.whole else numbers

    def text(self, value: Any) -> str:
        return " ".join(map(shortest, value))


@dataclass(frozen=True)
class Choice(Parameter):
    """One word of a list.

    Attributes
    ----------
    choices : tuple of str
        Allowed words.
    """

    choices: tuple[str, ...]

    @property
    def expects(self) -> str:
        *others, last = self.choices
        return f"{', '.join(others)} or {last}" if others else last

    def check(self, value: Any) -> Any:
        if not isinstance(value, str) or value not in self.choices:
            raise ValueError(self.expects)
        return value


@dataclass(frozen=True)
class Axis(Choice):
    """One of the letters x, y and z."""

    choices: tuple[str, ...] = ("x", "y", "z")


@dataclass(frozen=True)
class Label(Parameter):
    """Text in one line that is shown to a person."""

    @property
    def expects(self) -> str:
        return "text in one line"

    def check(self, value: Any) -> Any:
        if not isinstance(value, str) or not value.isprintable():
            raise ValueError(self.expects)
        return value


@dataclass(frozen=True)
class File(Parameter):
    """Name of a file; in a scene file, relative to its folder."""

    @property
    def expects(self) -> str:
        return "the name of a file"

    def check(self, value: Any) -> Any:
        if not isinstance(value, str) or not value.isprintable():
            raise ValueError(self.expects)
        return value.strip()


R = TypeVar("R")


def attribute(kind: type[Parameter], *values: Any, **limits: Any) -> Any:
    """Return a dataclass field of a parameter kind."""
    made = kind(*values, **limits)
    return field(default=made.default, metadata={"kind": made})


def kinds_of(record: Any) -> dict[str, Any]:
    """Return the parameter kinds of a record's fields."""
    return {f.name: f.metadata["kind"] for f in fields(record) if "kind" in f.metadata}


def validate(record: Any, fail: Callable[[str], Exception]) -> None:
    """Validate and convert fields of a frozen record in place. None is kept where it is the default."""
    for name, kind in kinds_of(record).items():
        value = getattr(record, name)
        if value is not None or kind.default is not None:
            object.__setattr__(record, name, validate_value(name, value, kind, fail))


def validate_value(name: str, value: Any, kind: Any, fail: Callable[[str], Exception]) -> Any:
    """Validate and convert one value."""
    try:
        return kind.check(value)
    except ValueError as error:
        raise fail(f"{name}={short_repr(value)}: expected {error}") from None


def from_table(
    kind: type[R], where: str, values: Mapping[str, Any], fail: type[Exception], also: str = "", **given: Any
) -> R:
    """Make a record from the values of a file."""
    known = {f.name: f.default for f in fields(kind) if f.name not in given}  # type: ignore[arg-type]
    if unknown := sorted(values.keys() - known.keys()):
        raise fail(f"{where}: {unknown[0]!r}: unknown; expected {', '.join(known)}{also}")
    if missing := [name for name, default in known.items() if default is REQUIRED and name not in values]:
        raise fail(f"{where}: {missing[0]} is missing")
    try:
        return kind(**values, **given)
    except fail as error:
        raise fail(f"{where}: {error}") from None
