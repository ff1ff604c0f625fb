"""Parameters of formulas and of records: kinds, conversion from and to text, validation and description.

Each kind parses text from a scene file or a command (`read`), validates a value (`check`, which raises a
`ValueError` that says what is expected) and writes it back (`text`). The schema, the options of commands, the
signatures of Python and the documentation are made from the same objects.
"""

from __future__ import annotations

import math
import re
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import Field, dataclass, field, fields, is_dataclass
from inspect import cleandoc
from keyword import iskeyword
from numbers import Integral, Real
from typing import TYPE_CHECKING, Any, ClassVar, Generic, TypeAlias, TypeVar, dataclass_transform, overload

from ..errors import SceneError


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
    if isinstance(value, bool) or not isinstance(value, (float, Real)):  # most are, and Real is slow
        return None
    try:
        number = float(value)
    except OverflowError:
        return None
    return number if math.isfinite(number) else None


def items(value: Any) -> Sequence[Any]:
    """Items of a sequence or an array; any other value is one item."""
    if isinstance(value, (tuple, list)):
        return value
    value = value.tolist() if hasattr(value, "tolist") else value
    return value if isinstance(value, Sequence) and not isinstance(value, (str, bytes)) else (value,)


def plain(text: str) -> str:
    """Reject numbers in Python's extended syntax: underscores and non-ASCII digits."""
    if "_" in text or not text.isascii():
        raise ValueError
    return text


