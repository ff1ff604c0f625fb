"""Problems of an object: the limits of the checks, what is wrong, where, how much, and the option that
mends it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ..common.messages import place
from ..common.parameters import Length, Number, attribute, validate
from ..errors import SceneError
from . import checks

SUPPORTS = "--supports medium"

Place = tuple[float, float, float]
"""Point, mm from the middle of the object along x and y, and above its lowest point."""


@dataclass(frozen=True)
class Problem:
    """One reason why an object would not print."""

    kind: str  # kind of the check
    text: str  # description with the size
    layer: int | None = None  # first layer of the largest one; None if layers were not examined
    at: Place | None = None  # place of the largest one
    mend: tuple[tuple[str, str], ...] = ()  # print settings that mend it, by name; empty if none does
    advice: str = ""  # what else helps
    count: int = 1  # number of features, such as traps
    resin: float = 0.0  # volume of resin that stays in it, mm3

    def __str__(self) -> str:
        """The problem in one line."""
        where = [] if self.layer is None else [f"layer {self.layer}"]
        if self.at is not None:
            where.append(f"at {place(self.at)} mm")
        flags = " ".join(as_option(name, value) for name, value in self.mend)
        hints = " or ".join(filter(None, [flags, self.advice]))
        return " ".join(filter(None, [f"{self.text}:" if where else self.text, ", ".join(where)])) + (
            f"; {hints}" if hints else ""
        )


def as_option(name: str, value: str) -> str:
    """A print setting as an option of a command."""
    return f"--{name.replace('_', '-')} {value}"


def verdict(problems: Sequence[Problem]) -> str:
    """Say whether an object with some problems would print: as it is, with supports, or not."""
    if not problems:
        return "would print"
    held = all(SUPPORTS in str(problem) for problem in problems)
    return "would print with supports" if held else "would not print"


def severity(problems: Sequence[Problem]) -> tuple[int, float]:
    """How bad problems are: the rank of their verdict, then a weighted count of what is wrong."""
    rank = ["would print", "would print with supports", "would not print"].index(verdict(problems))
    weights = {check.kind: check.weight for check in checks()}
    return rank, sum(weights[problem.kind] * problem.count for problem in problems)


def mends(made: Sequence[Problem], others: Sequence[Problem]) -> bool:
    """True if problems are less bad than others: in the verdict, or in number while no more resin stays."""
    mine, theirs = severity(made), severity(others)
    resin, of_others = (sum(problem.resin for problem in problems) for problems in (made, others))
    return mine[0] < theirs[0] or (mine < theirs and resin <= of_others)


def flat_base(height: float) -> str:
    """Setting "base" by which an object stands flat: a fiftieth of it, 0.5 mm or more, but at most a quarter.

    `height` in mm.
    """
    return f"{min(max(height / 50, 0.5), height / 4):.2g}mm"


def mend_settings(problems: Sequence[Problem]) -> dict[str, str]:
    """Print settings that mend as many problems as they can."""
    result: dict[str, str] = {}
    for name, value in (setting for problem in problems for setting in problem.mend):
        if name not in result or _mm(value) > _mm(result[name]):
            result[name] = value
    return result


def _mm(value: str) -> float:
    return float(value[:-2]) if value.endswith("mm") else 0.0


@dataclass(frozen=True)
class Limits:
    """Limits of the checks. Lengths are numbers of mm, or text such as "0.4mm"."""

    # components with less area in every layer (mm^2; at least 8 pixels), or less volume (mm^3), are counted
    # as specks but are not a problem
    speck: float = attribute(Number, 0.02, "an area", least=0)
    # minimum area of a suction cup, a resin trap or, in layers, a sealed cavity, mm^2
    cup: float = attribute(Number, 1.0, "an area", least=0)
    # minimum volume of a suction cup or a resin trap, mm^3: less is a film of resin
    drop: float = attribute(Number, 1.0, "a volume", least=0)
    # minimum diameter of a drain hole, mm: narrower ones may close; this limit is ours
    hole: float = attribute(Length, 0.5, "a diameter", zero=True)
    # minimum height of a suction cup, mm; every hole in the first layers is a shallow one
    deep: float = attribute(Length, 2.0, "a height", zero=True)
    # thinnest allowed wall, mm; layers are judged by their thinnest hundredth
    wall: float = attribute(Length, 0.1, "a thickness", zero=True)
    # thinnest allowed floor or roof along z, mm
    floor: float = attribute(Length, 0.1, "a thickness", zero=True)
    # minimum area of thin walls, or thin floors, that is a problem, mm^2
    thin: float = attribute(Number, 1.0, "an area", least=0)
    overhang: float = attribute(Length, 5.0, "a length")  # longest flat cantilever, mm
    span: float = attribute(Length, 20.0, "a length")  # longest flat bridge between two supports, mm
    # largest area that an area of 1 carries; a layer on less contact tears off
    neck: float = attribute(Number, 50.0, "a ratio", above=0)
    # cross-section from which a component counts as carried, mm^2
    heavy: float = attribute(Number, 20.0, "an area", least=0)
    density: float = attribute(Number, 1.1, "of the resin", above=0)  # density of the resin, g/cm^3

    def __post_init__(self) -> None:
        validate(self, SceneError)
