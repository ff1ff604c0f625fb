"""Elements of a long union by region: those that matter near a point are known to an octree of native code
(`native/volume/regions.h`), which compiled code asks for them.

It serves whatever evaluates the field: samples, roots, layers, rays. Other elements change no bit.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from ..common.cache import key
from ..expr.graph import Program
from ..expr.language import InMemory

if TYPE_CHECKING:
    from .node import Node

LONG, ROOM = 32, 0.75
"""Elements of a union from which on those near a point are looked for; half side of the cube, in which they
are, per largest side of the solid.
"""


def is_long(node: Node) -> bool:
    """Return whether the elements of a union are looked for by region: bounds of all must be proved."""
    if node.formula.name != "union" or len(node.children) < LONG or not isinstance(node["smooth"], float):
        return False
    bounds = node.bounds
    return bounds.box.finite and not bounds.exterior_only and not bounds.measured


@dataclass(frozen=True, eq=False)
class Region:
    """A long union for native code, whose address stands in P; equal if fields and numbers are."""

    program: Program  # field of one element
    numbers: np.ndarray  # P of each, float64 [n, size]
    held: Sequence[tuple[int, InMemory]]  # see `Linked`; places in the flat numbers
    smooth: float  # width of the seams
    lipschitz: float  # of the union
    centre: tuple[float, ...]  # of a cube; points outside see all elements
    half: float

    @classmethod
    def of(cls, node: Node) -> Region:
        """Return the region of a long union."""
        bounds, elements = node.bounds, node.linked_elements
        centre = tuple((a + b) / 2 for a, b in zip(bounds.box.lo, bounds.box.hi, strict=True))
        smooth, half = 0.0 if node.is_unordered else node["smooth"], ROOM * max(bounds.box.size)
        own = elements.program, elements.numbers, elements.held
        return cls(*own, smooth, bounds.lipschitz, centre, half)

    @cached_property
    def digest(self) -> str:
        """Hash of everything."""
        place = self.smooth, self.lipschitz, self.centre, self.half
        return key(self.program.identity, self.numbers, *place)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Region) and self.digest == other.digest

    def __hash__(self) -> int:
        return hash(self.digest)
