"""Scene files: XML to `Scene`.

The parser is expat. It reports where a tag starts and stops at a document type declaration before that can
declare anything. It opens no other file: no entity is expanded, nothing is included or fetched.
"""

from __future__ import annotations

import os
import textwrap
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.parsers import expat

import numpy as np

from ..common.files import open_regular
from ..common.messages import hint
from ..common.parameters import REQUIRED, File, Number, Parameter, Vector, printable, validate_value
from ..errors import SceneError
from ..fields.definitions import Defined, Definition, formula
from ..fields.registry import DEEPEST, TOO_DEEP, get
from ..formats import SOLIDS
from ..formulas import Node
from ..records import Part, Print
from .layout import (
    DEFINE,
    LISTED,
    PARAMETER,
    SCENE,
    SECTIONS,
    SOLID,
    Element,
    TopElement,
    formulas,
    registered_formulas,
)
from .model import TOO_LARGE, Scene, scene
from .view import Animation, Track, View

if TYPE_CHECKING:
    from .model import Scene

LARGEST_FILE, MOST_ELEMENTS, MOST_DEFINED = 64 << 20, 1 << 19, 100
"""Most bytes and elements of a scene, and most definitions, or parameters of one. An element takes about
1.6 kB when it is read and measured: a scene takes less than a gigabyte before its object takes any.
"""
LONGEST_TEXT = 1 << 16
"""Most characters of a definition with its indentation."""
UNIT = "1mm"
"""Length of a scene unit where neither it nor the size is given, as for a shape in Python."""

BEFORE = b"\0\xff\xfe\xef\xbb\xbf \t\r\n"
"""Bytes allowed before the first tag, or within it in UTF-16: byte order marks and white space."""


def read(path: str | os.PathLike[str], *, files_outside: bool = False) -> Scene:
    """Read a scene file, or a model or grid as the scene of that alone, in mm.

    Parameters
    ----------
    path : str or path
        The file; the scene is named after it.
    files_outside : bool
        Whether models may lie outside of the scene's folder.

    Returns
    -------
    Scene
        The scene.

    Raises
    ------
    SceneError
        If the file is unreadable or invalid: "file:line: <element> message".
    """
    source = os.fspath(path)
    if formula := SOLIDS.get(Path(source).suffix.lower()):
        return scene(get(formula)(source), unit=1.0, name=printable(Path(source).stem))
    try:
        with open_regular(source) as file:
            data = file.read(LARGEST_FILE + 1)
    except OSError as error:
        raise SceneError(f"{source}: {error.strerror or error}") from None
    return _scene(data, source, printable(Path(source).stem), files_outside)


def reads(text: str | bytes, name: str = "scene", *, files_outside: bool = False) -> Scene:
    """Parse a scene.

    Parameters
    ----------
    text : str or bytes
        XML.
    name : str
        Name of the scene, and of the file in error messages.
    files_outside : bool
        Whether models may lie outside of the current folder.

    Returns
    -------
    Scene
        The scene.

    Raises
    ------
    SceneError
        If the text is invalid.
    """
    return _scene(text.encode() if isinstance(text, str) else text, name, name, files_outside)


def _scene(data: bytes, source: str, name: str, files_outside: bool) -> Scene:
    if data[:64].translate(None, BEFORE)[:1] not in (b"", b"<"):
        raise SceneError(f'{source}: not a scene: expected XML that begins with <scene version="1">')
    if len(data) > LARGEST_FILE:
        raise SceneError(f"{source}: expected a scene of at most {LARGEST_FILE >> 20} MB")
    if not data.strip():
        raise SceneError(f"{source}: expected a scene, the file is empty")
    tags = data.replace(b"\0", b"")  # of UTF-16
    if tags.count(b"<") - tags.count(b"</") > MOST_ELEMENTS:
        raise SceneError(f"{source}: expected a scene of at most {MOST_ELEMENTS:,} elements")
    builder = _Builder(source, files_outside)
    solid = builder.sections(data)[SOLID.name]
    others = (Print, Animation, Track)
    printing = next((part for part in builder.parts if isinstance(part, Print)), Print())
    view = View.of(part for part in builder.parts if not isinstance(part, others))
    if len(solid.values) > 1:
        raise solid.fail("size and unit: expected one of them")
    size = solid.values or {"unit": UNIT}
    made = scene(*solid.children, **size, name=name, view=view, printing=printing)
    animation = next((part for part in builder.parts if isinstance(part, Animation)), None)
    tracks = tuple(part for part in builder.parts if isinstance(part, Track))
    return replace(made, animation=animation, tracks=tracks) if animation or tracks else made


