"""Steps of orbits as assignments."""

from __future__ import annotations

import ast
import re
from dataclasses import dataclass
from functools import cached_property

from .parsing import parse

CONSTANTS, POINTS = re.compile(r"\bc[xyz]\d+\b"), re.compile(r"\b([xyz]|c[xyz]\d+)\b")
TEARS = re.compile(r"\b(floor|where|atan2)\b|[<>]")
"""Coordinates of the constant, and of it or the point; functions and comparisons that may tear space."""


@dataclass
class Step:
    """Code of a step.

    Attributes
    ----------
    lines
        Assignments.
    point
        Expressions of the next point.
    stretch
        Expressions of the stretch by w and by c.
    """

    lines: list[str]
    point: tuple[str, str, str]
    stretch: tuple[str, str]

    @cached_property
    def image(self) -> list[str]:
        """Assignments that the next point depends on."""
        return self.needed(*self.point)

    def needed(self, *names: str) -> list[str]:
        """Assignments that some names depend on."""
        kept, live = [], {*names}
        for line in reversed(self.lines):
            target, value = line.split(" = ", 1)
            if target in live:
                live |= {n.id for n in ast.walk(parse(value)) if isinstance(n, ast.Name)}
                kept.append(line)
        return kept[::-1]

    @property
    def constants(self) -> list[str]:
        """Coordinates of the constant, wherever the next point depends on them."""
        return CONSTANTS.findall("\n".join([*self.image, *self.point]))

    @property
    def is_added(self) -> bool:
        """True if the constant is the last summand of the next point and nowhere else."""
        values = dict(line.split(" = ", 1) for line in self.image)
        summands = [values.get(name, "").rpartition(" + ")[2] for name in self.point]
        return len(self.constants) == 3 and summands == sorted(self.constants)

    @property
    def is_torn(self) -> bool:
        """True if the step may tear space."""
        return bool(TEARS.search("\n".join(self.image)))

    @property
    def is_steady(self) -> bool:
        """True if the stretch is the same at all points, and space is not torn."""
        stretch = "\n".join([*self.needed(self.stretch[0]), self.stretch[0]])
        return not self.is_torn and not POINTS.search(stretch)
