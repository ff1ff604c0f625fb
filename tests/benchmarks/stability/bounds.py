"""The Lipschitz bound of every formula, tried at 10^7 points.

`python -m tests.benchmarks.stability.bounds [POINTS [NAME]] [--write]`: the example of every formula, seams
of fractals, and nine versions of each with other numbers in all its elements, a tenth of the points each.
Points anywhere, and on and next to axes, poles, cell borders and fold planes; partners along the gradient and
anywhere.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from functools import reduce
from itertools import count, islice
from zlib import crc32

import numpy as np

from fracslice.formulas import Node
from tests.benchmarks.tables import publish, table
from tests.examples import EXAMPLES
from tests.stability.bounds import Verdict, verdict
from tests.stability.draws import drawn, torn
from tests.stability.seams import SEAMS

SCENES = {**EXAMPLES, **SEAMS}
VERSIONS = 10


def versions(name: str) -> list[Node]:
    """The example and its drawn versions, always the same ones; powers are whole where the example's is."""
    root, rng = SCENES[name], np.random.default_rng(crc32(name.encode()))
    others = (drawn(root, rng, 0.5) for _ in count())
    return [root, *islice((other for other in others if torn(other) == torn(root)), VERSIONS - 1)]


def tried(name: str, tries: int) -> Verdict:
    return reduce(Verdict.__or__, (verdict(v, tries // VERSIONS, n) for n, v in enumerate(versions(name))))


def rows(tries: int, wanted: str) -> Iterator[list[str]]:
    for name, root in SCENES.items():
        if wanted in name:
            found = tried(name, tries)
            kind = "free ball" if root.bounds.exterior_only else "slope"
            points = f"{found.points:.2g}".replace("e+0", "e")
            bound = f"{root.conservative().bounds.lipschitz:.3g}"
            worst = f"{found.worst:.6f}" if found.worst else "< 0.5"
            yield [name, kind, bound, points, str(found.violations), worst]


def main() -> None:
    given = [a for a in sys.argv[1:] if not a.startswith("--")]
    tries, wanted = int(float(given[0])) if given else 10**7, given[1] if len(given) > 1 else ""
    head = ["", "bound on", "L", "points", "violations", "worst, in units of L"]
    publish("bounds", table(head, rows(tries, wanted)))


if __name__ == "__main__":
    main()
