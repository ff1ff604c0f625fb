"""Generated from the registry: documentation of every element, stubs of formulas as functions, and the
RELAX NG schema of scene files, for completion and validation in editors.

Schema: Clark and Murata 2001, "RELAX NG Specification"; data types of XML Schema part 2; documentation and
defaults as in "RELAX NG DTD Compatibility" (OASIS 2001). Constraints between attributes (min < max) are
beyond the grammar; only the reader checks them.
"""

from __future__ import annotations

import ast
import inspect
import math
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as Tree

from .. import formulas as formula_package
from ..common.messages import hint
from ..common.parameters import (
    MILLIMETRES,
    REQUIRED,
    Axis,
    Choice,
    Count,
    Digest,
    File,
    Holes,
    Label,
    Length,
    Number,
    Points,
    Vector,
)
from ..errors import SceneError
from ..expr import vocabulary
from ..fields.node import docstring, signature
from ..fields.registry import Formula, Node, get, names, origin
from ..fields.varying import Variable
from .layout import DEFINE, LISTED, PARAMETER, SCENE, SECTIONS, Element, Identifier, formulas
from .view import AttributePath, Keys, Seconds

_GROUPS = {
    "shape": ("Shapes", "Solids. They contain no elements."),
    "csg": ("CSG operators", "One solid from the elements inside."),
    "domain": (
        "Domain operators",
        "The element inside, moved, copied or deformed. Several elements are a union.",
    ),
}


def markdown() -> str:
    """Return the sections of all elements."""
    return "\n".join(_page())


def _page() -> Iterator[str]:
    yield "## The frame\n"
    for section in (SCENE, *SECTIONS.values(), PARAMETER):
        yield from _described(section)
    for kind, (title, doc) in _GROUPS.items():
        yield f"## {title}\n\n{doc}\n"
        for formula in formulas():
            if formula.kind == kind:
                yield from _described(formula, f"Python: `{_call(formula)}`\n")


def _call(formula: Formula) -> str:
    """Python call of a formula, with its defaults."""
    result = inspect.signature(formula).parameters.values()
    return f"{formula.name}({', '.join(str(p.replace(annotation=p.empty)) for p in result)})"


def _described(element: Element, call: str | None = None) -> Iterator[str]:
    yield f"### `<{element.name}>`\n\n{prose(element.doc)}\n"
    yield from filter(None, [call])
    if element.parameters:
        yield "| attribute | default | expected | meaning |\n|---|---|---|---|"
        for name, kind in element.parameters.items():
            cells = (f"`{name}`", _code(default(kind)), kind.expects, kind.doc)
            yield "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"
        yield ""


def _code(text: str) -> str:
    return f"`{text}`" if text not in ("", "required") else text


def default(kind: Any) -> str:
    """Return the default of a parameter as text."""
    if kind.default is REQUIRED:
        return "required"
    return "" if kind.default is None else str(kind.text(kind.default))


def prose(doc: str) -> str:
    """Return a docstring without its indentation."""
    return inspect.cleandoc(doc)


def summary(doc: str) -> str:
    """Return the first paragraph of a docstring on one line."""
    return " ".join(doc.split("\n\n")[0].split())


def overview() -> str:
    """Return every formula with its summary, as plain text."""
    lines = []
    for kind, (title, _) in _GROUPS.items():
        members = [formula for formula in formulas() if formula.kind == kind]
        lines += [f"{title}:", *(f"  {f.name:<21} {summary(f.doc)}{_source(f)}" for f in members), ""]
    return "\n".join(lines[:-1])


def _source(formula: Formula) -> str:
    """Note on a formula from outside this package."""
    place = origin(formula)
    return "" if place == "fracslice" else f" [{place}]"


def page(name: str) -> str:
    """Return the documentation of one element, as plain text."""
    elements: list[Element] = [SCENE, PARAMETER, *SECTIONS.values(), *formulas()]
    known = {element.name: element for element in elements}
    if name not in known:
        raise SceneError(f"{name}: no such formula; {hint(name, known, where=LISTED)}")
    element = known[name]
    lines = [f"<{name}>", "", prose(element.doc)]
    for attribute, kind in element.parameters.items():
        usual = default(kind)
        value = usual if usual == "required" else f"default {usual}" if usual else "optional"
        lines += ["", f"{attribute}  ({value})", f"    {kind.doc}", f"    expected: {kind.expects}"]
    return "\n".join(lines)


def stub() -> str:
    """Text of the stub file of `fracslice.formulas`: formulas as functions, all other names re-exported."""
    package = Path(formula_package.__file__)
    imports = [
        n for n in ast.parse(package.read_text(encoding="utf-8")).body if isinstance(n, ast.ImportFrom)
    ]
    lines = [_HEAD]
    for node in imports:
        exported = sorted(vocabulary.NAMES) if node.names[0].name == "*" else [a.name for a in node.names]
        lines += [
            f"from {'.' * node.level}{node.module} import {name} as {name}" for name in exported if node.level
        ]
    imported = {alias.name for node in imports for alias in node.names}
    made = [name for name in _shipped_formulas() if name not in imported]
    return "\n".join([*lines, *(f"\n{_function(get(name))}" for name in made)]) + "\n"


def _shipped_formulas() -> list[str]:
    """Names of the formulas of this package."""
    package = formula_package.__name__.partition(".")[0] + "."
    return [name for name in names() if get(name).function.__module__.startswith(package)]


def package_stub(modules: Mapping[str, str]) -> str:
    """Text of the stub file of `fracslice`: its public names, and every formula."""
    packages = {path.parent.name for path in Path(__file__).parents[1].glob("*/__init__.py")}
    formulas = [name for name in _shipped_formulas() if name not in packages]
    exported = {**dict.fromkeys(formulas, "formulas"), **modules}
    lines = sorted(f"from .{module} import {name} as {name}" for name, module in exported.items())
    return "\n".join([_MADE, *lines, ""])


_MADE = "# Made from the registry of formulas by `python docs/generate.py`; do not edit."
_HEAD = f"""\
{_MADE}
from collections.abc import Callable, Sequence
from typing import Any, Literal, Union
"""


def _function(formula: Formula) -> str:
    """Function of a formula in the stub file."""
    text = re.sub(
        r"\b(?:fracslice\.fields\.\w+|collections\.abc|typing)\.", "", str(signature(formula, Node))
    )
    body = docstring(formula).replace("\n", "\n    ").replace("\n    \n", "\n\n")
    return f'def {formula.name}{text}:\n    """{body}\n    """'


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
    Variable: _text,
    Count: _count,
    Vector: _vector,
    Axis: _choices,
    Choice: _choices,
    Length: _length,
    Digest: _digest,
    File: _text,
    Label: _text,
    Points: _text,
    Holes: _text,
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
