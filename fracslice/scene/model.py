"""Scenes: the record, the function that builds one in Python, and their text in XML."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import isfinite
from typing import TYPE_CHECKING, Any
from weakref import WeakSet

from ..common.parameters import AUTO, AnyLength, File, Vector, parse_length, short_repr
from ..errors import SceneError
from ..fields.definitions import Definition, definitions
from ..formulas import Node, get
from ..records import Part, Print
from .layout import DEFINE, PARAMETER, SCENE, SECTIONS, SOLID, VERSION, Element
from .view import Animation, Track, View


@dataclass(frozen=True)
class Scene:
    """One solid with its size, print settings and view.

    Attributes
    ----------
    root : Node
        Root of the formula tree.
    size_mm : float or None
        Longest side of the finished object, mm; text with a unit is accepted. None if `unit_mm` is given.
    name : str
        Label; not compared and not written.
    view : View
        View for pictures; meshes do not depend on it.
    printing : Print
        Changes for printing, which meshes and slices contain and the root does not.
    animation : Animation or None
        Length and frames of the film.
    tracks : tuple of Track
        Attributes that the film moves.
    unit_mm : float or None
        Length of a scene unit, mm; excludes `size_mm`.

    Raises
    ------
    SceneError
        Unless one of `size_mm` and `unit_mm` is given, or if the tree is invalid as a whole, such as a twist
        of an unbounded solid.
    """

    root: Node
    size_mm: float | None
    name: str = field(default="scene", compare=False)
    view: View = field(default_factory=View)
    printing: Print = field(default_factory=Print)
    animation: Animation | None = None
    tracks: tuple[Track, ...] = ()
    unit_mm: float | None = None

    if TYPE_CHECKING:  # what it takes is more than what it holds

        def __init__(
            self,
            root: Node,
            size_mm: AnyLength | None,
            name: str = "scene",
            view: View = ...,
            printing: Print = ...,
            animation: Animation | None = None,
            tracks: tuple[Track, ...] = (),
            unit_mm: AnyLength | None = None,
        ) -> None: ...

    def __post_init__(self) -> None:
        if (self.size_mm is None) == (self.unit_mm is None):
            raise SceneError("size and unit: expected one of them")
        for name in ("size", "unit"):
            if (value := getattr(self, f"{name}_mm")) is not None:
                object.__setattr__(self, f"{name}_mm", parse_length(value, name))
        definitions(self.root)
        _refuse_impossible(self.root)
        if self.tracks and self.animation is None:
            raise self.tracks[0].fail("needs an <animation> in the scene")

    @cached_property
    def hash(self) -> str:
        """First 12 hexadecimal digits of the SHA-256 of the canonical XML.

        Equal scenes have equal hashes on every platform, and in every folder.
        """
        return hashlib.sha256(identity(self).encode()).hexdigest()[:12]

    def with_values(self, settings: Iterable[str]) -> Scene:
        """Return a copy with changed values.

        Parameters
        ----------
        settings : iterable of str
            Settings: "mandelbulb.power=6", "box[2].round=0.1" (the second box), "solid.size=4cm". Elements
            are counted from 1 in the order of the file. Without a number, all elements of the name change.

        Returns
        -------
        Scene
            The changed scene.

        Raises
        ------
        SceneError
            If the scene has no such element or attribute, or the value is invalid.
        """
        from .layout import apply_settings

        return apply_settings(self, settings)


def scene(
    *elements: Node,
    size: AnyLength | None = None,
    unit: AnyLength | None = None,
    name: str = "scene",
    view: View | None = None,
    printing: Print | None = None,
) -> Scene:
    """Build a scene from elements.

    Parameters
    ----------
    *elements : Node
        One or more elements; several form a union.
    size : str or float, optional
        Longest side of the finished object: text with a unit, or mm.
    unit : str or float, optional
        Length of a scene unit, instead of a size.
    name : str
        Label.
    view : View, optional
        View for pictures.
    printing : Print, optional
        Changes for printing.

    Returns
    -------
    Scene
        The scene.

    Raises
    ------
    SceneError
        If there is no element, or a value is invalid.

    Examples
    --------
    >>> from fracslice.formulas import sphere, transform
    >>> ball = scene(sphere(radius=0.5), transform(sphere(), translate=(1, 0, 0)), size="4cm")
    >>> ball.size_mm, ball.root
    (40.0, union(sphere(radius=0.5), transform(sphere(), translate=(1.0, 0.0, 0.0))))
    """
    if not elements:
        raise SceneError("a scene needs at least one element")
    root = elements[0] if len(elements) == 1 else get("union")(*elements)
    parts = view or View(), printing or Print()
    return Scene(root, size, name, *parts, unit_mm=unit)


def _refuse_impossible(root: Node) -> None:
    """Compute bounds and arguments of all nodes, from the leaves up, once for a tree.

    Errors of the tree as a whole thus surface at construction.
    """
    if root in _POSSIBLE:
        return
    node = root
    with computing(lambda message: node.fail(message)):
        for node in reversed(list(root.solids())):
            known = node
            if AUTO in node.values.values():
                depths: dict[str, Any] = {name: 1 for name, value in node.values.items() if value == AUTO}
                known = node.changed(**depths)
            _ = node.bounds, known.arguments
    _POSSIBLE.add(root)


_POSSIBLE = WeakSet[Node]()
"""Trees that were computed."""


@contextmanager
def computing(fail: Callable[[str], SceneError]) -> Iterator[None]:
    """Convert numeric errors in a block, such as overflow or division by zero, to `SceneError`."""
    import numpy as np

    try:
        with np.errstate(over="raise", divide="raise", invalid="raise"):
            yield
    except (ArithmeticError, ValueError):
        raise fail(TOO_LARGE) from None


TOO_LARGE = "has numbers too large or too small to compute with"


def to_xml(scene: Scene) -> str:
    """Return the canonical scene file: non-default values only, indented by two spaces per level.

    Parameters
    ----------
    scene : Scene
        The scene.

    Returns
    -------
    str
        XML that reads back as an equal scene.

    Raises
    ------
    SceneError
        For a shape, which has no size.
    """
    if isinstance(scene, Node):
        raise SceneError(f"{short_repr(scene)}: expected a scene, such as Scene(sphere(), 40)")
    return "\n".join(_lines(scene, scene.root)) + "\n"


def identity(scene: Scene) -> str:
    """Return the canonical scene file with the hashes of models, and without the names of their files."""
    return "\n".join(_lines(scene, _unnamed(scene.root))) + "\n"


def _unnamed(node: Node) -> Node:
    """The tree without the names of files whose hash it holds."""
    if not any(kind.implied for formula in node.formulas for kind in formula.parameters.values()):
        return node
    kinds, values = node.formula.parameters, node.values
    if any(kind.implied for kind in kinds.values()):
        values = {name: value for name, value in values.items() if not isinstance(kinds[name], File)}
    return replace(node, values=values, children=tuple(map(_unnamed, node.children)))


def element_to_xml(node: Node) -> str:
    """Return a shape as the XML elements of a scene file, indented by two spaces per level."""
    return "\n".join(_elements(node, ""))


def part_to_xml(part: Part | Print) -> str:
    """Return a record of a scene as an XML element."""
    section = SECTIONS[part.element]
    values = {name: getattr(part, name) for name in section.parameters}
    return f"<{section.name}{_attributes(section, values)}/>"


def _lines(scene: Scene, root: Node) -> Iterator[str]:
    yield f"<{SCENE.name}{_attributes(SCENE, {'version': VERSION})}>"
    for definition in definitions(root):
        yield from _definition(definition)
    yield f"  <{SOLID.name}{_attributes(SOLID, {'size': scene.size_mm, 'unit': scene.unit_mm})}>"
    yield from _elements(root, "    ")
    yield f"  </{SOLID.name}>"
    printing = () if scene.printing == Print() else (scene.printing,)
    film = () if scene.animation is None else (scene.animation, *scene.tracks)
    for part in (*printing, *scene.view.parts, *film):
        yield "  " + part_to_xml(part)
    yield f"</{SCENE.name}>"


def _elements(root: Node, indent: str) -> list[str]:
    """Lines of a tree."""
    lines = list[str]()

    def write(node: Node, indent: str) -> None:
        start = f"{indent}<{node.formula.name}{_attributes(node.formula, node.values)}"
        if not node.children:
            lines.append(start + "/>")
            return
        lines.append(start + ">")
        for child in node.children:
            write(child, indent + "  ")
        lines.append(f"{indent}</{node.formula.name}>")

    write(root, indent)
    return lines


def _definition(definition: Definition) -> Iterator[str]:
    """Write a definition."""
    values = {name: getattr(definition, name) for name in DEFINE.parameters}
    yield f"  <{DEFINE.name}{_attributes(DEFINE, values)}>"
    for name, kind in definition.parameters:
        default = kind.default if isinstance(kind, Vector) else (kind.default,)
        limits = {limit: value for limit in ("least", "most") if isfinite(value := getattr(kind, limit))}
        given = {"name": name, "default": default, **limits}
        yield f"    <{PARAMETER.name}{_attributes(PARAMETER, given)}/>"
    from html import escape  # its table of entities takes a millisecond

    for line in definition.text.split("\n"):
        yield f"    {escape(line, quote=False)}".rstrip()
    yield f"  </{DEFINE.name}>"


def _attributes(element: Element, values: Mapping[str, Any]) -> str:
    """Attributes that differ from their defaults, as XML."""
    kinds = element.parameters
    changed = [
        (name, kinds[name].text(value)) for name, value in values.items() if value != kinds[name].default
    ]
    if not changed:
        return ""
    from html import escape

    return "".join([f' {name}="{escape(text)}"' for name, text in changed])