def alternatives(*words: object) -> str:
    """Words with commas between them and "or" before the last."""
    *others, last = map(str, words)
    return f"{', '.join(others)} or {last}" if others else last


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
    implied: ClassVar[bool] = False  # true if the other values of an element determine it

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
    unit : str
        Unit, in messages and documentation.
    """

    above: float = -math.inf
    least: float = -math.inf
    most: float = math.inf
    below: float = math.inf
    unit: str = ""

    @property
    def range(self) -> str:
        """Description of the limits, such as " > 0 and <= 4"."""
        signs = {">": self.above, ">=": self.least, "<": self.below, "<=": self.most}
        limits = [f" {sign} {limit:g}" for sign, limit in signs.items() if math.isfinite(limit)]
        return " and".join(limits) + (f", in {self.unit}" if self.unit else "")

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
        return alternatives(whole, *(f'"{word}"' for word in self.words))

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
class Colours(Parameter):
    """Colours as in #000,#fff,#e33; in place of them, one of some words, or how many there are.

    Attributes
    ----------
    least, most : int
        Inclusive limits of their number.
    words : tuple of str
        Words that are allowed, too.
    counted : bool
        True if a number of colours is allowed, too.
    """

    least: int = 2
    most: int = 8
    words: tuple[str, ...] = ()
    counted: bool = False

    @property
    def expects(self) -> str:
        limits = f"{self.least} to {self.most}"
        count = [f"a number from {limits}"] if self.counted else []
        return alternatives(*self.words, *count, f"{limits} colours such as #000,#fff,#e33")

    def read(self, text: str) -> Any:
        if self.counted and re.fullmatch(r"\s*[0-9]{1,9}\s*", text):
            return self.check(int(text))
        return self.check(text.strip())

    def check(self, value: Any) -> Any:
        if isinstance(value, str) and value in self.words:
            return value
        if isinstance(value, Integral) and self.counted and self.least <= int(value) <= self.most:
            return int(value)
        given = value.split(",") if isinstance(value, str) else list(items(value))
        matches = [_COLOUR.fullmatch(one.strip()) if isinstance(one, str) else None for one in given]
        if not self.least <= len(given) <= self.most or None in matches:
            raise ValueError(self.expects)
        digits = [match[1].lower() for match in matches if match]
        return tuple(f"#{d if len(d) == 6 else ''.join(2 * c for c in d)}" for d in digits)

    def text(self, value: Any) -> str:
        return str(value) if isinstance(value, str | int) else ",".join(value)


_COLOUR = re.compile(r"#([0-9a-fA-F]{6}|[0-9a-fA-F]{3})")


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
        return f"{alternatives(*self.sizes)} {kind}{self.range}{nonzero}"

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
class Points(Parameter):
    """Several points, with commas between them."""

    annotation: ClassVar[Any] = str | Sequence[Sequence[float]]
    MOST: ClassVar[int] = 100_000

    @property
    def expects(self) -> str:
        return "points such as 0 0 0, 5 0 0, 5 5 2"

    def read(self, text: str) -> Any:
        return self.check(text)

    def check(self, value: Any) -> Any:
        parts = value.split(",") if isinstance(value, str) else items(value)
        if not 2 <= len(parts) <= self.MOST:
            raise ValueError(f"2 to {self.MOST} {self.expects}, found {len(parts)}")
        point = Vector(None, "")
        try:
            return tuple(point.read(p) if isinstance(p, str) else point.check(p) for p in parts)
        except ValueError:
            raise ValueError(self.expects) from None

    def text(self, value: Any) -> str:
        return ", ".join(" ".join(map(shortest, point)) for point in value)


@dataclass(frozen=True)
class Holes(Parameter):
    """Places of holes, with spaces between them; or a word.

    Numbers of a place have commas between them: a point, a direction and a diameter.
    """

    annotation: ClassVar[Any] = str | Sequence[Sequence[float]]
    MOST: ClassVar[int] = 100
    WORD: ClassVar[str] = "auto"

    @property
    def expects(self) -> str:
        return f'"{self.WORD}", or places x,y,z: with a direction x,y,z,u,v,w, and a diameter behind that'

    def read(self, text: str) -> Any:
        return self.check(text)

    def check(self, value: Any) -> Any:
        if value == self.WORD:
            return value
        try:
            given = value.split() if isinstance(value, str) else items(value)
            words = [one.split(",") if isinstance(one, str) else items(one) for one in given]
            holes = tuple(tuple(map(float, one)) for one in words)
        except (TypeError, ValueError):
            raise ValueError(self.expects) from None
        if len(holes) > self.MOST or not all(map(self._is_hole, holes)):
            raise ValueError(self.expects)
        return holes

    @staticmethod
    def _is_hole(numbers: Sequence[float]) -> bool:
        whole = len(numbers) in (3, 6, 7) and all(map(math.isfinite, numbers))
        return whole and (len(numbers) < 6 or any(numbers[3:6])) and (len(numbers) < 7 or numbers[6] > 0)

    def text(self, value: Any) -> str:
        return value if value == self.WORD else " ".join(",".join(map(shortest, hole)) for hole in value)


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
        return alternatives(*self.choices)

    def check(self, value: Any) -> Any:
        if not isinstance(value, str) or value not in self.choices:
            raise ValueError(self.expects)
        return value


@dataclass(frozen=True)
class Axis(Choice):
    """One of the letters x, y and z."""

    choices: tuple[str, ...] = ("x", "y", "z")


@dataclass(frozen=True)
class Flag(Parameter):
    """Yes or no."""

    @property
    def expects(self) -> str:
        return "true or false"

    def check(self, value: Any) -> Any:
        if not isinstance(value, bool):
            raise ValueError(self.expects)
        return value


@dataclass(frozen=True)
class Listed(Parameter):
    """One whole number of a list.

    Attributes
    ----------
    values : tuple of int
        Allowed numbers.
    """

    values: tuple[int, ...]

    @property
    def expects(self) -> str:
        return alternatives(*self.values)

    def read(self, text: str) -> Any:
        try:
            return self.check(int(plain(text)))
        except ValueError:
            raise ValueError(self.expects) from None

    def check(self, value: Any) -> Any:
        if isinstance(value, bool) or not isinstance(value, Integral) or value not in self.values:
            raise ValueError(self.expects)
        return int(value)


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
    """Name of a file; in a scene file, relative to its folder.

    Attributes
    ----------
    inside : bool
        True if it must lie in that folder, unless the reader is told that it need not.
    """

    inside: bool = False

    @property
    def expects(self) -> str:
        return "the name of a file"

    def check(self, value: Any) -> Any:
        if not isinstance(value, str) or not value.isprintable():
            raise ValueError(self.expects)
        return value.strip()


@dataclass(frozen=True)
class Digest(Parameter):
    """SHA-256 of a file; without it, that of the file as it is."""

    implied = True

    @property
    def expects(self) -> str:
        return "the SHA-256 of the file, 64 hexadecimal digits"

    def check(self, value: Any) -> Any:
        if not isinstance(value, str) or not re.fullmatch("[0-9a-f]{64}", value):
            raise ValueError(self.expects)
        return value


R = TypeVar("R")
G = TypeVar("G")
H = TypeVar("H")


class Given(Generic[G, H]):
    """Type of a record's field that takes a G and holds an H, such as text and a length in mm."""

    if TYPE_CHECKING:

        @overload
        def __get__(self, record: None, kind: Any) -> Any: ...
        @overload
        def __get__(self, record: object, kind: Any) -> H: ...
        def __get__(self, record: object, kind: Any) -> Any: ...
        def __set__(self, record: object, value: G) -> None: ...


