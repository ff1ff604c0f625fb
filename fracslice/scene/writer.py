"""Scene files: `Scene` to XML."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

from ..common.parameters import File, short_repr
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
    return "\n".join(_lines(scene, scene.root)) + "\n"


def identity(scene: Scene) -> str:
    """Return the canonical scene file with the hashes of models, and without the names of their files."""
    return "\n".join(_lines(scene, _unnamed(scene.root))) + "\n"


def _unnamed(node: Node) -> Node:
    """The tree without the names of files whose hash it holds."""
    kinds, values = node.formula.parameters, node.values
    if any(kind.implied for kind in kinds.values()):
        values = {name: value for name, value in values.items() if not isinstance(kinds[name], File)}
    return replace(node, values=values, children=tuple(map(_unnamed, node.children)))


def part_to_xml(part: Part | Print) -> str:
    """Return a record of a scene as an XML element."""
    section = SECTIONS[part.element]
    values = {name: getattr(part, name) for name in section.parameters}
    return f"<{section.name}{attributes(section, values)}/>"


def _lines(scene: Scene, root: Node) -> Iterator[str]:
    yield f"<{SCENE.name}{attributes(SCENE, {'version': VERSION})}>"
    for definition in definitions(root):
        yield from write_definition(definition)
    yield f"  <{SOLID.name}{attributes(SOLID, {'size': scene.size_mm, 'unit': scene.unit_mm})}>"
    yield from _element(root, "    ")
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
