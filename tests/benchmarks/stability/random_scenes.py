"""Random scenes, each another tree: mesh and layers are solids of the field's volume, or say so.

`make nightly`. A scene with a problem that no report names is a fault.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from tests.stability.random_scenes import random_scene
from tests.stability.volumes import TOLERANCE, volumes

from ..runner import Row, Run

SMALLEST = {"count": 1, "resolution": 12.0}


def rows(run: Run, count: int = 500, first: int = 0, resolution: float = 48.0) -> Iterator[Row]:
    faulty, reported, off = 0, 0, []
    for tree in range(first, first + count):
        result = volumes(random_scene(tree, 0), resolution)
        faulty, reported = faulty + bool(result.faults), reported + bool(result.reported)
        off.append(max(abs(result.off), abs(result.layers)))
        if result.faults:
            run.faults.append(f"{tree}: {'; '.join(result.faults)}\n    {random_scene(tree, 0)}")
        if result.faults or result.reported:
            row = {"": tree, "mesh": f"{result.off:+.2%}", "layers": f"{result.layers:+.2%}"}
            yield {**row, "faults": "; ".join(result.faults), "reported": "; ".join(result.reported)}
    good = float(np.mean(np.array(off) <= TOLERANCE))
    yield {
        "": "all",
        f"within {TOLERANCE:.0%}": f"{good:.0%}",
        "faults": str(faulty),
        "reported": str(reported),
    }
