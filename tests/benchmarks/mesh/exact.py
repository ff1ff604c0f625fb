"""What the exact surface costs beside marching cubes on the samples alone, warm, in CPU seconds
and by the clock:
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

from fracslice._native import Cells, Contouring
from fracslice.formulas import Node
from fracslice.mesh.crossings import Crossings, Refiner
from fracslice.mesh.extract import contour, extract, minimum_edge_parameter
from fracslice.scene.reader import read
from fracslice.volume import plan, sample_scene

SCENES = Path(__file__).parents[3] / "scenes"
RUNS = 5


def timed(acts: list[Callable[[], Any]]) -> np.ndarray:
    """The least seconds of some runs of each, taken in turn: CPU's and by the clock, [2, n]."""
    seconds = np.full((2, len(acts)), np.inf)
    for _ in range(RUNS):
        for k, act in enumerate(acts):
            start = time.process_time(), time.perf_counter()
            act()
            spent = time.process_time() - start[0], time.perf_counter() - start[1]
            seconds[:, k] = np.minimum(seconds[:, k], spent)
    return seconds


def crossings(
    root: Node, cells: Cells, place: tuple[tuple[float, float, float], float], end: int
) -> Crossings:
    """All of them, exact."""
    return Refiner(root, cells, *place).between(0, end)


def triangles(
    cells: Cells,
    last: int,
    known: Crossings,
    origin: tuple[float, float, float],
    voxel: float,
    clamped: float,
) -> None:
    """All layers through crossings that are known."""
    surface = Contouring(cells, -1, last, origin, voxel, clamped)
    surface.advance(last + 1, 0, known.t, known.normals)
    surface.finish()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenes", nargs="*", default=["mandelbulb", "quaternion-julia", "menger-sponge"])
    parser.add_argument("--resolution", type=float, default=256)
    given = parser.parse_args()
    stages = (
        "samples",
        "plain",
        "exact",
        "crossings",
        "features",
        "ratio",
        "by clock",
        "mean |f|",
        "max |f|",
    )
    print(" " * 18 + " ".join(f"{stage:>9}" for stage in stages))
    for name in given.scenes:
        planned = plan(read(SCENES / f"{name}.xml").root, given.resolution)
        bricks = sample_scene(planned)
        signs, last = bricks.signs, len(bricks.index)
        cells = Cells(signs.ijk, signs.signs, signs.index)
        place = bricks.origin, bricks.voxel
        refining = partial(crossings, planned.root, cells, place, cells.crossings_before(last))
        found = refining()
        seconds = timed(
            [
                partial(sample_scene, planned),
                partial(extract, bricks),
                partial(contour, planned.root, bricks),
                refining,
                partial(triangles, cells, last, found, *place, minimum_edge_parameter(signs)),
            ]
        )
        samples, plain, exact = seconds[:, :3].T
        mesh = contour(planned.root, bricks)
        off = np.abs(planned.root.kernel("cpu", "float64").points(*mesh.vertices.T)) / planned.voxel
        row = (*seconds[0], *((samples + exact) / (samples + plain)))
        print(f"{name:18}" + " ".join(f"{x:9.3f}" for x in row), f"{off.mean():9.1e} {off.max():9.1e}")


if __name__ == "__main__":
    main()