def attribute(kind: type[Parameter], *values: Any, **limits: Any) -> Any:
    """Return a dataclass field of a parameter kind."""
    return of_kind(kind(*values, **limits))


def of_kind(kind: Parameter) -> Any:
    """Return a dataclass field of a parameter kind that is made already."""
    return field(default=kind.default, metadata={"kind": kind})


def described(default: Any, doc: str, **settings: Any) -> Any:
    """Return a dataclass field that is no option: what it holds is made in Python."""
    return field(default=default, metadata={"doc": doc}, **settings)


class Record:
    """Base of records whose fields carry parameter kinds.

    Attributes
    ----------
    description : str
        Docstring without the attributes, which are added to it.
    """

    description: ClassVar[str]
    if TYPE_CHECKING:
        __dataclass_fields__: ClassVar[dict[str, Any]]

    def __init_subclass__(cls) -> None:
        cls.description = cleandoc(cls.__doc__ or "")
        own = {name: given for name, given in vars(cls).items() if isinstance(given, Field)}
        bases = [base for base in reversed(cls.__mro__) if is_dataclass(base) and base is not cls]
        lines = [cls.description, "", "Attributes", "----------"]
        for name, given in ({f.name: f for base in bases for f in fields(base)} | own).items():
            if kind := given.metadata.get("kind"):
                lines += parameter_lines({name: kind})
            elif doc := given.metadata.get("doc"):
                lines += [f"{name} : optional", f"    {doc}"]
        cls.__doc__ = "\n".join(lines)

    @classmethod
    def kinds(cls) -> dict[str, Any]:
        """Return the parameter kinds.

        Returns
        -------
        dict of str to Parameter
            Kinds by field name.
        """
        return kinds_of(cls)


@dataclass_transform(kw_only_default=True, field_specifiers=(field,))
def record(cls: type[R]) -> type[R]:
    """Make a class of keyword fields a frozen dataclass.

    Type checkers take it for one that is not frozen: mypy forgets what frozen fields hold in subclasses.
    """
    return dataclass(frozen=True, kw_only=True)(cls)


def python_name(name: str) -> str:
    """Name of a parameter in Python; a keyword such as ``from`` becomes ``from_`` (PEP 8)."""
    return f"{name}_" if iskeyword(name) else name


def parameter_lines(parameters: Mapping[str, Any]) -> list[str]:
    """Describe parameters in numpydoc style."""
    lines = []
    for name, parameter in parameters.items():
        default = "" if parameter.default in (REQUIRED, None) else f", default {parameter.default!r}"
        lines += [f"{python_name(name)} : {parameter.expects}{default}", f"    {parameter.doc}"]
    return lines


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


Triple: TypeAlias = tuple[float, float, float]

AnyLength: TypeAlias = float | str
"""A number in mm, or text with a unit, such as "0.5mm"."""

AnyScale: TypeAlias = float | str | Sequence[float]
"""One factor for all axes, three, or text such as "102%" or "102%,102%,101%"."""

MILLIMETRES = {"um": 1e-3, "µm": 1e-3, "mm": 1.0, "cm": 10.0, "in": 25.4, "m": 1000.0}
SHORTEST, LONGEST = 1e-6, 1e6
_EXPECTS = "a length above zero such as 80mm, 8cm, 3.1in or 250um, from 0.001um to 1000m"
NUMBER = r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?"
_LENGTH = re.compile(rf"\s*({NUMBER})\s*({'|'.join(MILLIMETRES)})?\s*")
LEAST, MOST = 0.5, 2.0
"""Limits of scale factors."""
_PERCENT = re.compile(rf"\s*({NUMBER})\s*%\s*")


def parse_length(value: str | float, what: str = "length") -> float:
    """Convert a length to mm.

    Parameters
    ----------
    value : str or float
        Text with a unit, or a number of mm.
    what : str
        Name of the length in error messages.

    Returns
    -------
    float
        Length, mm.

    Raises
    ------
    SceneError
        If the value is not a length.

    Examples
    --------
    >>> parse_length("2.5 cm"), parse_length(80)
    (25.0, 80.0)
    """
    try:
        return Length(None, "").check(value)
    except ValueError as error:
        raise SceneError(f"{what} {short_repr(value)}: expected {error}") from None


