"""Documentation of every element, and stub files of formulas as functions, generated from the registry."""

from __future__ import annotations

import ast
import inspect
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from .. import formulas as formula_package
from ..common.messages import hint
from ..common.parameters import REQUIRED
from ..errors import SceneError
from ..formulas import vocabulary
from ..formulas.node import docstring, signature
from ..formulas.plugins import origin
from ..formulas.registry import Formula, Node, get, names
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
        exported = sorted(vocabulary.NAMES) if node.module == "vocabulary" else [a.name for a in node.names]
        lines += [
            f"from {'.' * node.level}{node.module} import {name} as {name}" for name in exported if node.level
        ]
    imported = {alias.name for node in imports for alias in node.names}
    made = [name for name in _shipped_formulas() if name not in imported]
    return "\n".join([*lines, *(f"\n{_function(get(name))}" for name in made)]) + "\n"


def _shipped_formulas() -> list[str]:
    """Names of the formulas of this package."""
    return [name for name in names() if get(name).function.__module__.startswith(formula_package.__name__)]


def package_stub(modules: Mapping[str, str]) -> str:
    """Text of the stub file of `fracslice`: its public names, and every formula."""
    exported = {**modules, **dict.fromkeys(_shipped_formulas(), "formulas")}
    lines = sorted(f"from .{module} import {name} as {name}" for name, module in exported.items())
    return "\n".join([_MADE, *lines, ""])


_MADE = "# Made from the registry of formulas by `python docs/generate.py`; do not edit."
_HEAD = f"""\
{_MADE}
from collections.abc import Sequence
from typing import Literal, Union
"""


def _function(formula: Formula) -> str:
    """Function of a formula in the stub file."""
    text = re.sub(r"\b(?:fracslice\.formulas\.\w+|collections\.abc)\.", "", str(signature(formula, Node)))
    body = docstring(formula).replace("\n", "\n    ").replace("\n    \n", "\n\n")
    return f'def {formula.name}{text}:\n    """{body}\n    """'
