"""The Lipschitz bound of every formula and of seams of fractals, tried at 10^7 points each.

A tenth of the points for the example, and for each of nine versions with other numbers in all its elements.
Points anywhere, and on and next to axes, poles, cell borders and fold planes; partners along the gradient and
anywhere.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import reduce
from itertools import count, islice
from zlib import crc32

import numpy as np

from fracslice.formulas import Node
from tests.examples import EXAMPLES
from tests.stability.bounds import Verdict, verdict
from tests.stability.draws import drawn, torn
from tests.stability.seams import SEAMS

from ..runner import Row, Run

SCENES = {**EXAMPLES, **SEAMS}
VERSIONS = 10
SMALLEST = {"points": 200, "names": ("sphere",)}


def versions(name: str) -> list[Node]:
    """The example and its drawn versions, always the same ones; powers are whole where the example's is."""
    root, rng = SCENES[name], np.random.default_rng(crc32(name.encode()))
    others = (drawn(root, rng, 0.5) for _ in count())
    return [root, *islice((other for other in others if torn(other) == torn(root)), VERSIONS - 1)]


def tried(name: str, tries: int) -> Verdict:
    return reduce(Verdict.__or__, (verdict(v, tries // VERSIONS, n) for n, v in enumerate(versions(name))))


def rows(run: Run, points: int = 10**7, names: tuple[str, ...] = tuple(SCENES)) -> Iterator[Row]:
    for name in names:
        root, result = SCENES[name], tried(name, points)
        kind = "free ball" if root.bounds.exterior_only else "slope"
        tries = f"{result.points:.2g}".replace("e+0", "e")
        row = {
            "": name,
            "bound on": kind,
            "L": f"{root.conservative().bounds.lipschitz:.3g}",
            "points": tries,
        }
        worst = f"{result.worst:.6f}" if result.worst else "< 0.5"
        yield {**row, "violations": result.violations, "worst, in units of L": worst}