@dataclass(frozen=True)
class Length(Parameter):
    """Parameter kind of a length: text with a unit, or a number of mm. Its value is in mm."""

    zero: bool = False  # true if 0 is allowed, for none

    @property
    def expects(self) -> str:
        """Description of the accepted values."""
        return f"0, or {_EXPECTS}" if self.zero else _EXPECTS

    def read(self, text: str) -> float:
        """Parse text with an optional unit; see `Parameter.read`."""
        match = _LENGTH.fullmatch(text)
        if not match:
            raise ValueError(self.expects)
        return self._possible(float(match[1]) * MILLIMETRES[match[2] or "mm"])

    def check(self, value: Any) -> float:
        """Validate text or a number of mm; see `Parameter.check`."""
        return self.read(value) if isinstance(value, str) else self._possible(value)

    def text(self, value: float) -> str:
        """Format a length; see `Parameter.text`."""
        return f"{int(value) if value.is_integer() else value!r}mm"

    def _possible(self, value: Any) -> float:
        length = finite(value)
        if length is None or not (SHORTEST <= length <= LONGEST or (self.zero and length == 0)):
            raise ValueError(self.expects)
        return length + 0.0  # -0 is 0


@dataclass(frozen=True)
class Shift(Length):
    """Parameter kind of a signed length, or 0. Its value is in mm."""

    expects = "0, or a length such as 0.05mm or -50um, up to 1000m"

    def _possible(self, value: Any) -> float:
        length = finite(value)
        if length is None or not abs(length) <= LONGEST:
            raise ValueError(self.expects)
        return length


@dataclass(frozen=True)
class Pair(Length):
    """Parameter kind of two lengths, or one length for both. Its values are in mm."""

    expects = f"two lengths, or one for both, each {_EXPECTS}"

    def read(self, text: str) -> Any:
        """Parse one length for both; see `Parameter.read`."""
        return self.check(super().read(text))

    def check(self, value: Any) -> Any:
        """Validate one length or a pair; see `Parameter.check`."""
        if isinstance(value, str):
            return self.read(value)
        pair = tuple(value) if isinstance(value, (tuple, list)) else (value, value)
        try:
            width, height = (Length(None, "").check(v) for v in pair)
        except ValueError:
            raise ValueError(self.expects) from None
        return width, height


@dataclass(frozen=True)
class Heights(Length):
    """Parameter kind of a length, or the limits of a range. Its value is two numbers of mm; without a range,
    the second is None.
    """

    expects = f"a length, or two of a range such as 0.05mm..0.2mm, each {_EXPECTS}"

    def read(self, text: str) -> Any:
        """Parse a length, or two with dots between; see `Parameter.read`."""
        low, dots, high = text.partition("..")
        return super().read(low), super().read(high) if dots else None

    def check(self, value: Any) -> Any:
        """Validate one length or a pair; see `Parameter.check`."""
        if isinstance(value, str):
            return self.read(value)
        pair = tuple(value) if isinstance(value, (tuple, list)) else (value, None)
        if len(pair) != 2:
            raise ValueError(self.expects)
        low, high = (Length(None, "").check(v) if v is not None else None for v in pair)
        return low, high

    def text(self, value: Any) -> str:
        """Format one length or a range; see `Parameter.text`."""
        return "..".join(super(Heights, self).text(v) for v in value if v is not None)


@dataclass(frozen=True)
class Sides(Length):
    """Parameter kind of three lengths, such as 220x220x250mm: a unit is that of the lengths before it, too.
    Its values are in mm.

    Attributes
    ----------
    flat : bool
        True if the last of them may be left out.
    """

    flat: bool = False

    @property
    def expects(self) -> str:
        """Description of the accepted values."""
        return "three lengths such as 220x220x250mm" + (", or two, 143x89mm" if self.flat else "")

    def read(self, text: str) -> Any:
        """Parse lengths with x between; see `Parameter.read`."""
        words = [word.strip() for word in text.split("x")]
        unit = words[-1].lstrip("0123456789.+-eE ")
        return self.check(tuple(word if word[-1:].isalpha() else word + unit for word in words))

    def check(self, value: Any) -> Any:
        """Validate text or lengths; see `Parameter.check`."""
        if isinstance(value, str):
            return self.read(value)
        try:
            sides = tuple(Length(None, "").check(side) for side in items(value))
        except ValueError:
            sides = ()
        if len(sides) != 3 and not (self.flat and len(sides) == 2):
            raise ValueError(self.expects)
        return sides

    def text(self, value: Any) -> str:
        """Format the lengths; see `Parameter.text`."""
        return f"{'x'.join(f'{side:.6g}' for side in value)}mm"


