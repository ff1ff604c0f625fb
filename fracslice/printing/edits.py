"""A scene with changes. Its own field stays what it is, exact; others beside it say where to take away, to
add or to stay within.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, reduce
from typing import TYPE_CHECKING, Literal

import numpy as np

from ..formulas import Box, Node, difference, intersection, union
from ..formulas.registry import Bounds
from ..kernel import Compilable, Kernel, compile_scene, field_key
from ..kernel.cpu import Precision
from ..keys import key
from .wrapped import Wrapped

if TYPE_CHECKING:
    from .samples import Samples  # it needs Numba, whose import takes as long as a small mesh

Does = Literal["cut", "add", "keep"]
_FOLDED = {"cut": difference, "add": union, "keep": intersection}


@dataclass(frozen=True, eq=False)
class Term:
    """A field, and what it does: "cut" takes its inside away, "add" adds it, "keep" leaves only what is in
    it.
    """

    shape: Node | Samples
    does: Does


@dataclass(frozen=True, eq=False)
class EditedField:
    """A field, and what is done to it, one after the other.

    It stands where a root does: it has facts, and `compile_scene` makes a kernel of it.
    """

    root: Node | Compilable
    terms: tuple[Term, ...]

    @cached_property
    def bounds(self) -> Bounds:
        """Of all together; the box encloses what is added."""
        added = [_box(term) for term in self.terms if term.does == "add"]
        slopes = [
            t.shape.bounds.lipschitz if isinstance(t.shape, Node) else t.shape.lipschitz for t in self.terms
        ]
        own = self.root.bounds
        box = reduce(Box.__or__, added, own.box)
        return Bounds(box, max(own.lipschitz, *slopes), own.exterior_only)

    @property
    def key(self) -> str:
        """What it is known by, as `kernel.field_key`."""
        shapes = [field_key(t.shape) if isinstance(t.shape, Node) else t.shape.key for t in self.terms]
        return key(field_key(self.root), *((t.does, s) for t, s in zip(self.terms, shapes, strict=True)))

    def conservative(self) -> EditedField:
        """The field to skip space by, as `Node.conservative`. Cuts stay: a smaller cut is a larger solid."""
        terms = tuple(t if t.does == "cut" else _conservative(t) for t in self.terms)
        return EditedField(self.root.conservative(), terms)

    def compiled(self, precision: Precision) -> Composite:
        """Its kernel."""
        components = [
            compile_scene(t.shape, precision) if isinstance(t.shape, Node) else t.shape for t in self.terms
        ]
        steps = tuple(zip(components, (t.does for t in self.terms), strict=True))
        return Composite(compile_scene(self.root, precision), steps)


def _conservative(term: Term) -> Term:
    return Term(term.shape.conservative(), term.does) if isinstance(term.shape, Node) else term


def _box(term: Term) -> Box:
    return term.shape.bounds.box if isinstance(term.shape, Node) else term.shape.box


@dataclass(frozen=True, eq=False)
class Composite(Wrapped):
    """Evaluates like a `CpuKernel`."""

    steps: tuple[tuple[Kernel | Samples, Does], ...]

    def points(self, x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
        """Field values at points, as `CpuKernel.points`."""
        f = self.kernel.points(x, y, z)
        for part, does in self.steps:
            g = part.points(x, y, z).astype(f.dtype)
            f = np.minimum(f, g) if does == "add" else np.maximum(f, -g if does == "cut" else g)
        return f

    def bricks(
        self, corners: np.ndarray, origin: tuple[float, float, float], voxel: float, out: np.ndarray
    ) -> None:
        """Field values on bricks, as `CpuKernel.bricks`."""
        inner = np.indices((8, 8, 8)).reshape(3, 512)
        at = [origin[k] + voxel * (corners[:, k, None] + inner[k]) for k in range(3)]
        out[:] = self.points(*at)


def edited(thing: Node | Compilable, does: Does, shape: Node | Samples) -> Node | Compilable:
    """One more change. A formula is made part of a tree that has no sampled fields yet."""
    if isinstance(thing, Node) and isinstance(shape, Node):
        return _FOLDED[does](thing, shape)
    if isinstance(thing, EditedField):
        return EditedField(thing.root, (*thing.terms, Term(shape, does)))
    return EditedField(thing, (Term(shape, does),))
