"""Lengths with units."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

from ..errors import SceneError
from ..formulas.parameters import Parameter, finite, short_repr

AnyLength: TypeAlias = float | str
"""A number in mm, or text with a unit, such as "0.5mm"."""

AnyScale: TypeAlias = float | str | Sequence[float]
"""One factor for all axes, three, or text such as "102%" or "102%,102%,101%"."""

MILLIMETRES = {"um": 1e-3, "µm": 1e-3, "mm": 1.0, "cm": 10.0, "in": 25.4, "m": 1000.0}
SMALLEST, LARGEST = 1e-6, 1e6
EXPECTS = "a length above zero such as 80mm, 8cm, 3.1in or 250um, from 0.001um to 1000m"
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
        return f"0, or {EXPECTS}" if self.zero else EXPECTS

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
        if length is None or not (SMALLEST <= length <= LARGEST or (self.zero and length == 0)):
            raise ValueError(self.expects)
        return length + 0.0  # -0 is 0


@dataclass(frozen=True)
class Shift(Length):
    """Parameter kind of a signed length, or 0. Its value is in mm."""

    expects = "0, or a length such as 0.05mm or -50um, up to 1000m"

    def _possible(self, value: Any) -> float:
        length = finite(value)
        if length is None or not abs(length) <= LARGEST:
            raise ValueError(self.expects)
        return length


@dataclass(frozen=True)
class Pair(Length):
    """Parameter kind of two lengths, or one length for both. Its values are in mm."""

    expects = f"two lengths, or one for both, each {EXPECTS}"

    def check(self, value: Any) -> Any:
        """Validate one length or a pair; see `Parameter.check`."""
        pair = tuple(value) if isinstance(value, (tuple, list)) else (value, value)
        if len(pair) != 2:
            raise ValueError(self.expects)
        return super().check(pair[0]), super().check(pair[1])


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
