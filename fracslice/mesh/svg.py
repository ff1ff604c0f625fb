"""Reader of SVG files: what is filled, as curves in mm, y up.

After "Scalable Vector Graphics (SVG) 2", W3C 2018: paths and basic shapes with transforms, groups, symbols,
`use` and nested `svg`; fills and fill rules by attributes, `style` and the simple selectors of style sheets.
Strokes, clipping and masks are left out. Entities, texts that are no paths, and malformed values are refused.
"""

from __future__ import annotations

import cmath
import math
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple
from xml.parsers import expat

from ..common.files import open_regular
from ..errors import MeshError

LARGEST, MOST_ELEMENTS, DEEPEST, MOST_CURVES = 8 << 20, 1 << 13, 64, 1 << 18
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
    with open_regular(path) as file:
        data = file.read(LARGEST + 1)
    if len(data) > LARGEST:
        raise MeshError(f"expected an SVG file of at most {LARGEST >> 20} MB")
    fills = list(_Drawing(_parsed(data)).fills())
    if not fills:
        raise MeshError("has no closed path that is filled: strokes have no inside; make paths of them first")
    return fills


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


class _Drawing:
    """Draws a tree of elements."""

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

    def fills(self) -> Iterator[Fill]:
        """Fills of all that is drawn, mm."""
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
            case name if name in _SHAPES:
                if (
                    style.get("fill") not in ("none", "transparent")
                    and style.get("visibility", "visible") == "visible"
                ):
                    yield from self.filled(element, to, style)

    def filled(self, element: SvgElement, to: Affine, style: dict[str, str]) -> Iterator[Fill]:
        """What a shape fills."""
        rings = [(to(start), list(map(to.curve, curves))) for start, curves in _SHAPES[element.name](element)]
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
    """Map of the user units of an `svg` or `symbol` to the pixels around it.

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
    return iter(_PathReader(element).rings)


class _PathReader:
    """Reads path data."""

    def __init__(self, element: SvgElement) -> None:
        self.element, self.rings = element, list[tuple[complex, list[Curve]]]()
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
_SHAPES = {
    "path": _path, "rect": _rectangle, "circle": _ellipse, "ellipse": _ellipse, "polygon": _polygon,
    "polyline": _polygon,
}  # fmt: skip
