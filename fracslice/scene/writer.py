"""Scene files: `Scene` to XML."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from ..common.parameters import short_repr
from ..errors import SceneError
from ..formulas import Node
from ..formulas.definitions import definitions
from ..records import Part, Print
from .definitions import attributes, write_definition
from .layout import SCENE, SECTIONS, SOLID, VERSION

if TYPE_CHECKING:
    from .model import Scene


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
    return "\n".join(_lines(scene)) + "\n"


def part_to_xml(part: Part | Print) -> str:
    """Return a record of a scene as an XML element."""
    section = SECTIONS[part.element]
    values = {name: getattr(part, name) for name in section.parameters}
    return f"<{section.name}{attributes(section, values)}/>"


def _lines(scene: Scene) -> Iterator[str]:
    yield f"<{SCENE.name}{attributes(SCENE, {'version': VERSION})}>"
    for definition in definitions(scene.root):
        yield from write_definition(definition)
    yield f"  <{SOLID.name}{attributes(SOLID, {'size': scene.size_mm, 'unit': scene.unit_mm})}>"
    yield from _element(scene.root, "    ")
    yield f"  </{SOLID.name}>"
    printing = () if scene.printing == Print() else (scene.printing,)
    film = () if scene.animation is None else (scene.animation, *scene.tracks)
    for part in (*printing, *scene.view.parts, *film):
        yield "  " + part_to_xml(part)
    yield f"</{SCENE.name}>"


def _element(node: Node, indent: str) -> Iterator[str]:
    start = f"{indent}<{node.formula.name}{attributes(node.formula, node.values)}"
    if not node.children:
        yield start + "/>"
        return
    yield start + ">"
    for child in node.children:
        yield from _element(child, indent + "  ")
    yield f"{indent}</{node.formula.name}>"
