"""The elements of a scene file that are not formulas: what stands around them, and with which attributes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

from ..formulas import get, names
from ..formulas.parameters import REQUIRED, Parameter
from ..formulas.registry import Formula
from .lengths import Length
from .printing import Print
from .view import PARTS, Part


@dataclass(frozen=True)
class TopElement:
    """`<scene>` or an element directly under it; described like a `Formula`, so that it reads like one.

    part: the record it becomes, if it is about pictures or printing. many: whether there may be several.
    """

    name: str
    doc: str
    parameters: Mapping[str, Parameter | Length | Version]
    children: tuple[int, int | None] = (0, 0)
    part: type[Part] | None = None
    many: bool = False


Element = Formula | TopElement


@dataclass(frozen=True)
class Version:
    """The version of the file format: the only one there is."""

    default: Any = REQUIRED
    doc: str = "of the file format"
    expects: str = "1"

    def read(self, text: str) -> int:
        if text.strip() != self.expects:
            raise ValueError(self.expects)
        return VERSION

    def text(self, value: int) -> str:
        return str(value)


VERSION = 1
SCENE = TopElement(
    "scene",
    "The whole file.",
    MappingProxyType({"version": Version()}),
    (1, None),
)
SOLID = TopElement(
    "solid",
    "The object to make. Several elements inside it are a union.",
    MappingProxyType({"size": Length(REQUIRED, "the longest side of the finished object")}),
    (1, None),
)


def _section(part: type[Part]) -> TopElement:
    parameters = MappingProxyType(part.kinds())
    return TopElement(part.element, part.__doc__ or "", parameters, part=part, many=part.many)


PRINT = _section(Print)
PICTURE = [_section(part) for part in PARTS]
SECTIONS = {section.name: section for section in (SOLID, PRINT, *PICTURE)}


def formulas() -> list[Formula]:
    """Every registered formula, by name."""
    return [get(name) for name in names()]
