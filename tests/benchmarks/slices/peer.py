"""512 slices of 1024 x 1024 of a Mandelbulb, beside hand-written C++: ``python -m
tests.benchmarks.slices.peer``.

Both run in turn, five times; medians and their ratio are printed. The bulb fills [-1.2, 1.2]^3 and has 10
iterations.
"""

from __future__ import annotations

import tempfile
import time
from pathlib import Path
from statistics import median

import numpy as np

from fracslice.export import png
from fracslice.formulas import mandelbulb
from fracslice.formulas.box import Box
from fracslice.slicing import Layer, Slicer, Stack
from fracslice.slicing.raster import Screen

from ..programs import told

SIDE, LAYERS, REACH, RUNS = 1024, 512, 1.2, 5


def stack(side: int = SIDE, layers: int = LAYERS) -> Stack:
    """The job as a stack: the same lattice as the peer's, half a pixel aside."""
    width, height = 2 * REACH / side, 2 * REACH / layers
    z = -REACH + height * (np.arange(layers) + 0.5)
    corner, size = (-REACH, -REACH), (2 * REACH, 2 * REACH, 2 * REACH)
    root, tops = mandelbulb(iterations=10), height * np.arange(1, layers + 1)
    return Stack(root, 1.0, corner, (width, width), (side, side), z, tops, size, Box.centred(REACH))


def ours(job: Stack, folder: Path) -> dict[str, float]:
    screen = Screen(job)

    def make(layer: Layer) -> tuple[float, int, int]:
        data = png.encode_layer(screen, layer)
        (folder / f"{layer.index:04d}.png").write_bytes(data)
        return layer.evaluations, layer.boundary, len(data)

    wall, cpu = time.perf_counter(), time.process_time()
    spent, boundary, size = np.sum(list(Slicer(job).map(make)), axis=0)
    return {
        "wall_s": time.perf_counter() - wall,
        "cpu_s": time.process_time() - cpu,
        "evals": spent,
        "evals_per_cut_pixel": spent / boundary,
        "bytes": size,
    }


def main() -> None:
    job, results = stack(), []
    with tempfile.TemporaryDirectory() as folder:
        ours(job, Path(folder))  # compiles
        for _ in range(RUNS):
            results.append([ours(job, Path(folder)), *told("slices", Path(folder, "peer"), SIDE, LAYERS)])
    for name, runs in zip(("fracslice", "C++"), zip(*results, strict=True), strict=True):
        print(name, {key: round(median(run[key] for run in runs), 3) for key in runs[0]})
    for key in ("wall_s", "cpu_s", "evals"):
        print(f"{key}: C++ / fracslice = {median(r[1][key] / r[0][key] for r in results):.2f}")


if __name__ == "__main__":
    main()
