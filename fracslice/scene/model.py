"""What a scene file says, as frozen records, and the one expression that builds a scene in Python."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from ..errors import SceneError
from ..formulas import Node, get
from ..formulas.parameters import AUTO
from .lengths import parse_length
from .printing import Print
from .view import View


@dataclass(frozen=True)
class Scene:
    """One solid, how large to make it, what makes it printable, and how to look at it.

    root: the tree of formulas. size_mm: the longest side of the finished object. name: a label, not content.
    printing: what meshes and slices differ in from the root. view: for pictures; meshes do not depend on it.
    Raises `SceneError` for a tree that makes no sense as a whole: a twist of something unbounded, say.
    """

    root: Node
    size_mm: float
    name: str = field(default="scene", compare=False)
    view: View = field(default_factory=View)
    printing: Print = field(default_factory=Print)

    def __post_init__(self) -> None:
        object.__setattr__(self, "size_mm", parse_length(self.size_mm, "size"))
        _refuse_impossible(self.root)

    @cached_property
    def hash(self) -> str:
        """12 hexadecimal digits of the SHA-256 of the canonical XML: equal for equal scenes, everywhere."""
        from .writer import to_xml

        return hashlib.sha256(to_xml(self).encode()).hexdigest()[:12]

    def with_values(self, settings: Iterable[str]) -> Scene:
        """A copy with settings: "mandelbulb.power=6", "box[2].round=0.1" (the second), "solid.size=4cm".

        Without a number in brackets every element of that name changes. Elements are counted from 1 in the
        order of the file. Raises `SceneError` for a name that the scene does not have or an impossible value.
        """
        from .values import changed

        return changed(self, settings)


def scene(
    *elements: Node,
    size: str | float,
    name: str = "scene",
    view: View | None = None,
    printing: Print | None = None,
) -> Scene:
    """A scene of one or more elements; several are a union.

    >>> from fracslice.formulas import sphere, transform
    >>> ball = scene(sphere(radius=0.5), transform(sphere(), translate=(1, 0, 0)), size="4cm")
    >>> ball.size_mm, ball.root
    (40.0, union(sphere(radius=0.5), transform(sphere(), translate=(1.0, 0.0, 0.0))))
    """
    if not elements:
        raise SceneError("a scene needs at least one element")
    root = elements[0] if len(elements) == 1 else get("union")(*elements)
    return Scene(root, parse_length(size, "size"), name, view or View(), printing or Print())


def _refuse_impossible(root: Node) -> None:
    """Works out, from the leaves up, all that a kernel will ask for: what only the whole tree can tell."""
    for node in reversed(list(root.walk())):
        with computing(node.fail):
            depths: dict[str, Any] = {name: 1 for name, value in node.values.items() if value == AUTO}
            _ = node.bounds, (node.changed(**depths) if depths else node).arguments


@contextmanager
def computing(fail: Callable[[str], SceneError]) -> Iterator[None]:
    """Numbers that overflow, or vanish where they must not, become the error that `fail` makes."""
    import numpy as np

    try:
        with np.errstate(over="raise", divide="raise", invalid="raise"):
            yield
    except (ArithmeticError, ValueError):
        raise fail("has numbers too large or too small to compute with") from None
