"""What the exact surface costs beside marching cubes on the samples alone, warm, in CPU seconds:
`python -m tests.benchmarks.mesh.exact [--resolution 256]`.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from fracslice._native import Cells
from fracslice.kernel import compile_scene
from fracslice.mesh.extract import clamp, contour, extract
from fracslice.scene.reader import read
from fracslice.volume import plan, sample_scene
from fracslice.volume.crossings import refine_crossings

SCENES = Path(__file__).parents[3] / "scenes"
RUNS = 4


def timed(act: Callable[[], Any]) -> tuple[float, Any]:
    """The least CPU seconds of some runs, and what the last one gave."""
    seconds, found = [], None
    for _ in range(RUNS):
        start = time.process_time()
        found = act()
        seconds.append(time.process_time() - start)
    return min(seconds), found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenes", nargs="*", default=["mandelbulb", "quaternion-julia", "menger-sponge"])
    parser.add_argument("--resolution", type=float, default=256)
    given = parser.parse_args()
    stages = ("samples", "plain", "exact", "crossings", "features", "ratio", "mean |f|", "max |f|")
    print(" " * 18 + " ".join(f"{stage:>9}" for stage in stages))
    for name in given.scenes:
        planned = plan(read(SCENES / f"{name}.xml").root, given.resolution)
        sampling, bricks = timed(partial(sample_scene, planned))
        plain, _ = timed(partial(extract, bricks))
        exact, mesh = timed(partial(contour, planned.root, bricks))
        signs, last = bricks.signs, len(bricks.index)
        cells = Cells(signs.ijk, signs.signs, signs.index)
        lower, axis = cells.crossed_edges(-2, last + 2)
        place = bricks.origin, bricks.voxel
        refining, found = timed(partial(refine_crossings, planned.root, *place, lower, axis))
        building, _ = timed(partial(cells.contour, -1, last, found.t, found.normals, *place, clamp(signs)))
        ratio = (sampling + exact) / (sampling + plain)
        times = sampling, plain, exact, refining, building, ratio
        off = np.abs(compile_scene(planned.root, "float64").points(*mesh.vertices.T)) / planned.voxel
        print(f"{name:18}" + " ".join(f"{x:9.3f}" for x in times), f"{off.mean():9.1e} {off.max():9.1e}")


if __name__ == "__main__":
    main()
