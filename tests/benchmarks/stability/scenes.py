"""Every shipped scene with other numbers, at several resolutions: is what comes out a printable solid?

`python -m tests.benchmarks.stability.scenes [SETTINGS [RESOLUTION ...]]`: 20 random settings a scene, at 48,
80 and 128 voxels. Prints each fault with its scene, and what came of all. About an hour on one core.
"""

from __future__ import annotations

import sys
from collections import Counter
from zlib import crc32

import numpy as np

from fracslice.formulas import Node
from fracslice.scene import library, read
from tests.stability.draws import drawn
from tests.stability.solids import Outcome, outcome

SETTINGS, RESOLUTIONS = 20, (48.0, 80.0, 128.0)
SPREAD = 0.5


def settings(name: str, count: int) -> list[Node]:
    """The scene's own numbers, then `count` others; always the same ones."""
    root = read(library.path(name)).root
    rng = np.random.default_rng(crc32(name.encode()))
    return [root, *(drawn(root, rng, SPREAD) for _ in range(count))]


def _kind(found: Outcome) -> str:
    if found.refused:
        return "refused"
    if found.faults:
        return "faulty"
    return "repaired" if found.repaired else "solid"


def main() -> None:
    count = int(sys.argv[1]) if len(sys.argv) > 1 else SETTINGS
    for resolution in [float(a) for a in sys.argv[2:]] or RESOLUTIONS:
        total: Counter[str] = Counter()
        for name in library.names():
            part = Counter(_tried(name, n, root, resolution) for n, root in enumerate(settings(name, count)))
            total += part
            print(f"{name} at {resolution:g}: {dict(part)}", flush=True)
        print(f"{resolution:g} voxels: {sum(total.values())} scenes, {dict(total)}", flush=True)


def _tried(name: str, number: int, root: Node, resolution: float) -> str:
    found = outcome(root, resolution)
    if found != Outcome():
        what = found.refused or ", ".join(found.faults) or f"repaired {found.repaired}"
        print(f"{name} setting {number} at {resolution:g}: {what}\n    {root!r}", flush=True)
    return _kind(found)


if __name__ == "__main__":
    main()
