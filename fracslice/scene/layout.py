"""Elements of a scene file other than formulas, with their attributes, and other values of a scene: settings
of single numbers, as with ``--set``, and random variations.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from ..common.messages import hint
from ..common.parameters import REQUIRED, Choice, Count, Length, Number, Parameter, Vector
from ..errors import FracsliceError, SceneError
from ..fields.definitions import is_name
from ..fields.registry import Formula, load_installed
from ..fields.varying import Varying
from ..formulas import Node, get, names
from ..records import Part, Print
from .view import PARTS, Animation, Track, View

if TYPE_CHECKING:
    from .model import Scene


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


FORM = "ELEMENT.ATTRIBUTE=VALUE, such as mandelbulb.power=6 or box[2].round=0.1"
_FORM = re.compile(r"\s*(\w+)\s*(?:\[\s*(\d+)\s*\])?\s*\.\s*(\w+)\s*=(.*)", re.DOTALL)


@dataclass(frozen=True)
class Override:
    """One parsed setting."""

    source: str  # text of the setting, for error messages
    element: str  # element name
    number: int | None  # number of the element, from 1; None for all elements of the name
    attribute: str  # attribute name
    text: str  # new value

    def fail(self, message: str) -> SceneError:
        """Return the error to raise about this setting."""
        return SceneError(f"{self.source}: {message}")

    def value(self, element: Element) -> Any:
        """Parse the value for an element."""
        kind = element.parameters.get(self.attribute)
        if kind is None:
            near = hint(self.attribute, element.parameters)
            raise self.fail(f"<{element.name}> has no attribute {self.attribute!r}; {near}")
        try:
            return kind.read(self.text)
        except ValueError as error:
            raise self.fail(f"expected {error}") from None


def apply_settings(scene: Scene, settings: Iterable[str]) -> Scene:
    """Apply settings to a scene, in order."""
    for source in settings:
        scene = _apply_setting(scene, _parse_setting(source))
    return scene


def kind_of(scene: Scene, of: str, fail: Callable[[str], SceneError]) -> Any:
    """Return the parameter kind of an attribute, "ELEMENT.ATTRIBUTE".

    `of`: name of the attribute, as in a setting.
    """
    override = _parse_setting(f"{of}=")
    elements: dict[str, Element] = {node.formula.name: node.formula for node in scene.root.walk()}
    elements |= {section.name: section for section in (SOLID, PRINT, *PICTURE)}
    if override.element not in elements:
        raise fail(
            f"of={of!r}: the scene has no <{override.element}>; {hint(override.element, elements, '<{}>')}"
        )
    kinds = elements[override.element].parameters
    if override.attribute not in kinds:
        raise fail(f"of={of!r}: has no attribute {override.attribute!r}; {hint(override.attribute, kinds)}")
    return kinds[override.attribute]


def _parse_setting(source: str) -> Override:
    match = _FORM.fullmatch(source)
    if not match:
        raise SceneError(f"{source!r}: expected {FORM}")
    element, number, attribute, text = match.groups()
    return Override(source, element, int(number) if number else None, attribute, text)


def _apply_setting(scene: Scene, override: Override) -> Scene:
    if override.element == SOLID.name:
        sizes = {"size_mm": None, "unit_mm": None, f"{override.attribute}_mm": override.value(SOLID)}
        return replace(scene, **sizes)
    if override.element == PRINT.name:
        return replace(scene, printing=replace(scene.printing, **{override.attribute: override.value(PRINT)}))
    if override.element in (section.name for section in PICTURE):
        return replace(scene, view=_relit(scene.view, override))
    present = Counter(node.formula.name for node in scene.root.walk())
    if override.element in SECTIONS:
        raise override.fail(f"settings do not change <{override.element}>; expected another element")
    if override.element not in present:
        known = hint(override.element, present | {SOLID.name: 1}, "<{}>")
        raise override.fail(f"the scene has no <{override.element}>; {known}")
    if override.number is not None and not 1 <= override.number <= present[override.element]:
        raise override.fail(f"the scene has {present[override.element]} <{override.element}>, counted from 1")
    return replace(scene, root=_rebuilt(scene.root, override, Counter()))


def _relit(view: View, override: Override) -> View:
    """The view with one value changed; an element that may stand once need not be in the file."""
    section = SECTIONS[override.element]
    always: list[Part] = [part for part in (view.film, view.shading) if part not in view.parts]
    missing = all(part.element != section.name for part in (*view.parts, *always))
    if section.part and missing and not section.many:
        always.append(section.part())
    parts, counted = [], 0
    for part in (*view.parts, *always):
        counted += part.element == section.name
        meant = part.element == section.name and override.number in (None, counted)
        parts.append(replace(part, **{override.attribute: override.value(section)}) if meant else part)
    if not counted or not 1 <= (override.number or 1) <= counted:
        raise override.fail(
            f"the scene has {counted or 'no'} <{section.name}>{', counted from 1' if counted else ''}"
        )
    return View.of(parts)


def _rebuilt(node: Node, override: Override, seen: Counter[str]) -> Node:
    """The tree with one value changed; `seen` counts the nodes visited."""
    seen[node.formula.name] += 1
    meant = node.formula.name == override.element and override.number in (None, seen[node.formula.name])
    values: Mapping[str, Any] = {override.attribute: override.value(node.formula)} if meant else {}
    children = tuple(_rebuilt(child, override, seen) for child in node.children)
    return node.changed(children, **values)


KEPT = {"material", "transform", "bounds"}
"""Elements that say how a solid looks and where it is, not what it is."""

OF_A_HYBRID, OF_A_STEP = {"iterations", "bailout"}, {"repeat"}
"""Parameters that a hybrid has for all of its steps, and those that a step alone has."""

TRIES, POINTS = 100, 4096


def varied(scene: Scene, seed: tuple[int, ...], spread: float) -> Scene:
    """Vary the numbers of a scene's elements."""
    rng = np.random.default_rng(seed)
    for _ in range(TRIES):
        with suppress(FracsliceError, ArithmeticError):  # values that are valid alone but not together
            root = _node(scene.root, rng, spread)
            if root != scene.root and _holds_a_solid(root):
                return replace(scene, root=root)
    raise SceneError(f"{scene.name}: none of {TRIES} variations is valid: expected a smaller spread")