@dataclass(frozen=True)
class Percent(Parameter):
    """Parameter kind of scale factors along x, y and z: percentages, or numbers in Python."""

    @property
    def expects(self) -> str:
        """Description of the accepted values."""
        return f"a percentage such as 102%, or three, from {LEAST:.0%} to {MOST:.0%}"

    def read(self, text: str) -> tuple[float, ...]:
        """Parse one percentage, or three separated by commas; see `Parameter.read`."""
        matches = [_PERCENT.fullmatch(part) for part in text.split(",")]
        return self.check(tuple(float(match[1]) / 100 if match else math.nan for match in matches))

    def check(self, value: Any) -> tuple[float, ...]:
        """Validate text, one factor for all axes, or three; see `Parameter.check`."""
        if isinstance(value, str):
            return self.read(value)
        given = [finite(v) for v in (value if isinstance(value, (tuple, list)) else (value,))]
        factors = tuple(v for v in given if v is not None and LEAST <= v <= MOST)
        if len(factors) != len(given) or len(given) not in (1, 3):
            raise ValueError(self.expects)
        return factors if len(factors) == 3 else factors * 3

    def text(self, value: Any) -> str:
        """Format one percentage, or three; see `Parameter.text`."""
        return ",".join(f"{100 * v:g}%" for v in (value if len(set(value)) > 1 else value[:1]))


@dataclass(frozen=True)
class Pixels(Parameter):
    """Parameter kind of whole numbers of pixels with a sign between, such as 1280x720.

    Attributes
    ----------
    sign : str
        What separates the numbers in text.
    names : tuple of str
        Name of each number.
    example, letters : str
        Text of a value, and what stands for it in the help of a command.
    least, most : int
        Inclusive limits of each number.
    words : tuple of str
        Words that are allowed in place of numbers.
    """

    sign: str = ","
    names: tuple[str, ...] = ("left", "top", "width", "height")
    example: str = "100,50,640,480"
    letters: str = "X,Y,W,H"
    least: int = 0
    most: int = 32768
    words: tuple[str, ...] = ()

    @property
    def expects(self) -> str:
        """Description of the accepted values."""
        *others, last = self.names
        names = f"{', '.join(others)} and {last}"
        return alternatives(*self.words, f"{names}, such as {self.example}, from {self.least} to {self.most}")

    def read(self, text: str) -> Any:
        """Parse numbers with the sign between; see `Parameter.read`."""
        if text.strip() in self.words:
            return text.strip()
        words = [word.strip() for word in text.split(self.sign)]
        if not all(re.fullmatch(r"\d{1,9}", word) for word in words):
            raise ValueError(self.expects)
        return self.check(tuple(map(int, words)))

    def check(self, value: Any) -> Any:
        """Validate text or numbers; see `Parameter.check`."""
        if isinstance(value, str):
            return self.read(value)
        sizes = (len(self.names),)
        numbers = Vector(None, "", least=self.least, most=self.most, sizes=sizes, whole=True)
        try:
            return tuple(numbers.check(value))
        except ValueError:
            raise ValueError(self.expects) from None

    def text(self, value: Any) -> str:
        """Format the numbers; see `Parameter.text`."""
        return value if isinstance(value, str) else self.sign.join(map(str, value))


def picture_size(default: Any, doc: str) -> Pixels:
    """Return the kind of a picture's size, pixels."""
    return Pixels(default, doc, "x", ("pixels across", "down"), "1280x720", "WxH", least=1)


SECONDS = {"s": 1.0, "min": 60.0, "h": 3600.0}
"""Units of durations, seconds."""


@dataclass(frozen=True)
class Duration(Parameter):
    """Parameter kind of a time: text with a unit, or a number of seconds. Its value is in seconds."""

    expects = "a time above zero, such as 10s, 2min or 1h"

    def read(self, text: str) -> float:
        """Parse text with an optional unit; see `Parameter.read`."""
        match = re.fullmatch(r"\s*(\d+\.?\d*|\.\d+)\s*(s|min|h)?\s*", text)
        if not match:
            raise ValueError(self.expects)
        return self.check(float(match[1]) * SECONDS[match[2] or "s"])

    def check(self, value: Any) -> float:
        """Validate text or a number of seconds; see `Parameter.check`."""
        if isinstance(value, str):
            return self.read(value)
        seconds = finite(value)
        if seconds is None or not 0 < seconds < 1e9:
            raise ValueError(self.expects)
        return seconds

    def text(self, value: float) -> str:
        """Format a time; see `Parameter.text`."""
        return f"{value:g}s"
