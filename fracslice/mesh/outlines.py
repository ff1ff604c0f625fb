"""Outlines of SVG files and texts as solids of scenes: curves to segments, glyphs that HarfBuzz chooses
and places, fills to one area, and signed distances.

After "Scalable Vector Graphics (SVG) 2", W3C 2018: paths and basic shapes with transforms, groups, symbols,
uses and nested drawings; fills and fill rules by attributes, `style` and simple selectors of style sheets.
Strokes, clipping and masks are left out. Entities, texts that are no paths, and malformed values are refused.
"""

from __future__ import annotations

import cmath
import math
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple
from xml.parsers import expat

import numpy as np
from numpy.typing import NDArray

from .. import _native
from ..common.cache import key
from ..common.files import open_regular
from ..common.messages import lacking
from ..errors import MeshError
from ..expr.language import InMemory
from .models import require_unchanged

if TYPE_CHECKING:
    from shapely import Geometry


LARGEST_SVG, MOST_ELEMENTS, DEEPEST, MOST_CURVES = 8 << 20, 1 << 13, 64, 1 << 18
"""Most bytes of a file; elements that are drawn, copies counted; elements inside each other; and curves, or
segments of them.
"""
UNITS = {
    "": 1.0,
    "px": 1.0,
    "pt": 4 / 3,
    "pc": 16.0,
    "in": 96.0,
    "cm": 96 / 2.54,
    "mm": 96 / 25.4,
    "Q": 24 / 25.4,
}
"""Pixels of a unit."""
MM = 25.4 / 96
"""Millimetres of a pixel."""
INHERITED = ("fill", "fill-rule", "visibility")

_NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
_ARC = re.compile(
    r"[\s,]*".join([rf"({_NUMBER.pattern})"] * 3 + ["([01])"] * 2 + [rf"({_NUMBER.pattern})"] * 2)
)
_COMMAND = re.compile(r"([MmZzLlHhVvCcSsQqTtAa])([^MmZzLlHhVvCcSsQqTtAa]*)")
_LENGTH = re.compile(rf"\s*({_NUMBER.pattern})\s*([a-zA-Z]*)\s*")
_TRANSFORM = re.compile(r"[\s,]*(matrix|translate|scale|rotate|skewX|skewY)\s*\(([^()]*)\)")
_RULE = re.compile(r"([^{}]+)\{([^{}]*)\}")
_SELECTOR = re.compile(r"[.#]?[\w-]+")

Curve = tuple[complex, ...]
"""From where the curve before ends: a line [end], a cubic [control, control, end], or an elliptic arc
[centre, axis, axis, begin + end i] of centre + axis cos t + axis sin t.
"""


def quadratic(start: complex, middle: complex, end: complex) -> Curve:
    """A quadratic as a cubic."""
    return start + (middle - start) * (2 / 3), end + (middle - end) * (2 / 3), end


class Fill(NamedTuple):
    """What one element fills: closed rings, each a start and curves."""

    rings: list[tuple[complex, list[Curve]]]
    nonzero: bool


class Affine(NamedTuple):
    """z -> p z + q conj(z) + r."""

    p: complex = 1
    q: complex = 0
    r: complex = 0

    @classmethod
    def of(cls, a: float, b: float, c: float, d: float, e: float, f: float) -> Affine:
        """Of the numbers of `matrix(...)`."""
        return cls(complex(a + d, b - c) / 2, complex(a - d, b + c) / 2, complex(e, f))

    def __call__(self, z: complex) -> complex:
        return self.p * z + self.q * z.conjugate() + self.r

    def after(self, first: Affine) -> Affine:
        """This map of what another one gives."""
        p, q = first.p, first.q
        return Affine(
            self.p * p + self.q * q.conjugate(), self.p * q + self.q * p.conjugate(), self(first.r)
        )  # fmt: skip

    def curve(self, curve: Curve) -> Curve:
        """The curve, mapped."""
        if len(curve) != 4:
            return tuple(self(point) for point in curve)
        centre, *axes, ends = curve
        return self(centre), *(self(axis) - self.r for axis in axes), ends


