"""Inputs of the public calls: a shape, a scene, a scene file, or the name of a shipped scene or formula."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TypeAlias

from ..common.suggestions import hint
from ..errors import SceneError
from ..formulas import Formula, Node, get
from ..formulas import names as formula_names
from ..formulas.conversion import shown
from ..formulas.parameters import REQUIRED
from ..scene import Scene, library, read, scene
from ..scene.lengths import AnyLength

Source: TypeAlias = Node | Scene | str | os.PathLike[str]


def resolve(source: Source) -> Node | Scene:
    """Resolve a source to a shape or scene.

    Parameters
    ----------
    source : Node, Scene, path or name
        A shape, a scene, a scene file, or the name of a shipped scene or formula.

    Raises
    ------
    SceneError
        For an unknown name, with the nearest known one, or a file that cannot be read.
    """
    if isinstance(source, (Node, Scene)):
        return source
    if isinstance(source, Formula):
        raise SceneError(f"{source.name}: expected a shape, {source.name}(...), found the formula itself")
    if not isinstance(source, (str, os.PathLike)):
        wanted = "expected a shape such as sphere(), a scene, a file or a name"
        made = "; formulas.shape makes a formula of a function" if callable(source) else ""
        raise SceneError(f"{shown(source)}: {wanted}{made}")
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
    """True if a formula is a bounded shape without required parameters."""
    required = any(kind.default is REQUIRED for kind in formula.parameters.values())
    return formula.kind == "shape" and not formula.children[1] and "bounds" in formula.hooks and not required


def as_scene(source: Source, size: AnyLength | None = None) -> Scene:
    """Resolve a source to a scene.

    Parameters
    ----------
    source : Node, Scene, path or name
        A shape, a scene, a scene file, or the name of a shipped scene or formula.
    size : float or str, optional
        Longest side of a shape; by default, its scene unit is a millimetre.

    Raises
    ------
    SceneError
        As `resolve`.
    """
    what = resolve(source)
    if isinstance(what, Scene):
        return what
    return scene(what, unit=1.0) if size is None else scene(what, size=size)
