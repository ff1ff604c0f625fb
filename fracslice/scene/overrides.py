"""Settings that change single values of a scene, as with ``--set``."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from ..common.suggestions import hint
from ..errors import SceneError
from ..formulas import Node
from .element import Part
from .layout import PICTURE, PRINT, SECTIONS, SOLID, Element
from .view import View

if TYPE_CHECKING:
    from .model import Scene

FORM = "ELEMENT.ATTRIBUTE=VALUE, such as mandelbulb.power=6 or box[2].round=0.1"
_FORM = re.compile(r"\s*(\w+)\s*(?:\[\s*(\d+)\s*\])?\s*\.\s*(\w+)\s*=(.*)", re.DOTALL)


@dataclass(frozen=True)
class Override:
    """One parsed setting.

    Attributes
    ----------
    source : str
        Text of the setting, for error messages.
    element : str
        Element name.
    number : int or None
        Number of the element, from 1; None for all elements of the name.
    attribute : str
        Attribute name.
    text : str
        New value.
    """

    source: str
    element: str
    number: int | None
    attribute: str
    text: str

    def fail(self, message: str) -> SceneError:
        """Return the error to raise about this setting."""
        return SceneError(f"{self.source}: {message}")

    def value(self, element: Element) -> Any:
        """Parse the value for an element.

        Parameters
        ----------
        element : Element
            Element with the attribute.

        Raises
        ------
        SceneError
            If the element has no such attribute, or the value is invalid.
        """
        kind = element.parameters.get(self.attribute)
        if kind is None:
            near = hint(self.attribute, element.parameters)
            raise self.fail(f"<{element.name}> has no attribute {self.attribute!r}; {near}")
        try:
            return kind.read(self.text)
        except ValueError as error:
            raise self.fail(f"expected {error}") from None


def changed(scene: Scene, settings: Iterable[str]) -> Scene:
    """Apply settings to a scene, in order.

    Parameters
    ----------
    scene : Scene
        The scene.
    settings : iterable of str
        Settings, "ELEMENT.ATTRIBUTE=VALUE".

    Raises
    ------
    SceneError
        If a setting is malformed, its element is missing or its value is invalid.
    """
    for source in settings:
        scene = _changed(scene, _parsed(source))
    return scene


def kind_of(scene: Scene, of: str, fail: Callable[[str], SceneError]) -> Any:
    """Return the parameter kind of an attribute, "ELEMENT.ATTRIBUTE".

    Parameters
    ----------
    scene : Scene
        The scene.
    of : str
        Name of the attribute, as in a setting.
    fail : callable
        Makes the error to raise from a message.

    Returns
    -------
    Parameter
        The kind.

    Raises
    ------
    SceneError
        If the scene has no such element, or the element no such attribute.
    """
    override = _parsed(f"{of}=")
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


def _parsed(source: str) -> Override:
    match = _FORM.fullmatch(source)
    if not match:
        raise SceneError(f"{source!r}: expected {FORM}")
    element, number, attribute, text = match.groups()
    return Override(source, element, int(number) if number else None, attribute, text)


def _changed(scene: Scene, override: Override) -> Scene:
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