@dataclass
class SvgElement:
    """Element of an SVG file: its attributes, its line, and the elements and the text inside."""

    name: str
    given: dict[str, str]
    line: int
    inside: list[SvgElement] = field(default_factory=list)
    text: str = ""

    def fail(self, message: str) -> MeshError:
        """The error to raise about this element."""
        return MeshError(f"line {self.line}: <{self.name}> {message}")

    def limit(self, count: int) -> None:
        """Raise the error about too many curves."""
        if count > MOST_CURVES:
            raise self.fail(f"expected at most {MOST_CURVES} curves in a file, found {count}")

    def length(self, name: str, default: float = 0.0) -> float:
        """An attribute that is a length, pixels."""
        if (text := self.given.get(name)) is None:
            return default
        match = _LENGTH.fullmatch(text)
        if not match or match[2] not in UNITS or not math.isfinite(float(match[1])):
            raise self.fail(f'{name}="{text:.40}": expected a number, or one with a unit such as mm')
        return float(match[1]) * UNITS[match[2]]

    def numbers(self, name: str, text: str | None = None) -> list[float]:
        """Numbers of an attribute, or of a part of it."""
        text = self.given.get(name, "") if text is None else text
        found = _NUMBER.findall(text)
        if rest := _NUMBER.sub("", text).replace(",", " ").strip():
            raise self.fail(f"{name}: expected numbers, found {rest:.20}")
        values = list(map(float, found))
        if not math.isfinite(math.fsum(values)):
            raise self.fail(f"{name}: expected finite numbers")
        return values


def read_svg(path: str) -> list[Fill]:
    """Read what an SVG file fills, mm, y up, from its own origin.

    Raises
    ------
    MeshError
        If it is no SVG file, or fills nothing.
    """
    fills = list(Drawing(tree_of(path)).drawings())
    if not fills:
        raise MeshError("has no closed path that is filled: strokes have no inside; make paths of them first")
    return fills


def tree_of(path: str) -> SvgElement:
    """Root of the elements of an SVG file."""
    with open_regular(path) as file:
        data = file.read(LARGEST_SVG + 1)
    if len(data) > LARGEST_SVG:
        raise MeshError(f"expected an SVG file of at most {LARGEST_SVG >> 20} MB")
    return _parsed(data)


def _parsed(data: bytes) -> SvgElement:
    """Root of the tree of elements."""
    parser, top = expat.ParserCreate(namespace_separator=" "), SvgElement("", {}, 0)
    open_elements = [top]

    def start(name: str, given: dict[str, str]) -> None:
        plain = {key.rpartition(" ")[2]: value for key, value in given.items()}
        made = SvgElement(name.rpartition(" ")[2], plain, parser.CurrentLineNumber)
        if len(open_elements) > DEEPEST:
            raise made.fail(f"expected at most {DEEPEST} elements inside each other")
        open_elements[-1].inside.append(made)
        open_elements.append(made)

    def text(data: str) -> None:
        if open_elements[-1].name == "style":
            open_elements[-1].text += data

    def entity(*_: object) -> None:
        raise MeshError(f"line {parser.CurrentLineNumber}: entities are not allowed in an SVG file")

    parser.StartElementHandler, parser.EndElementHandler = start, lambda _: open_elements.pop()
    parser.CharacterDataHandler, parser.EntityDeclHandler, parser.buffer_text = text, entity, True
    try:
        parser.Parse(data, True)
    except (expat.ExpatError, LookupError, ValueError) as error:
        raise MeshError(f"not an SVG file: {error}") from None
    if top.inside[0].name != "svg":
        raise MeshError(f"not an SVG file: expected <svg>, found <{top.inside[0].name:.40}>")
    return top.inside[0]


