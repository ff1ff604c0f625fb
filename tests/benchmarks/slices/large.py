"""A Mandelbulb of 3840 x 2400 pixels and 1600 layers: ``python -m tests.benchmarks.slices.large [LAYERS]``.

LAYERS: only so many, from the middle. Prints seconds for the whole job, for its layers without pictures,
for writing alone, peak memory, and what evaluating each pixel with the same kernel would take, measured on
one layer.
"""

from __future__ import annotations

import os
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from fracslice.export import png
from fracslice.formulas import mandelbulb
from fracslice.job import peak_rss_mb
from fracslice.kernel import compile_scene
from fracslice.slicing import Layer, SliceJob, Slicer, plan_stack
from fracslice.slicing.printers import printer
from fracslice.slicing.raster import Screen


def seconds(make: Callable[[], Any]) -> float:
    begin = time.perf_counter()
    make()
    return time.perf_counter() - begin


def main() -> None:
    machine = printer("photon-mono-4k")
    stack = plan_stack(mandelbulb(), SliceJob(size=80, layer=0.05, pixel=machine.pixel))
    total = len(stack.z)
    count = min(int(sys.argv[1]) if sys.argv[1:] else total, total)
    chosen = range((total - count) // 2 // 8 * 8, (total + count) // 2)
    screen = Screen(stack, machine)
    with tempfile.TemporaryDirectory() as folder:

        def write(layer: Layer) -> None:
            (Path(folder) / f"{layer.index}.png").write_bytes(png.encode(screen.picture(layer, png.canvas(*screen.shape))))

        list(Slicer(stack).map(write, [total // 2]))
        whole = seconds(lambda: list(Slicer(stack).map(write, chosen)))
        size = sum(f.stat().st_size for f in Path(folder).iterdir())
    bare = seconds(lambda: list(Slicer(stack).map(lambda layer: layer.boundary, chosen)))
    rows, columns = screen.shape
    x, y = np.random.default_rng(0).uniform(-1.1, 1.1, (2, rows * columns // 4)).astype(np.float32)
    heights = np.random.default_rng(1).choice(stack.z[chosen], len(x)).astype(np.float32)
    kernel = compile_scene(stack.root)
    dense = 4 * seconds(lambda: kernel.points(x, y, heights)) * len(chosen) / (os.cpu_count() or 1)
    print(f"{len(chosen)} layers of {columns} x {rows}: {whole:.1f} s, {size / 1e6:.0f} MB of pictures")
    print(
        f"layers alone {bare:.1f} s; every pixel by the same kernel {dense:.0f} s: {dense / bare:.1f} times"
    )
    print(f"peak memory {peak_rss_mb():.0f} MB")


if __name__ == "__main__":
    main()
