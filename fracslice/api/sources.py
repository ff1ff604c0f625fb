"""What is made: a shape, a scene, a scene file, or the name of a shipped scene or a formula."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TypeAlias

from ..errors import SceneError
from ..formulas import Formula, Node, get
from ..formulas import names as formula_names
from ..formulas.parameters import REQUIRED, shown
from ..nearest import hint
from ..scene import Scene, library, parse_length, read
from ..volume import extent, with_depths
from ..work import Work
from .options import Length

Source: TypeAlias = Node | Scene | str | os.PathLike[str]

RESOLUTION = 64
"""Voxels along the longest side when a shape is measured."""


def found(source: Source) -> Node | Scene:
    """The shape or scene itself.

    Raises
    ------
    SceneError
        Where nothing has that name, with the nearest one, or a file cannot be read.
    """
    if isinstance(source, (Node, Scene)):
        return source
    if isinstance(source, Formula):
        raise SceneError(f"{source.name}: expected a shape, {source.name}(...), found the formula itself")
    if not isinstance(source, (str, os.PathLike)):
        raise SceneError(f"{shown(source)}: expected a shape such as sphere(), a scene, a file or a name")
    path = Path(source)
    if path.exists() or path.name != os.fspath(source) or path.suffix:
        return read(path)
    name = os.fspath(source)
    if name in library.names():
        return read(library.path(name))
    ready = [n for n in formula_names() if _is_ready(get(n))]
    if name in ready:
        return get(name)()
    raise SceneError(f"{name}: no such scene, formula or file; {hint(name, {*ready, *library.names()})}")


def _is_ready(formula: Formula) -> bool:
    """Whether a formula is a shape without further values."""
    required = any(kind.default is REQUIRED for kind in formula.parameters.values())
    return formula.kind == "shape" and "bounds" in formula.hooks and not required


def as_scene(source: Source, size: Length | None, work: Work) -> Scene:
    """The scene of a source; a shape becomes one of a size.

    Parameters
    ----------
    source : Node, Scene, path or name
        What is made.
    size : float or str, optional
        The longest side of a shape. Without one, its scene unit is a millimetre.
    work : Work
        How the shape is measured.

    Raises
    ------
    SceneError
        As `found`, and for a shape without an end.
    """
    what = found(source)
    if isinstance(what, Scene):
        return what
    return Scene(what, _measured(what, work) if size is None else parse_length(size, "size"))


def _measured(shape: Node, work: Work) -> float:
    """The longest side of a shape, scene units."""
    return max(extent(with_depths(shape, work), RESOLUTION, work).box.size)
