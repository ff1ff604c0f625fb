"""Random scenes, each another tree: are mesh and layers solids of the field's own volume, or do they say so?

`python -m tests.benchmarks.stability.random_scenes [COUNT [FIRST [RESOLUTION]]]`: 500 at 48 voxels (`make
nightly`). Prints each that is told of or at fault, and what came of all; exit status 1 if one is at fault.
"""

from __future__ import annotations

import sys

import numpy as np

from tests.stability.random_scenes import random_scene
from tests.stability.volumes import TOLERANCE, volumes

COUNT, RESOLUTION = 500, 48.0


def main() -> int:
    count, first = ([int(a) for a in sys.argv[1:3]] + [COUNT, 0][len(sys.argv[1:3]) :])[:2]
    resolution = float(sys.argv[3]) if len(sys.argv) > 3 else RESOLUTION
    faulty, told, off = 0, 0, []
    for tree in range(first, first + count):
        found = volumes(random_scene(tree, 0), resolution)
        faulty, told = faulty + bool(found.faults), told + bool(found.told)
        off.append(max(abs(found.off), abs(found.layers)))
        if found.faults or found.told:
            print(f"{tree}: {'; '.join(found.faults) or 'told'}; {'; '.join(found.told)}", flush=True)
            print(f"    mesh {found.off:+.2%}, layers {found.layers:+.2%}: {random_scene(tree, 0)}")
    good = np.mean(np.array(off) <= TOLERANCE)
    print(
        f"{count} scenes at {resolution:g}: {good:.0%} within {TOLERANCE:.0%}, {told} told, {faulty} faulty"
    )
    return 1 if faulty else 0


if __name__ == "__main__":
    sys.exit(main())