def _node(node: Node, rng: np.random.Generator, spread: float, step: bool = False) -> Node:
    """Varied node; `step` is True inside a hybrid."""
    hybrid = step or node.formula.name == "orbit"
    children = tuple(_node(child, rng, spread, hybrid) for child in node.children)
    if node.formula.name in KEPT:
        return node.changed(children)
    fixed = OF_A_HYBRID if step else OF_A_STEP
    kinds = {name: kind for name, kind in node.formula.parameters.items() if name not in fixed}
    return node.changed(
        children, **{name: _value(name, kind, node[name], rng, spread) for name, kind in kinds.items()}
    )


def _value(name: str, kind: Any, value: Any, rng: np.random.Generator, spread: float) -> Any:
    """Varied value of a parameter; words, automatic depths and values left out stay."""
    if value is None or isinstance(value, (str, Varying)):
        return value
    if isinstance(kind, Count):
        step = round(rng.normal() * spread * max(1.0, value / 4))
        return min(max(value + step, kind.least), kind.most)
    if isinstance(kind, Number):
        number = _number(kind, value, rng, spread)
        return float(round(number)) if name == "power" and value == round(value) else number
    if isinstance(kind, Vector) and not kind.whole:
        return tuple(_number(kind, v, rng, spread) for v in value)
    return value


def _number(kind: Number | Vector, value: float, rng: np.random.Generator, spread: float) -> float:
    """Number times a random power of two; near zero, moved. It stays within its range."""
    draw = float(rng.normal()) * spread
    moved = value * 2**draw if abs(value) > 1e-3 else value + 0.2 * draw
    low = kind.least if kind.least > kind.above else math.nextafter(kind.above, math.inf)
    high = kind.most if kind.most < kind.below else math.nextafter(kind.below, -math.inf)
    return float(f"{min(max(moved, low), high):.4g}")


def _holds_a_solid(root: Node) -> bool:
    """True if one of some random points in the box is inside."""
    box = root.bounds.box
    if not box.finite or box.empty:
        return False
    points = np.random.default_rng(0).uniform(box.lo, box.hi, (POINTS, 3))
    return bool((root.distance(points) < 0).any())
