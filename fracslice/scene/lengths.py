"""Lengths with a unit: how big the finished object is, how fine its detail."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any

from ..errors import SceneError
from ..formulas.parameters import finite, shown

MILLIMETRES = {"um": 1e-3, "µm": 1e-3, "mm": 1.0, "cm": 10.0, "in": 25.4, "m": 1000.0}
SMALLEST, LARGEST = 1e-6, 1e6
EXPECTS = "a length above zero such as 80mm, 8cm, 3.1in or 250um, from 0.001um to 1000m"
NUMBER = r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?"
_LENGTH = re.compile(rf"\s*({NUMBER})\s*({'|'.join(MILLIMETRES)})?\s*")


def parse_length(value: str | float, what: str = "length") -> float:
    """`value` in mm; a bare number is in mm already. Raises `SceneError`, which calls it `what`.

    >>> parse_length("2.5 cm"), parse_length(80)
    (25.0, 80.0)
    """
    try:
        return Length(None, "").check(value)
    except ValueError as error:
        raise SceneError(f"{what} {shown(value)}: expected {error}") from None


@dataclass(frozen=True)
class Length:
    """A parameter that is a length: text with a unit, or a number of mm; its value is in mm.

    zero: whether it may be 0, for none.
    """

    default: Any
    doc: str
    zero: bool = False

    @property
    def expects(self) -> str:
        return f"0, or {EXPECTS}" if self.zero else EXPECTS

    def read(self, text: str) -> float:
        match = _LENGTH.fullmatch(text)
        if not match:
            raise ValueError(self.expects)
        return self._possible(float(match[1]) * MILLIMETRES[match[2] or "mm"])

    def check(self, value: Any) -> float:
        return self.read(value) if isinstance(value, str) else self._possible(value)

    def text(self, value: float) -> str:
        return f"{int(value) if value.is_integer() else value!r}mm"

    def _possible(self, value: Any) -> float:
        length = finite(value)
        if length is None or not (SMALLEST <= length <= LARGEST or (self.zero and length == 0)):
            raise ValueError(self.expects)
        return length + 0.0  # -0 is 0


@dataclass(frozen=True)
class Shift(Length):
    """A parameter that is a length in either direction, or 0; its value is in mm."""

    expects = "0, or a length such as 0.05mm or -50um, up to 1000m"

    def _possible(self, value: Any) -> float:
        length = finite(value)
        if length is None or not abs(length) <= LARGEST:
            raise ValueError(self.expects)
        return length


@dataclass(frozen=True)
class Pair(Length):
    """A parameter that is two lengths, or one that stands for both; its values are in mm."""

    expects = f"two lengths, or one for both, each {EXPECTS}"

    def check(self, value: Any) -> Any:
        pair = tuple(value) if isinstance(value, (tuple, list)) else (value, value)
        if len(pair) != 2:
            raise ValueError(self.expects)
        return super().check(pair[0]), super().check(pair[1])
