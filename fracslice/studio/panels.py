"""What a page shows of elements: a control for each attribute, made from the registry; lists of them."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from ..common.parameters import REQUIRED, Choice, Count, File, Flag, Length, Number, Parameter, Vector
from ..fields.registry import Formula
from ..fields.varying import Variable
from ..scene.layout import SECTIONS, formulas
from .document import Document, Tag, element_of

Control = dict[str, Any]
"""Of an attribute, as JSON: its name, kind, text, limits, help."""

SPAN = 2.0
"""Range of a slider without limits, relative to the value or the default, whichever is larger."""

COLOURS = {"colour", "background", "horizon", "ground"}
"""Attributes of three numbers from 0 to 1 that are colours."""

THUMBNAILS = Path(__file__).with_name("thumbnails.webp")
"""Small pictures of shipped scenes and of shapes, in rows; their names are in the .json file beside it."""

CELL, COLUMNS = (120, 90), 12
"""Width and height of a picture, pixels, and pictures of a row."""

PARTS = "camera", "light", "film", "shading", "fog", "print"
"""Elements beside the solid that a scene may be given."""


def controls(tag: Tag) -> list[Control]:
    """Controls of the attributes of an element; none of one that is not known."""
    element = element_of(tag.name)
    if element is None:
        return []
    return [_control(name, kind, tag.attributes.get(name)) for name, kind in element.parameters.items()]


def _control(name: str, kind: Parameter, text: str | None) -> Control:
    """Control of an attribute; `text`: its value, None where it is not given."""
    default = "" if kind.default is REQUIRED or kind.default is None else kind.text(kind.default)
    shown = default if text is None else text
    made = {"name": name, "text": shown, "given": text is not None, "default": default}
    made |= {"doc": kind.doc, "expects": kind.expects, "kind": "text"}
    if isinstance(kind, Choice):
        return made | {"kind": "choice", "choices": list(kind.choices)}
    if isinstance(kind, Flag):
        return made | {"kind": "choice", "choices": ["yes", "no"]}
    if isinstance(kind, (File, Length)):
        return made
    numbers = _numbers(shown)
    if name in COLOURS and isinstance(kind, Vector) and (numbers is None or len(numbers) % 3 == 0):
        given = numbers or [1.0, 1.0, 1.0]
        stops = [_hex(given[i : i + 3]) for i in range(0, len(given), 3)]
        return made | {"kind": "colours", "stops": stops, "most": max(kind.sizes) // 3}
    if isinstance(kind, Count) and numbers and len(numbers) == 1:
        limit = min(kind.most, max(4 * kind.least, 32, 2 * int(numbers[0])))
        return made | {"kind": "slider", "values": numbers, "least": kind.least, "most": limit, "step": 1.0}
    if isinstance(kind, (Number, Vector, Variable)) and numbers:
        least, most = _range(kind, numbers, _numbers(default) or [])
        step = 1.0 if getattr(kind, "whole", False) else 10.0 ** math.floor(math.log10(most - least) - 2.5)
        return made | {"kind": "slider", "values": numbers, "least": least, "most": most, "step": step}
    return made


def _numbers(text: str) -> list[float] | None:
    """Numbers of a text; None if it holds anything else, or nothing."""
    try:
        return [float(word) for word in text.split()] or None
    except ValueError:
        return None


def _range(kind: Any, values: list[float], default: list[float]) -> tuple[float, float]:
    """Range of the sliders of some numbers: the limits of their kind, where it has any."""
    size = max([abs(v) for v in (*values, *default)] + [0.5]) * SPAN
    size = float(f"{size:.1g}")
    low = kind.least if math.isfinite(kind.least) else kind.above if math.isfinite(kind.above) else -size
    high = kind.most if math.isfinite(kind.most) else kind.below if math.isfinite(kind.below) else size
    low, high = max(low, -100 * size), min(high, max(size, low + size))
    least = low + (high - low) * 1e-3 if low == kind.above else low
    return min(least, *values), max(high, *values)


def _hex(colour: list[float]) -> str:
    """A colour of three numbers from 0 to 1 as a browser writes it."""
    return "#" + "".join(f"{round(255 * min(max(c, 0.0), 1.0)):02x}" for c in colour)


def colour_text(stops: list[str]) -> str:
    """The numbers of colours that a browser wrote, such as #ff8800: one, or the stops of a gradient."""
    return " ".join(f"{int(stop[i : i + 2], 16) / 255:.3g}" for stop in stops for i in (1, 3, 5))


def outline(document: Document) -> list[dict[str, Any]]:
    """The elements of a scene as rows of a tree: place, depth, name, what it is given, whether it is off."""
    chosen, rows = document.version.at, list[dict[str, Any]]()
    for tag in document.root.walk():
        if tag.place:
            given = " ".join(f"{name} {value}" for name, value in tag.attributes.items())
            given = given if len(given) <= 40 else given[:37] + "..."
            about = {"name": tag.name, "given": given, "chosen": tag.place == chosen, "off": False}
            rows.append({"place": list(tag.place), "start": tag.start, **about})
        for off in tag.off:
            about = {"name": off.name, "given": "off", "chosen": False, "off": True}
            rows.append({"place": list(off.above), "start": off.start, **about})
    for row in rows:
        row["depth"] = len(row["place"]) - (0 if row["off"] else 1)
    return sorted(rows, key=lambda row: row["start"])


def places_of_pictures() -> dict[str, str]:
    """Where the picture of a scene or a shape is in `THUMBNAILS`, as a CSS background position."""
    names = json.loads(THUMBNAILS.with_suffix(".json").read_text(encoding="utf-8"))
    cells = (divmod(number, COLUMNS) for number in range(len(names)))
    return {
        name: f"{-column * CELL[0]}px {-row * CELL[1]}px"
        for name, (row, column) in zip(names, cells, strict=True)
    }


def choices() -> list[dict[str, str]]:
    """All elements that a scene may hold, with their kind and their help, for a search."""
    return list(_choices())


def _choices() -> Iterator[dict[str, str]]:
    for formula in sorted(formulas(), key=lambda formula: formula.name):
        yield {"name": formula.name, "kind": formula.kind, "doc": _first_line(formula)}
    for name in PARTS:
        yield {"name": name, "kind": "part", "doc": SECTIONS[name].doc.partition("\n")[0]}


def _first_line(formula: Formula) -> str:
    return (formula.function.__doc__ or "").strip().partition("\n")[0]
