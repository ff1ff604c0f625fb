"""Checks of printability: what would go wrong, and what mends it. A module with `CHECKS` has some of them.

A check looks at a mesh, at a sampled solid or at all layers of an object, and finds problems.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import cache
from importlib import import_module
from pkgutil import iter_modules
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

if TYPE_CHECKING:
    from ..slicing.layers import Layer
    from .problems import Problem

Subject = Literal["mesh", "solid", "layers"]
"""What a check looks at: a `MeshEvidence`, a `SolidEvidence` or a `LayersEvidence`."""


class Check(NamedTuple):
    """A check of an object."""

    kind: str  # of its problems
    of: Subject
    find: Callable[[Any], Iterable[Problem]]  # problems that what it looks at shows
    rank: int = 100  # place of its problems in a report
    weight: float = 1.0  # what a feature of the kind counts among the problems of an object
    of_resin: bool = False  # True if it is none of filament
    # numbers of a layer by itself, which any process finds; `LayersEvidence.measured` has those of all layers
    measure: Callable[[Layer], float] | None = None


@cache
def checks() -> tuple[Check, ...]:
    """All checks, in the order of their problems in a report."""
    modules = (import_module(f".{module.name}", __name__) for module in iter_modules(__path__))
    return tuple(
        sorted((c for module in modules for c in getattr(module, "CHECKS", ())), key=lambda c: c.rank)
    )


def checks_of(subject: Subject) -> list[Check]:
    """Checks that look at a subject."""
    return [check for check in checks() if check.of == subject]


def problems_of(subject: Subject, evidence: Any) -> list[Problem]:
    """Problems of a subject."""
    return [problem for check in checks_of(subject) for problem in check.find(evidence)]
