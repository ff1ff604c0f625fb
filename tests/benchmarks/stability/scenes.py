"""Every shipped scene with random settings of its parameters, at several resolutions: is the mesh a solid?

Half of the values are from anywhere in the declared range. About an hour on one core.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from zlib import crc32

import numpy as np

from fracslice.formulas import Node
from fracslice.scene import library, read
from tests.stability.draws import drawn
from tests.stability.solids import Outcome, outcome

from ..runner import Row, Run

SPREAD = 0.5
SMALLEST = {"names": ("mandelbulb",), "settings": 0, "resolutions": (16.0,)}


def drawn_settings(name: str, count: int) -> list[Node]:
    """The scene's own numbers, then `count` others; always the same ones."""
    root = read(library.path(name)).root
    rng = np.random.default_rng(crc32(name.encode()))
    return [root, *(drawn(root, rng, SPREAD) for _ in range(count))]


def kind(result: Outcome) -> str:
    if result.refused:
        return "refused"
    if result.faults:
        return "violations"
    return "repaired" if result.repaired else "solid"


def rows(
    run: Run,
    settings: int = 20,
    resolutions: tuple[float, ...] = (48.0, 80.0, 128.0),
    names: tuple[str, ...] = tuple(library.names()),
) -> Iterator[Row]:
    for resolution in resolutions:
        total: Counter[str] = Counter()
        for name in names:
            for number, root in enumerate(drawn_settings(name, settings)):
                result = outcome(root, resolution)
                total[kind(result)] += 1
                if result.faults:
                    text = f"{name} setting {number} at {resolution:g}: {', '.join(result.faults)}"
                    run.faults.append(f"{text}\n    {root!r}")
        solid = total["solid"] + total["repaired"]
        counts = {"solid": solid, **{key: total[key] for key in ("repaired", "refused", "violations")}}
        yield {"voxels": int(resolution), "meshes": total.total(), **counts}