class Drawing:
    """Draws a tree of elements: what they fill."""

    names: ClassVar[frozenset[str]] = frozenset(("path", "rect", "circle", "ellipse", "polygon", "polyline"))

    def __init__(self, root: SvgElement) -> None:
        self.root, self.drawn, self.curves = root, 0, 0
        self.by_id: dict[str, SvgElement] = {}
        self.styles: dict[str, dict[str, str]] = {}
        waiting = [root]
        while waiting:
            element = waiting.pop()
            waiting.extend(reversed(element.inside))
            self.by_id.setdefault(element.given.get("id", ""), element)
            if element.name == "style":
                self.add_styles(re.sub(r"/\*.*?\*/", "", element.text, flags=re.DOTALL))

    def add_styles(self, sheet: str) -> None:
        """Keep the rules of a style sheet; those with other than simple selectors have no effect."""
        for selectors, body in _RULE.findall(sheet):
            for selector in map(str.strip, selectors.split(",")):
                if _SELECTOR.fullmatch(selector):
                    self.styles.setdefault(selector, {}).update(_declared(body))

    def style(self, element: SvgElement, inherited: dict[str, str]) -> dict[str, str]:
        """Style of an element: attributes, then style sheets, then its own `style`."""
        given = element.given
        own = {name: given[name].strip() for name in (*INHERITED, "display") if name in given}
        classes = [f".{name}" for name in given.get("class", "").split()]
        for selector in (element.name, *classes, f"#{given.get('id')}"):
            own |= self.styles.get(selector, {})
        own |= _declared(given.get("style", ""))
        kept = {name: value for name, value in own.items() if value != "inherit"}
        return {name: inherited[name] for name in INHERITED if name in inherited} | kept

    def drawings(self) -> Iterator[Any]:
        """Of all that is drawn, mm."""
        up = Affine.of(MM, 0, 0, -MM, 0, 0)
        yield from self.draw(self.root, up, {}, 0)

    def draw(self, element: SvgElement, to: Affine, inherited: dict[str, str], depth: int) -> Iterator[Fill]:
        """Fills of an element, of a map to mm and an inherited style."""
        self.drawn += 1
        if self.drawn > MOST_ELEMENTS or depth > DEEPEST:
            raise element.fail(f"expected at most {MOST_ELEMENTS} elements, {DEEPEST} inside each other")
        style = self.style(element, inherited)
        if style.get("display") == "none":
            return
        to = to.after(_transform(element))
        match element.name:
            case "svg":
                to = to.after(_viewport(element, element.given if depth else {}))
                yield from self.inside(element, to, style, depth)
            case "g" | "a" | "switch":
                yield from self.inside(element, to, style, depth)
            case "use":
                yield from self.use(element, to, style, depth)
            case "text":
                raise element.fail("expected paths: make a path of the text first")
            case name if name in self.names and style.get("visibility", "visible") == "visible":
                yield from self.shape(element, to, style)

    def shape(self, element: SvgElement, to: Affine, style: dict[str, str]) -> Iterator[Any]:
        """What a shape fills."""
        if style.get("fill") in ("none", "transparent"):
            return
        rings = [(to(start), list(map(to.curve, curves))) for start, curves in SHAPES[element.name](element)]
        self.curves += sum(len(curves) for _, curves in rings)
        element.limit(self.curves)
        if rings:
            yield Fill(rings, style.get("fill-rule") != "evenodd")

    def inside(self, element: SvgElement, to: Affine, style: dict[str, str], depth: int) -> Iterator[Fill]:
        """Fills of the elements inside."""
        for child in element.inside:
            yield from self.draw(child, to, style, depth + 1)

    def use(self, element: SvgElement, to: Affine, style: dict[str, str], depth: int) -> Iterator[Fill]:
        """Fills of the element that another one names."""
        name = element.given.get("href", "")
        used = self.by_id.get(name[1:]) if name.startswith("#") else None
        if used is None:
            raise element.fail(f'href="{name:.40}": expected the id of an element in this file')
        to = to.after(Affine(r=complex(element.length("x"), element.length("y"))))
        if used.name == "symbol":
            given = {**used.given, **{k: v for k, v in element.given.items() if k in ("width", "height")}}
            to = to.after(_viewport(used, {**given, "x": "0", "y": "0"}))
            yield from self.inside(used, to, self.style(used, style), depth + 1)
        else:
            yield from self.draw(used, to, style, depth + 1)


def _declared(text: str) -> dict[str, str]:
    """Declarations of a style."""
    pairs = (part.partition(":") for part in text.split(";"))
    return {name.strip(): value.partition("!")[0].strip() for name, _, value in pairs}


def _viewport(element: SvgElement, given: dict[str, str]) -> Affine:
    """Map of the user units of a drawing or a symbol to the pixels around it.

    `given`: its place, and its size where that is another than its own.
    """
    box = element.numbers("viewBox")
    place = SvgElement(element.name, {k: v for k, v in given.items() if k in ("x", "y")}, element.line)
    at = Affine(r=complex(place.length("x"), place.length("y")))
    if not box:
        return at
    if len(box) != 4 or box[2] <= 0 or box[3] <= 0:
        raise element.fail("viewBox: expected four numbers, with a width and a height above zero")
    sizes = {**element.given, **given}
    known = SvgElement(
        element.name,
        {k: v for k, v in sizes.items() if not v.strip().endswith("%") and v != "auto"},
        element.line,
    )
    missing = -1.0
    width, height = known.length("width", missing), known.length("height", missing)
    if width == missing:
        width = box[2] if height == missing else box[2] * height / box[3]
    if height == missing:
        height = box[3] * width / box[2]
    across, down = width / box[2], height / box[3]
    if element.given.get("preserveAspectRatio", "").strip() != "none":
        across = down = min(across, down)
    middle = complex(box[0] + box[2] / 2, box[1] + box[3] / 2)
    scale = Affine.of(across, 0, 0, down, 0, 0)
    return at.after(Affine(r=complex(width, height) / 2)).after(scale).after(Affine(r=-middle))


