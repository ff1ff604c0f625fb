"""`<define>` of a scene file: the lines of its text, and its formula."""

from __future__ import annotations

import textwrap
from collections.abc import Callable, Iterator, Mapping
from math import isfinite
from typing import Any

from ..common.parameters import Number, Parameter, Vector
from ..errors import SceneError
from ..formulas.definitions import Defined, Definition, formula
from .layout import DEFINE, PARAMETER, SECTIONS, Element


def parameter(values: Mapping[str, Any], fail: Callable[[str], SceneError]) -> tuple[str, Parameter]:
    """Make the kind of a declared parameter."""
    default = values["default"]
    limits = {name: values[name] for name in ("least", "most") if values.get(name) is not None}
    kind = Vector(default, "", **limits) if len(default) == 3 else Number(default[0], "", **limits)
    try:
        kind.check(kind.default)
    except ValueError as error:
        raise fail(f'default="{kind.text(kind.default)}": expected {error}') from None
    return values["name"], kind


def make_definition(
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


def write_definition(definition: Definition) -> Iterator[str]:
    """Write a definition."""
    values = {name: getattr(definition, name) for name in DEFINE.parameters}
    yield f"  <{DEFINE.name}{attributes(DEFINE, values)}>"
    for name, kind in definition.parameters:
        default = kind.default if isinstance(kind, Vector) else (kind.default,)
        limits = {limit: value for limit in ("least", "most") if isfinite(value := getattr(kind, limit))}
        given = {"name": name, "default": default, **limits}
        yield f"    <{PARAMETER.name}{attributes(PARAMETER, given)}/>"
    from html import escape  # its table of entities takes a millisecond

    for line in definition.text.split("\n"):
        yield f"    {escape(line, quote=False)}".rstrip()
    yield f"  </{DEFINE.name}>"


def attributes(element: Element, values: Mapping[str, Any]) -> str:
    """Attributes that differ from their defaults, as XML."""
    from html import escape

    kinds = element.parameters
    changed = {name: value for name, value in values.items() if value != kinds[name].default}
    return "".join(f' {name}="{escape(kinds[name].text(value))}"' for name, value in changed.items())
