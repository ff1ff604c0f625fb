"""RELAX NG schema of scene files, generated from the registry, for completion and validation in editors.

Clark and Murata 2001, "RELAX NG Specification"; data types of XML Schema part 2; documentation and defaults
as in "RELAX NG DTD Compatibility" (OASIS 2001). Constraints between attributes (min < max) are beyond the
grammar; only the reader checks them.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as Tree

from ..common.parameters import (
    MILLIMETRES,
    REQUIRED,
    Axis,
    Choice,
    Count,
    Digest,
    File,
    Length,
    Number,
    Vector,
)
from .animation import AttributePath, Keys, Seconds
from .layout import DEFINE, PARAMETER, SCENE, SECTIONS, Element, Identifier, formulas

PATH = Path(__file__).with_name("scene.rng")
"""The shipped schema."""

OPEN = PATH.with_name("scene-define.rng")
"""The shipped schema of scenes that define formulas."""

_NOTES = "http://relaxng.org/ns/compatibility/annotations/1.0"
_FACETS = {"above": "minExclusive", "least": "minInclusive", "below": "maxExclusive", "most": "maxInclusive"}
_LENGTH = rf"\s*\+?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+\-]?[0-9]+)?\s*({'|'.join(MILLIMETRES)})?\s*"


def relaxng() -> str:
    """Return the schema in XML form."""
    grammar = Tree.Element(
        "grammar",
        {
            "xmlns": "http://relaxng.org/ns/structure/1.0",
            "xmlns:a": _NOTES,
            "datatypeLibrary": "http://www.w3.org/2001/XMLSchema-datatypes",
        },
    )
    Tree.SubElement(Tree.SubElement(grammar, "start"), "ref", name="scene")
    for frame in (SCENE, PARAMETER):
        _define(grammar, frame)
    for section in SECTIONS.values():
        _define(grammar, section)
    choice = Tree.SubElement(Tree.SubElement(grammar, "define", name="formula"), "choice")
    for formula in formulas():
        Tree.SubElement(choice, "ref", name=formula.name)
        _define(grammar, formula)
    return _text_of(grammar)


def open_relaxng() -> str:
    """Return the schema of scenes that define formulas: elements of other names may hold any attributes."""
    grammar = Tree.Element("grammar", {"xmlns": "http://relaxng.org/ns/structure/1.0"})
    Tree.SubElement(grammar, "include", href=PATH.name)
    body = Tree.SubElement(Tree.SubElement(grammar, "define", name="formula", combine="choice"), "element")
    others = Tree.SubElement(Tree.SubElement(Tree.SubElement(body, "anyName"), "except"), "choice")
    for name in (SCENE.name, PARAMETER.name, *SECTIONS, *(formula.name for formula in formulas())):
        Tree.SubElement(others, "name").text = name
    attribute = Tree.SubElement(Tree.SubElement(body, "zeroOrMore"), "attribute")
    Tree.SubElement(attribute, "anyName")
    return _text_of(grammar)


def _text_of(grammar: Tree.Element) -> str:
    Tree.indent(grammar)
    return Tree.tostring(grammar, encoding="unicode", xml_declaration=False) + "\n"


def _define(grammar: Tree.Element, element: Element) -> None:
    define = Tree.SubElement(grammar, "define", name=element.name)
    body = Tree.SubElement(define, "element", name=element.name)
    Tree.SubElement(body, "a:documentation").text = " ".join(element.doc.split("\n\n")[0].split())
    for name, kind in element.parameters.items():
        _attribute(body, name, kind)
    if element is SCENE:
        inside = Tree.SubElement(body, "interleave")
        for section in SECTIONS.values():
            often = inside
            if section.part or section.many:
                often = Tree.SubElement(inside, "zeroOrMore" if section.many else "optional")
            Tree.SubElement(often, "ref", name=section.name)
    elif element is DEFINE:
        mixed = Tree.SubElement(body, "mixed")
        Tree.SubElement(Tree.SubElement(mixed, "zeroOrMore"), "ref", name=PARAMETER.name)
    elif element.children[1] != 0:
        Tree.SubElement(Tree.SubElement(body, "oneOrMore"), "ref", name="formula")


def _attribute(body: Tree.Element, name: str, kind: Any) -> None:
    required = kind.default is REQUIRED
    parent = body if required else Tree.SubElement(body, "optional")
    attribute = Tree.SubElement(parent, "attribute", name=name)
    if not required and kind.default is not None:
        attribute.set("a:defaultValue", kind.text(kind.default))
    Tree.SubElement(attribute, "a:documentation").text = f"{kind.doc} ({kind.expects})"
    _PATTERNS[type(kind)](attribute, kind)


def _number(parent: Tree.Element, kind: Number) -> None:
    _data(parent, "double", kind)


def _count(parent: Tree.Element, kind: Count) -> None:
    if kind.words:
        parent = Tree.SubElement(parent, "choice")
    for word in kind.words:
        Tree.SubElement(parent, "value").text = word
    _data(parent, "integer", kind)


def _vector(parent: Tree.Element, kind: Vector) -> None:
    first = kind.sizes[0]
    if len(kind.sizes) > 2 and all(size % first == 0 for size in kind.sizes):
        # Any multiple of the first size, for brevity; the reader checks the maximum.
        group = Tree.SubElement(Tree.SubElement(parent, "list"), "oneOrMore")
        _items(Tree.SubElement(group, "group"), kind, first)
        return
    if len(kind.sizes) > 1:
        parent = Tree.SubElement(parent, "choice")
    for size in kind.sizes:
        _items(Tree.SubElement(parent, "list"), kind, size)


def _items(parent: Tree.Element, kind: Vector, count: int) -> None:
    for _ in range(count):
        _data(parent, "integer" if kind.whole else "double", kind)


def _choices(parent: Tree.Element, kind: Choice) -> None:
    values = Tree.SubElement(parent, "choice") if len(kind.choices) > 1 else parent
    for word in kind.choices:
        Tree.SubElement(values, "value").text = word


def _identifier(parent: Tree.Element, _: Identifier) -> None:
    _param(Tree.SubElement(parent, "data", type="string"), "pattern", "[a-z][a-z0-9_]*")


def _text(parent: Tree.Element, _: File | Seconds | AttributePath | Keys) -> None:
    Tree.SubElement(parent, "data", type="string")


def _digest(parent: Tree.Element, _: Digest) -> None:
    _param(Tree.SubElement(parent, "data", type="string"), "pattern", "[0-9a-f]{64}")


def _length(parent: Tree.Element, kind: Length) -> None:
    _param(Tree.SubElement(parent, "data", type="string"), "pattern", _LENGTH)


_PATTERNS: dict[type, Any] = {
    Number: _number,
    Count: _count,
    Vector: _vector,
    Axis: _choices,
    Choice: _choices,
    Length: _length,
    Digest: _digest,
    File: _text,
    Identifier: _identifier,
    Seconds: _text,
    AttributePath: _text,
    Keys: _text,
}


def _data(parent: Tree.Element, kind: str, limits: Number | Count | Vector) -> None:
    """Add a data type with its limits."""
    data = Tree.SubElement(parent, "data", type=kind)
    for name, facet in _FACETS.items():
        limit = getattr(limits, name, math.inf)
        if math.isfinite(limit):
            _param(data, facet, f"{int(limit) if float(limit).is_integer() else limit}")
    if kind == "double":
        _param(data, "pattern", "[^NI]*")  # excludes NaN and INF


def _param(data: Tree.Element, name: str, text: str) -> None:
    Tree.SubElement(data, "param", name=name).text = text