def _transform(element: SvgElement) -> Affine:
    """Map of the attribute `transform`."""
    text, made = element.given.get("transform", ""), Affine()
    if rest := _TRANSFORM.sub("", text).replace(",", " ").strip():
        raise element.fail(f"transform: expected matrix, translate, scale, rotate or skew, found {rest:.20}")
    for name, inner in _TRANSFORM.findall(text):
        values = element.numbers("transform", inner)
        try:
            made = made.after(_TRANSFORMS[name](*values))
        except TypeError:
            raise element.fail(f"transform: {name} with {len(values)} numbers") from None
    return made


def _rotation(degrees: float, x: float = 0.0, y: float = 0.0) -> Affine:
    turn, about = cmath.rect(1, math.radians(degrees)), complex(x, y)
    return Affine(turn, 0, about - turn * about)


_TRANSFORMS: dict[str, Callable[..., Affine]] = {
    "matrix": Affine.of,
    "translate": lambda x, y=0.0: Affine(r=complex(x, y)),
    "scale": lambda x, y=None: Affine.of(x, 0, 0, x if y is None else y, 0, 0),
    "rotate": _rotation,
    "skewX": lambda degrees: Affine.of(1, 0, math.tan(math.radians(degrees)), 1, 0, 0),
    "skewY": lambda degrees: Affine.of(1, math.tan(math.radians(degrees)), 0, 1, 0, 0),
}


Rings = Iterator[tuple[complex, list[Curve]]]
"""Starts and curves of what an element draws."""


def _polygon(element: SvgElement) -> Rings:
    values = element.numbers("points")
    if len(values) % 2:
        raise element.fail("points: expected pairs of numbers")
    points = list(map(complex, values[::2], values[1::2]))
    if points:
        yield points[0], [(point,) for point in points[1:]]


def _ellipse(element: SvgElement) -> Rings:
    radius = element.length("r")
    rx, ry = element.length("rx", radius), element.length("ry", radius)
    centre = complex(element.length("cx"), element.length("cy"))
    if rx > 0 and ry > 0:
        yield centre + rx, [(centre, rx, 1j * ry, complex(0, math.tau))]


def _rectangle(element: SvgElement) -> Rings:
    x, y, w, h = map(element.length, ("x", "y", "width", "height"))
    if w <= 0 or h <= 0:
        return
    rx = element.length("rx", element.length("ry"))
    ry = min(element.length("ry", rx), h / 2)
    rx = min(rx, w / 2)
    corners = ((x + w - rx, y + ry), (x + w - rx, y + h - ry), (x + rx, y + h - ry), (x + rx, y + ry))
    curves: list[Curve] = []
    for k, centre in enumerate(complex(*corner) for corner in corners):
        begin, end = (k - 1) * math.pi / 2, k * math.pi / 2
        ends = [centre + complex(rx * round(math.cos(t)), ry * round(math.sin(t))) for t in (begin, end)]
        curves.append((ends[0],))
        if rx > 0 and ry > 0:
            curves += [(centre, rx, 1j * ry, complex(begin, end)), (ends[1],)]
    yield curves[0][0], curves[1:]


def _path(element: SvgElement) -> Rings:
    """Rings of path data; each is closed, as a fill is."""
    return iter(PathReader(element).rings)


