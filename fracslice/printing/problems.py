"""Problems of an object: what, where, how large, and the option that mends it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ..common.digits import place

SUPPORTS = "supports in the slicer"

Place = tuple[float, float, float]
"""Point, mm from the middle of the object along x and y, and above its lowest point."""


@dataclass(frozen=True)
class Problem:
    """One reason why an object would not print.

    Attributes
    ----------
    kind : str
        "bodies", "islands", "overhangs", "necks", "cavities", "cups", "traps", "walls", "floors",
        "fit" or "lost".
    text : str
        Description with the size.
    layer : int or None
        First layer of the largest one; None if layers were not examined.
    at : Place or None
        Place of the largest one.
    mend : tuple of (str, str)
        Print settings that mend it, by name; empty if none does.
    advice : str
        What else helps.
    count : int
        Number of features, such as traps.
    """

    kind: str
    text: str
    layer: int | None = None
    at: Place | None = None
    mend: tuple[tuple[str, str], ...] = ()
    advice: str = ""
    count: int = 1

    def __str__(self) -> str:
        """The problem in one line."""
        where = [] if self.layer is None else [f"layer {self.layer}"]
        if self.at is not None:
            where.append(f"at {place(self.at)} mm")
        flags = " ".join(f"--{name} {value}" for name, value in self.mend)
        hints = " or ".join(filter(None, [flags, self.advice]))
        return " ".join(filter(None, [f"{self.text}:" if where else self.text, ", ".join(where)])) + (
            f"; {hints}" if hints else ""
        )


def verdict(problems: Sequence[object]) -> str:
    """Say whether an object with some problems would print: as it is, with supports, or not.

    Parameters
    ----------
    problems : sequence
        Problems of its layers, as `Problem`, and of its mesh.
    """
    if not problems:
        return "would print"
    held = all(isinstance(problem, Problem) and SUPPORTS in problem.advice for problem in problems)
    return "would print with supports" if held else "would not print"


WEIGHTS = {"fit": 1000.0, "bodies": 100.0, "cavities": 10.0, "cups": 10.0, "traps": 10.0}
"""What a feature of a kind counts among problems; 1 by default."""


def severity(problems: Sequence[object]) -> tuple[int, float]:
    """How bad problems are: the rank of their verdict, then a weighted count of what is wrong.

    Parameters
    ----------
    problems : sequence
        Problems of its layers, as `Problem`, and of its mesh.
    """
    rank = ["would print", "would print with supports", "would not print"].index(verdict(problems))
    own = [problem for problem in problems if isinstance(problem, Problem)]
    return rank, 1000.0 * (len(problems) - len(own)) + sum(WEIGHTS.get(p.kind, 1.0) * p.count for p in own)


def flat_base(height: float) -> str:
    """Setting "base" by which an object stands flat: a fiftieth of it, 0.5 mm or more, but at most a quarter.

    Parameters
    ----------
    height : float
        Height of the object, mm.

    Returns
    -------
    str
        The length.
    """
    return f"{min(max(height / 50, 0.5), height / 4):.2g}mm"


def mended(problems: Sequence[Problem]) -> dict[str, str]:
    """Print settings that mend as many problems as they can.

    Returns
    -------
    dict
        Values by the name of the setting; the largest one where several ask for the same length.
    """
    result: dict[str, str] = {}
    for name, value in (setting for problem in problems for setting in problem.mend):
        if name not in result or _mm(value) > _mm(result[name]):
            result[name] = value
    return result


def _mm(value: str) -> float:
    return float(value[:-2]) if value.endswith("mm") else 0.0