@dataclass
class _Open:
    """An element before its end tag."""

    element: Element
    place: str
    values: dict[str, Any]
    children: list[Node] = field(default_factory=list)
    declared: list[tuple[str, Parameter]] = field(default_factory=list)
    lines: dict[int, str] = field(default_factory=dict)
    characters: int = 0

    def fail(self, message: str) -> SceneError:
        """The error to raise about this element."""
        return SceneError(f"{self.place}: <{self.element.name}> {message}")


def let_go(parser: expat.XMLParserType) -> None:
    """Part a parser from its handlers, which hold it: Python does not count its memory as garbage."""
    parser.StartElementHandler = parser.EndElementHandler = parser.CharacterDataHandler = None
    parser.StartDoctypeDeclHandler = parser.CommentHandler = None


class _Builder:
    """Builds nodes from the leaves up during parsing, without recursion at any depth."""

    def __init__(self, source: str, files_outside: bool) -> None:
        self.source, self.files_outside = source, files_outside
        self.open: list[_Open] = []
        self.done: dict[str, _Open] = {}
        self.parts: list[Part] = []
        self.formulas: dict[str, Element] = {**registered_formulas()}
        self.parser = expat.ParserCreate()
        self.parser.buffer_text = True
        self.parser.StartDoctypeDeclHandler = self.doctype
        self.parser.StartElementHandler = self.start
        self.parser.EndElementHandler = self.end
        self.parser.CharacterDataHandler = self.text

    @property
    def place(self) -> str:
        """Current position, "file:line"."""
        return f"{self.source}:{self.parser.CurrentLineNumber}"

    def sections(self, data: bytes) -> dict[str, _Open]:
        """Parse the file; return the elements under `<scene>` by name."""
        try:
            with np.errstate(over="raise", divide="raise", invalid="raise"):
                self.parser.Parse(data, True)
        except expat.ExpatError as error:
            place = f"{self.source}:{error.lineno}"
            raise SceneError(f"{place}: not well-formed XML: {expat.ErrorString(error.code)}") from None
        except (LookupError, ValueError) as error:
            raise SceneError(f"{self.source}:1: cannot decode the file: {error}") from None
        finally:
            let_go(self.parser)
        return self.done

    def doctype(self, *_: object) -> None:
        """Refuse a document type declaration."""
        raise SceneError(f"{self.place}: <!DOCTYPE>: document types and entities are not allowed in a scene")

    def start(self, name: str, attributes: dict[str, str]) -> None:
        """Handle a start tag: check the element and its attributes."""
        if len(self.open) > DEEPEST + 1:
            raise SceneError(f"{self.place}: <{name}> {TOO_DEEP}")
        opened = _Open(self.element(name), self.place, {})
        for attribute, text in attributes.items():
            opened.values[attribute] = self.located(_value(opened, attribute, text), opened, attribute)
        for attribute, kind in opened.element.parameters.items():
            if kind.default is REQUIRED and attribute not in attributes:
                raise opened.fail(f'needs the attribute {attribute}="...": expected {kind.expects}')
        self.open.append(opened)
        if opened.element is DEFINE:
            self.parser.buffer_text = False

    def located(self, value: Any, opened: _Open, attribute: str) -> Any:
        """The value of an attribute; the name of a file is relative to the scene's folder."""
        kind = opened.element.parameters[attribute]
        if not isinstance(kind, File) or not value:
            return value
        folder = Path(self.source).absolute().parent
        path = folder / value
        if kind.inside and not self.files_outside and not path.resolve().is_relative_to(folder.resolve()):
            expected = "expected a file in the folder of the scene, or --allow-files-outside"
            raise opened.fail(f"{attribute}={_quote(value)}: {expected}")
        return validate_value(attribute, str(path), kind, opened.fail)

    def element(self, name: str) -> Element:
        """The element of this name, if it is allowed here."""
        if not self.open:
            allowed: Mapping[str, Element] = {SCENE.name: SCENE}
        elif self.open[-1].element is SCENE:
            allowed = SECTIONS
        elif self.open[-1].element is DEFINE:
            allowed = {PARAMETER.name: PARAMETER}
        else:
            allowed = self.formulas if name in self.formulas else self.all_formulas()
            if self.open[-1].element.children[1] == 0:
                raise self.open[-1].fail(f"takes no elements inside it, found <{name}>")
        if name not in allowed:
            known = {SCENE.name, PARAMETER.name, *SECTIONS, *self.all_formulas()}
            wrong, meant = ("cannot stand here", "") if name in known else ("is not a known element", name)
            raise SceneError(f"{self.place}: <{name}> {wrong}; {hint(meant, allowed, '<{}>', LISTED)}")
        if name in self.done:
            raise SceneError(f"{self.place}: <{name}> may only stand once in a scene")
        return allowed[name]

    def all_formulas(self) -> Mapping[str, Element]:
        """Formulas by name, those of installed packages too, which take long to find."""
        formulas()
        self.formulas = {**registered_formulas(), **self.formulas}
        return self.formulas

    def end(self, name: str) -> None:
        """Handle an end tag: build the node."""
        closed = self.open.pop()
        if isinstance(closed.element, TopElement):
            self.close_section(closed)
            return
        try:
            node = closed.element.of_checked(closed.values, closed.children, closed.place)
        except SceneError as error:
            placed = str(error).startswith(f"{self.source}:")
            raise error if placed else SceneError(f"{closed.place}: {error}") from None
        except (ArithmeticError, ValueError):
            raise closed.fail(TOO_LARGE) from None
        self.open[-1].children.append(node)

    def close_section(self, closed: _Open) -> None:
        """Store an element that is no formula."""
        section = closed.element
        if section is PARAMETER:
            self.open[-1].declared.append(_parameter(closed.values, closed.fail))
            if len(self.open[-1].declared) > MOST_DEFINED:
                raise closed.fail(f"expected at most {MOST_DEFINED} of them in a definition")
        elif section is DEFINE:
            self.define(closed)
        elif isinstance(section, TopElement) and section.part:
            self.parts.append(section.part(place=closed.place, **closed.values))
            if not section.many:
                self.done[section.name] = closed
        elif section is not SCENE:
            if len(closed.children) < closed.element.children[0]:
                raise closed.fail("expected at least one element inside it")
            self.done[closed.element.name] = closed
        elif SOLID.name not in self.done:
            raise closed.fail(f"expected <{SOLID.name}> inside it")

    def define(self, closed: _Open) -> None:
        """Add the formula of a definition."""
        self.parser.buffer_text = True
        if sum(isinstance(formula, Defined) for formula in self.formulas.values()) == MOST_DEFINED:
            raise closed.fail(f"expected at most {MOST_DEFINED} definitions in a scene")
        made = _make_definition(closed.values, closed.declared, closed.lines, self.source)
        if made.name in self.formulas:
            raise closed.fail(f"name={_quote(made.name)}: expected one definition of this name")
        self.formulas[made.name] = made

    def text(self, text: str) -> None:
        """Keep the lines of a definition; refuse other text than white space elsewhere."""
        opened = self.open[-1]
        if opened.element is DEFINE:
            line = self.parser.CurrentLineNumber
            before = opened.lines.get(line, " " * self.parser.CurrentColumnNumber)
            opened.lines[line] = before + text.rstrip("\n")
            opened.characters += len(text)
            if opened.characters > LONGEST_TEXT:
                raise opened.fail(f"has a text of more than {LONGEST_TEXT} characters")
        elif text.strip():
            shown = " ".join(text.split())[:40]
            raise opened.fail(f"holds the text {shown!r}: expected elements only")