class PathReader:
    """Reads path data."""

    def __init__(self, element: SvgElement) -> None:
        self.element, self.rings, self.closed = element, list[tuple[complex, list[Curve]]](), set[int]()
        self.at = self.start = 0j
        # Last control point, after the letter of its curve: C, Q, or none.
        self.control: tuple[str, complex] = ("", 0j)
        self.curves: list[Curve] | None = None  # of the ring that is open
        text = element.given.get("d", "")
        if rest := text[: text.find(first[0]) if (first := _COMMAND.search(text)) else None].strip():
            raise element.fail(f"d: expected a command such as M, found {rest:.20}")
        commands = _COMMAND.findall(text)
        element.limit(len(commands))
        for command, inner in commands:
            self.command(command, inner)

    def command(self, command: str, inner: str) -> None:
        """Follow a command with all its numbers."""
        kind, relative = command.upper(), command.islower()
        if not self.rings and kind != "M":
            raise self.element.fail(f"d: expected M first, found {command}")
        values = self.arcs(inner) if kind == "A" else self.element.numbers("d", inner)
        count = _COUNTS[kind]
        if (len(values) % count or not values) if count else values:
            raise self.element.fail(f"d: {command} with {len(values)} numbers")
        self.element.limit(len(values) // (count or 1))
        if kind == "Z":
            self.close()
        for i in range(0, len(values), count or 1):
            origin = self.at if relative else 0j
            part = values[i : i + count]
            if kind in "HV":
                part = (
                    [part[0] + origin.real, self.at.imag]
                    if kind == "H"
                    else [self.at.real, part[0] + origin.imag]
                )
                self.add((complex(*part),))
            elif kind == "A":
                self.arc(part, origin + complex(part[5], part[6]))
            else:
                points = [origin + complex(x, y) for x, y in zip(part[::2], part[1::2], strict=True)]
                self.go("L" if kind == "M" and i else kind, points)

    def arcs(self, inner: str) -> list[float]:
        """Numbers of arcs, whose flags need nothing between them."""
        if rest := _ARC.sub("", inner).replace(",", " ").strip():
            raise self.element.fail(f"d: expected seven numbers of an arc, found {rest:.20}")
        return [float(word) for words in _ARC.findall(inner) for word in words]

    def go(self, kind: str, points: Sequence[complex]) -> None:
        """Follow a command with points."""
        if kind == "M":
            self.at = self.start = points[0]
            self.curves = []
            self.rings.append((self.start, self.curves))
            self.control = ("", 0j)
            return
        of = "C" if kind in "CS" else "Q"
        if kind in "ST":
            points = [2 * self.at - self.control[1] if self.control[0] == of else self.at, *points]
        control = (of, points[-2]) if kind != "L" else ("", 0j)
        if kind in "QT":
            points = quadratic(self.at, *points)
        self.add(tuple(points))
        self.control = control

    def add(self, curve: Curve, end: complex | None = None) -> None:
        """Add a curve to the ring; after a closed one a new ring begins where it began."""
        if self.curves is None:
            self.curves = []
            self.rings.append((self.start, self.curves))
        self.curves.append(curve)
        self.at, self.control = curve[-1] if end is None else end, ("", 0j)

    def close(self) -> None:
        self.closed.add(len(self.rings) - 1)
        self.at, self.curves, self.control = self.start, None, ("", 0j)

    def arc(self, values: list[float], end: complex) -> None:
        """Add an arc by its end points, after appendix B.2 of the specification."""
        rx, ry, turn = abs(values[0]), abs(values[1]), cmath.rect(1, math.radians(values[2]))
        large, sweep = values[3] != 0, values[4] != 0
        if rx == 0 or ry == 0 or end == self.at:
            self.add((end,))
            return
        half = (self.at - end) / 2 / turn
        unit = complex(half.real / rx, half.imag / ry)  # of a circle of radius 1
        if (scale := abs(unit)) > 1:
            rx, ry, unit = rx * scale, ry * scale, unit / scale
        away = -1j * unit / abs(unit) * math.sqrt(max(0.0, 1 - abs(unit) ** 2))
        centre = away if large != sweep else -away
        begin, change = cmath.phase(unit - centre), cmath.phase((-unit - centre) / (unit - centre))
        if sweep and change < 0:
            change += math.tau
        elif not sweep and change > 0:
            change -= math.tau
        middle = (self.at + end) / 2 + turn * complex(centre.real * rx, centre.imag * ry)
        self.add((middle, turn * rx, turn * 1j * ry, complex(begin, begin + change)), self.at)
        self.add((end,))


_COUNTS = {"M": 2, "Z": 0, "L": 2, "H": 1, "V": 1, "C": 6, "S": 4, "Q": 4, "T": 2, "A": 7}
SHAPES = {
    "path": _path, "rect": _rectangle, "circle": _ellipse, "ellipse": _ellipse, "polygon": _polygon,
    "polyline": _polygon,
}  # fmt: skip


LARGEST_FONT, MOST_CHARACTERS = 64 << 20, 1000
"""Most bytes of a font, and characters of a text."""

_VARIATION = re.compile(r"\s*([\x21-\x7e]{4})\s*=\s*([-+]?\d+\.?\d*)\s*")


def lettered(file: str, text: str, variations: str) -> list[Fill]:
    """Fills of a text in one line, in ems, from the origin along the base line.

    Raises
    ------
    MeshError
        If it is no font, or has no glyph for a character.
    """
    if reason := lacking("uharfbuzz", "texts need") or lacking("shapely", "texts need"):
        raise MeshError(reason)
    import uharfbuzz as hb

    if not 0 < len(text) <= MOST_CHARACTERS:
        raise MeshError(f"expected a text of 1 to {MOST_CHARACTERS} characters, found {len(text)}")
    font, shaped = _font(file, variations), hb.Buffer()
    shaped.add_str(text)
    shaped.guess_segment_properties()
    hb.shape(font, shaped)
    pen, x, y = _Pen(font.face.upem), 0, 0
    for glyph, place in zip(shaped.glyph_infos, shaped.glyph_positions, strict=True):
        if glyph.codepoint == 0:
            raise MeshError(f"has no glyph for {text[glyph.cluster]!r}")
        pen.begin(complex(x + place.x_offset, y + place.y_offset))
        font.draw_glyph(glyph.codepoint, pen.functions, pen)
        x, y = x + place.x_advance, y + place.y_advance
    if not pen.fills:
        raise MeshError(f"has nothing to draw for {text!r:.40}")
    return pen.fills


def _font(file: str, variations: str) -> Any:
    """Font of a file, at a place on its axes."""
    import uharfbuzz as hb

    with open_regular(file) as opened:
        data = opened.read(LARGEST_FONT + 1)
    if len(data) > LARGEST_FONT:
        raise MeshError(f"expected a font of at most {LARGEST_FONT >> 20} MB")
    face = hb.Face(hb.Blob(data))
    if not face.glyph_count:
        raise MeshError("not a font that can be read")
    font, axes = hb.Font(face), {axis.tag: axis for axis in face.axis_infos}
    chosen = {}
    for part in filter(None, variations.split(",")):
        match = _VARIATION.fullmatch(part)
        axis = axes.get(match[1]) if match else None
        if not match or axis is None or not axis.min_value <= float(match[2]) <= axis.max_value:
            ranges = (f"{a.tag}={a.min_value:g}..{a.max_value:g}" for a in axes.values())
            raise MeshError(
                f'variations="{variations:.40}": expected {", ".join(ranges) or "none, it has no axes"}'
            )
        chosen[match[1]] = float(match[2])
    font.set_variations(chosen)
    return font


class _Pen:
    """Takes the outlines of glyphs."""

    def __init__(self, em: int) -> None:
        import uharfbuzz as hb

        self.em, self.origin, self.at = em, 0j, 0j
        self.fills: list[Fill] = []
        self.curves: list[Curve] = []
        self.rings: list[tuple[complex, list[Curve]]] = []
        self.functions = hb.DrawFuncs()
        self.functions.set_move_to_func(lambda x, y, pen: pen.move(x, y))
        self.functions.set_line_to_func(lambda x, y, pen: pen.add(x, y))
        self.functions.set_quadratic_to_func(lambda a, b, x, y, pen: pen.quadratic(a, b, x, y))
        self.functions.set_cubic_to_func(lambda *numbers: numbers[-1].add(*numbers[:-1]))
        self.functions.set_close_path_func(lambda pen: None)

    def begin(self, origin: complex) -> None:
        """Begin a glyph."""
        self.origin, self.rings = origin, []

    def points(self, *numbers: float) -> list[complex]:
        """Points of a glyph, in ems."""
        return [
            (self.origin + complex(x, y)) / self.em for x, y in zip(numbers[::2], numbers[1::2], strict=True)
        ]

    def move(self, x: float, y: float) -> None:
        """Begin a ring."""
        if not self.rings:
            self.fills.append(Fill(self.rings, True))
        (self.at,), self.curves = self.points(x, y), []
        self.rings.append((self.at, self.curves))

    def add(self, *numbers: float) -> None:
        """Add a line or a cubic."""
        self.curves.append(tuple(points := self.points(*numbers)))
        self.at = points[-1]

    def quadratic(self, *numbers: float) -> None:
        """Add a quadratic, as a cubic."""
        middle, end = self.points(*numbers)
        self.curves.append(quadratic(self.at, middle, end))
        self.at = end


TOLERANCE = 5e-5
"""Largest distance of a curve from its segments, in longest sides of all curves; of texts, in ems."""
GRID = 2.0**-40
"""Distance between the places that crossings of segments can have, in longest sides: no sliver is thinner."""
MOST_CROSSINGS = 1 << 15
"""Most pairs of segments that meet, besides neighbours: each may be a corner of the outline."""
RAYS, ASKED = 1 << 10, 32
"""Points whose winding numbers, and segments whose crossings are found at once."""


@dataclass(frozen=True, eq=False)
class Outline(InMemory):
    """Closed rings whose signed distances machine code asks for; see `native/mesh/outline.h`."""

    low: tuple[float, float]  # corners of its box
    high: tuple[float, float]

    @classmethod
    def of(cls, rings: Sequence[NDArray[np.float64]]) -> Outline:
        """Outline of rings [n, 2] that do not cross, with the inside on their left."""
        corners = np.concatenate(rings)
        ends = np.cumsum([len(ring) for ring in rings])
        native, digest = _native.Outline(corners, ends), int(key("outline", corners, ends)[:16], 16)
        low, high = corners.min(0).tolist(), corners.max(0).tolist()
        return cls(digest, native, tuple(low), tuple(high))


@lru_cache(maxsize=8)
def extruded(file: str, sha256: str, size: float | None, centred: bool) -> Outline:
    """Outline of a file, scaled, its box centred at the origin or where the file has it."""
    area = sized(file, sha256, size)
    low, high = np.reshape(area.bounds, (2, 2))
    return Outline.of(rings_of(area, (low + high) / 2 if centred else np.zeros(2)))


@lru_cache(maxsize=8)
def written(file: str, sha256: str, text: str, variations: str, size: float, centred: bool) -> Outline:
    """Outline of a text in a font, of a size of the em, its box centred or its base line from the origin."""
    fills = lettered(file, text, variations)
    require_unchanged(file, sha256)
    area = area_of(fills, 1.0)
    low, high = np.reshape(area.bounds, (2, 2))
    return Outline.of([ring * size for ring in rings_of(area, (low + high) / 2 if centred else np.zeros(2))])


@lru_cache(maxsize=8)
def revolved(file: str, sha256: str, size: float | None, offset: float, centred: bool) -> Outline:
    """Outline of a file, scaled, its left edge at an offset from the y axis, its box centred or above y = 0.

    At the axis it goes on as its mirror image: no edge there is one of the solid.
    """
    area = sized(file, sha256, size)
    import shapely

    low, high = np.reshape(area.bounds, (2, 2))
    origin = np.array([low[0] - offset, (low[1] + high[1]) / 2 if centred else low[1]])
    if offset > 0:
        return Outline.of(rings_of(area, origin))
    right = shapely.transform(area, lambda points: points - origin)
    left = shapely.transform(right, lambda points: points * (-1, 1))
    return Outline.of(rings_of(shapely.union(right, left, grid_size=GRID * (high - low).max()), np.zeros(2)))


def sized(file: str, sha256: str, size: float | None) -> Geometry:
    """What a file fills, scaled about the file's origin."""
    area = _area(file, sha256)
    if size is None:
        return area
    import shapely

    low, high = np.reshape(area.bounds, (2, 2))
    scale = size / (high - low).max()
    return shapely.transform(area, lambda points: points * scale)


@lru_cache(maxsize=4)
def _area(file: str, sha256: str) -> Geometry:
    """What a file fills, mm."""
    if reason := lacking("shapely", "outlines need"):
        raise MeshError(reason)
    fills = read_svg(file)
    require_unchanged(file, sha256)
    return area_of(fills)


def area_of(fills: Iterable[Fill], detail: float | None = None) -> Geometry:
    """The area of all fills, of which each may overlap itself and others.

    Curves are within `TOLERANCE` of the longest side, or of the size of a `detail`.
    """
    import shapely

    given = list(fills)
    points = np.array(
        [p for fill in given for start, curves in fill.rings for p in samples_of(start, curves)]
    )
    if not np.isfinite(points).all() or not np.isfinite(
        extent := np.ptp(points.view(float).reshape(-1, 2), axis=0).max()
    ):
        raise MeshError("has a coordinate that is not a finite number")
    if extent == 0:
        raise MeshError("has no path with an area")
    grid = extent * GRID
    rings = [
        ([corners_of(*ring, (detail or extent) * TOLERANCE) for ring in fill.rings], fill.nonzero)
        for fill in given
    ]
    if (count := sum(len(ring) for fill, _ in rings for ring in fill)) > MOST_CURVES:
        raise MeshError(f"expected an outline of at most {MOST_CURVES} segments, found {count}")
    _require_few_crossings([ring for fill, _ in rings for ring in fill])
    areas = [shapely.coverage_union_all(_faces(*fill, grid)) for fill in rings]
    area = shapely.set_precision(shapely.union_all(areas), grid)
    if area.area == 0:
        raise MeshError("has no path with an area")
    return area


def samples_of(start: complex, curves: list[Curve]) -> Iterable[complex]:
    """Points of a ring that have nearly its box."""
    yield start
    for curve in curves:
        if len(curve) > 1:
            yield from _points(start, curve, 8)
        yield (end := _end(curve))
        start = end


def _end(curve: Curve) -> complex:
    return curve[-1] if len(curve) != 4 else complex(_points(0, curve, 1)[0])


def _points(start: complex, curve: Curve, count: int) -> NDArray[np.complex128]:
    """Points of a cubic or arc after its start, the last at its end."""
    t = np.arange(1, count + 1) / count
    if len(curve) == 4:
        centre, one, other, ends = curve
        angle = ends.real + (ends.imag - ends.real) * t
        return np.asarray(centre + one * np.cos(angle) + other * np.sin(angle))
    a, b, c = curve
    s = 1 - t
    return np.asarray(s * s * s * start + 3 * s * s * t * a + 3 * s * t * t * b + t * t * t * c)


def _pieces(start: complex, curve: Curve, tolerance: float) -> int:
    """Segments that a cubic or arc is split into, which stay within a tolerance of it."""
    if len(curve) == 4:
        _, one, other, ends = curve
        radius = math.sqrt(abs(one) ** 2 + abs(other) ** 2)  # at least the larger half axis
        turn = 2 * math.acos(max(1 - tolerance / radius, 0.0)) if radius else math.pi
        return max(1, math.ceil(abs(ends.imag - ends.real) / turn))
    a, b, c = curve
    bend = 6 * max(abs(start - 2 * a + b), abs(a - 2 * b + c))  # of the second derivative
    return max(1, math.ceil(math.sqrt(bend / (8 * tolerance))))


def corners_of(start: complex, curves: list[Curve], tolerance: float) -> NDArray[np.complex128]:
    """Corners of a ring."""
    points, at = [start], start
    for curve in curves:
        if len(curve) == 1:
            points.append(at := curve[0])
        else:
            points.extend(_points(at, curve, _pieces(at, curve, tolerance)).tolist())
            at = points[-1]
    return np.array(points)


def _faces(rings: list[NDArray[np.complex128]], nonzero: bool, grid: float) -> NDArray[Any]:
    """Polygons of all that rings fill, which do not overlap."""
    import shapely

    closed = [np.append(ring, ring[0]) for ring in rings if len(ring) > 2]
    if not closed:
        return np.array([])
    if len(closed) == 1 and (alone := shapely.Polygon(closed[0].view(float).reshape(-1, 2))).is_valid:
        return np.array([alone])
    lines = [shapely.LineString(ring.view(float).reshape(-1, 2)) for ring in closed]
    faces = shapely.get_parts(shapely.polygonize([shapely.union_all(lines, grid_size=grid)]))
    inside = shapely.point_on_surface(faces)
    winding = _winding(closed, shapely.get_x(inside), shapely.get_y(inside))
    filled: NDArray[Any] = faces[winding != 0 if nonzero else winding % 2 != 0]
    return filled


def _require_few_crossings(rings: list[NDArray[np.complex128]]) -> None:
    """Raise the error about segments that cross others too often, of which a few make millions of faces."""
    import shapely

    pairs = [np.stack([ring, np.roll(ring, -1)], 1) for ring in rings]
    segments = shapely.linestrings(np.concatenate(pairs).view(float).reshape(-1, 2, 2))
    tree, met, most = shapely.STRtree(segments), 0, 3 * len(segments) + 2 * MOST_CROSSINGS
    for first in range(0, len(segments), ASKED):
        met += tree.query(segments[first : first + ASKED], predicate="intersects").shape[1]
        if met > most:
            raise MeshError(f"expected an outline whose segments cross at most {MOST_CROSSINGS} times")


def _winding(
    closed: list[NDArray[np.complex128]], x: NDArray[np.float64], y: NDArray[np.float64]
) -> NDArray[np.int64]:
    """Winding numbers of rings around points, by the segments that rays to the right cross."""
    import shapely

    a, b = (np.concatenate([ring[part] for ring in closed]) for part in (slice(None, -1), slice(1, None)))
    tree = shapely.STRtree(shapely.linestrings(np.stack([a, b], 1).view(float).reshape(-1, 2, 2)))
    winding, far = np.zeros(len(x), np.int64), max(a.real.max(), x.max(initial=0.0))
    for first in range(0, len(x), RAYS):
        part = slice(first, first + RAYS)
        ray, segment = tree.query(shapely.box(x[part], y[part], far, y[part]))
        s, e, px, py = a[segment], b[segment], x[part][ray], y[part][ray]
        left = (e.real - s.real) * (py - s.imag) - (px - s.real) * (e.imag - s.imag) > 0
        up, down = (s.imag <= py) & (py < e.imag) & left, (e.imag <= py) & (py < s.imag) & ~left
        np.add.at(winding[part], ray, up.astype(int) - down)
    return winding


def rings_of(area: Geometry, origin: NDArray[np.float64]) -> list[NDArray[np.float64]]:
    """Rings of polygons, from an origin, with the inside on their left."""
    import shapely

    rings = []
    for polygon in shapely.get_parts(shapely.normalize(area)):
        for k, ring in enumerate((polygon.exterior, *polygon.interiors)):
            corners = shapely.get_coordinates(ring)[:-1]
            if shapely.is_ccw(ring) != (k == 0):
                corners = corners[::-1]
            rings.append(np.ascontiguousarray(corners - origin))
    return rings
