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
    before
        Assignments that do not depend on the last point.
    lines
        The other assignments.
    point
        Expressions of the next point.
    stretch
        Expressions of the stretch by w and by c.
    majorant
        Expressions of the bend and of the distance to the nearest tear, or None without one; None if they are
        not known.
    bending
        Assignments after `lines` that the majorant depends on.
    length
        Expression of the length of the next point, from "rw" and "rc", those of the point and the constant;
        None if it is not known.
    measuring
        Assignments after `lines` that the length depends on.
    """

    before: list[str]
    lines: list[str]
    point: tuple[str, str, str]
    stretch: tuple[str, str]
    majorant: tuple[str, str | None] | None = None
    bending: tuple[str, ...] = ()
    length: str | None = None
    measuring: tuple[str, ...] = ()

    @cached_property
    def image(self) -> list[str]:
        """Assignments of `lines` that the next point depends on."""
        before = {*self.before}
        return [line for line in self.needed(*self.point) if line not in before]

    def needed(self, *names: str) -> list[str]:
        """Assignments that some names depend on."""
        kept, live = [], {name.removeprefix("-") for name in names}
        for line in reversed([*self.before, *self.lines]):
            target, value = line.split(" = ", 1)
            if target in live:
                live |= named(value)
                kept.append(line)
        return kept[::-1]

    @property
    def constants(self) -> list[str]:
        """Coordinates of the constant, wherever the next point depends on them."""
        return CONSTANTS.findall("\n".join([*self.needed(*self.point), *self.point]))

    @property
    def is_added(self) -> bool:
        """True if the constant is a summand of the next point and nowhere else."""
        values = dict(line.split(" = ", 1) for line in self.image)
        summands = [values.get(name, "").split(" + ") for name in self.point]
        constants = sorted(self.constants)
        return len(constants) == 3 and all(c in two for c, two in zip(constants, summands, strict=True))

    @property
    def is_torn(self) -> bool:
        """True if the step may tear space."""
        return bool(TEARS.search("\n".join(self.image)))

    @property
    def is_steady(self) -> bool:
        """True if the stretch is the same at all points, and space is not torn."""
        stretch = "\n".join([*self.needed(self.stretch[0]), self.stretch[0]])
        return not self.is_torn and not POINTS.search(stretch)


def named(value: str) -> set[str]:
    """Return the names in an expression."""
    return {n.id for n in ast.walk(parse(value)) if isinstance(n, ast.Name)}
