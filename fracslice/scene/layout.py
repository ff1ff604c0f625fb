"""Elements of a scene file other than formulas, with their attributes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

from ..common.parameters import REQUIRED, Choice, Length, Number, Parameter, Vector
from ..fields.definitions import is_name
from ..fields.registry import Formula, load_installed
from ..formulas import get, names
from ..records import Part, Print
from .animation import Animation, Track
from .view import PARTS


@dataclass(frozen=True)
class TopElement:
    """`<scene>` or an element directly under it, with the interface of `Formula`."""

    name: str  # element name
    doc: str  # documentation
    parameters: Mapping[str, Parameter]  # attributes of the element
    children: tuple[int, int | None] = (0, 0)  # minimum and maximum number of children; None for no maximum
    part: type[Part] | None = None  # record that the element becomes, for views and printing
    many: bool = False  # true if the element may be repeated


Element = Formula | TopElement


@dataclass(frozen=True)
class Identifier(Parameter):
    """A name of lower-case letters, digits and underscores that begins with a letter."""

    @property
    def expects(self) -> str:
        return "a name of at most 40 lower-case letters, digits and _, not one of a function"

    def check(self, value: Any) -> Any:
        if not isinstance(value, str) or not is_name(value):
            raise ValueError(self.expects)
        return value


VERSION = "1"
LISTED = '"fracslice formulas" lists them, --formulas FILE or <define> adds one'
"""Where the elements of a solid are listed."""

SCENE = TopElement(
    "scene",
    "The whole file.",
    MappingProxyType({"version": Choice(REQUIRED, "of the file format", (VERSION,))}),
    (1, None),
)
SOLID = TopElement(
    "solid",
    "The object to make. Several elements inside it are a union.",
    MappingProxyType(
        {
            "size": Length(None, "the longest side of the finished object"),
            "unit": Length(None, "or the length of a scene unit; 1mm if neither is given"),
        }
    ),
    (1, None),
)

DEFINE = TopElement(
    "define",
    """A formula of the scene's own: the text of the step of an escape-time fractal, or of a distance.

    The last statement returns. A step has the point `w`, the constant `c`, the vocabulary and the verbs, and
    returns the next point; a distance has `x`, `y`, `z` and the vocabulary. Elements of its name may stand
    below it. The text is checked against a white list before anything of it is executed: it holds arithmetic,
    loops over constants and calls of these functions, and nothing else.""",
    MappingProxyType(
        {
            "name": Identifier(REQUIRED, "of the formula"),
            "kind": Choice("step", "what the text returns", ("step", "distance")),
            "lipschitz": Number(1.0, "Lipschitz bound of a distance", above=0),
            "half": Vector(None, "half sizes of a box around the solid of a distance", above=0),
        }
    ),
    (0, None),
    many=True,
)
PARAMETER = TopElement(
    "parameter",
    "A parameter of a <define>.",
    MappingProxyType(
        {
            "name": Identifier(REQUIRED, "of the parameter"),
            "default": Vector(REQUIRED, "where an element does not give it", sizes=(1, 3)),
            "least": Number(None, "smallest value"),
            "most": Number(None, "largest value"),
        }
    ),
)


def _section(part: type[Part]) -> TopElement:
    parameters = MappingProxyType(part.kinds())
    return TopElement(part.element, part.description, parameters, part=part, many=part.many)


PRINT = _section(Print)
PICTURE = [_section(part) for part in PARTS]
FILM = [_section(part) for part in (Animation, Track)]
SECTIONS = {section.name: section for section in (DEFINE, SOLID, PRINT, *PICTURE, *FILM)}


def registered_formulas() -> dict[str, Formula]:
    """Return every registered formula by name, without a look at installed packages."""
    return {name: get(name) for name in names()}


def formulas() -> list[Formula]:
    """Return every registered formula, those of installed packages too.

    Returns
    -------
    list of Formula
        Sorted by name.
    """
    load_installed()
    return list(registered_formulas().values())
