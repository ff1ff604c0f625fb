"""Documentation of every element, generated from the registry."""

from __future__ import annotations

import inspect
from collections.abc import Iterator
from typing import Any

from ..common.suggestions import hint
from ..errors import SceneError
from ..formulas.parameters import REQUIRED
from ..formulas.plugins import origin
from ..formulas.registry import Formula
from .layout import LISTED, PARAMETER, SCENE, SECTIONS, Element, formulas

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
    """Return the default of a parameter as text.

    Parameters
    ----------
    kind : Parameter
        Parameter kind.

    Returns
    -------
    str
        "required" without a default; "" if omission is a choice of its own.
    """
    if kind.default is REQUIRED:
        return "required"
    return "" if kind.default is None else str(kind.text(kind.default))


def prose(doc: str) -> str:
    """Return a docstring without its indentation.

    Returns
    -------
    str
        The text.
    """
    return inspect.cleandoc(doc)


def summary(doc: str) -> str:
    """Return the first paragraph of a docstring on one line."""
    return " ".join(doc.split("\n\n")[0].split())


def overview() -> str:
    """Return every formula with its summary, as plain text.

    Returns
    -------
    str
        The list, grouped by kind.
    """
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
    """Return the documentation of one element, as plain text.

    Raises
    ------
    SceneError
        If there is no such element; the message suggests the nearest name.
    """
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