def _value(opened: _Open, attribute: str, text: str) -> Any:
    """Parse an attribute of an element."""
    kind = opened.element.parameters.get(attribute)
    if kind is None:
        near = hint(attribute, opened.element.parameters)
        raise opened.fail(f"{attribute}={_quote(text)}: is not an attribute of it; {near}")
    try:
        return kind.read(text)
    except ValueError as error:
        raise opened.fail(f"{attribute}={_quote(text)}: expected {error}") from None


def _quote(text: str) -> str:
    """A value as one short quoted line."""
    line = printable(text)
    return f'"{line if len(line) <= 60 else line[:57] + "..."}"'


def _parameter(values: Mapping[str, Any], fail: Callable[[str], SceneError]) -> tuple[str, Parameter]:
    """Make the kind of a declared parameter."""
    default = values["default"]
    limits = {name: values[name] for name in ("least", "most") if values.get(name) is not None}
    kind = Vector(default, "", **limits) if len(default) == 3 else Number(default[0], "", **limits)
    try:
        kind.check(kind.default)
    except ValueError as error:
        raise fail(f'default="{kind.text(kind.default)}": expected {error}') from None
    return values["name"], kind


def _make_definition(
    values: Mapping[str, Any], parameters: list[tuple[str, Parameter]], lines: Mapping[int, str], source: str
) -> Defined:
    """Make the formula of a `<define>`."""
    used = [number for number, line in lines.items() if line.strip()]
    first, last = (min(used), max(used)) if used else (min(lines, default=1), 0)
    text = "\n".join(lines.get(number, "").rstrip() for number in range(first, last + 1))
    definition = Definition(
        **values, parameters=tuple(parameters), text=textwrap.dedent(text), place=(source, first)
    )
    if definition.name in SECTIONS or definition.name in (PARAMETER.name, "scene"):
        raise definition.fail(1, "expected a name that no other element has")
    return formula(definition)
