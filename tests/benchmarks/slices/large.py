"""A Mandelbulb of 3840 x 2400 pixels and 1600 layers: ``python -m tests.benchmarks.slices.large [LAYERS]``.

LAYERS: only so many, around the middle. Prints the time of the whole job (a folder of PNG files), the share
of it that pictures take, peak memory, and how many times longer evaluating each pixel with the same kernel
would take, measured on a part of them.
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from fracslice.export.jobs import SliceRun
from fracslice.export.slices import write_slices
from fracslice.formulas import mandelbulb
from fracslice.job import peak_rss_mb
from fracslice.kernel import compile_scene
from fracslice.slicing import SliceJob, Slicer, Stack, plan_stack
from fracslice.slicing.printers import printer
from fracslice.slicing.raster import Screen

LOOKED_AT = 16
"""Layers."""


def seconds(make: Callable[[], object]) -> tuple[float, float]:
    """Wall and processor time."""
    wall, cpu = time.perf_counter(), time.process_time()
    make()
    return time.perf_counter() - wall, time.process_time() - cpu


def part(stack: Stack, layers: Sequence[int]) -> Stack:
    return replace(stack, z=stack.z[layers], tops=stack.tops[: len(layers)])


def dense(stack: Stack, rows: int, columns: int) -> float:
    """Processor seconds for each pixel of all layers, in order; measured on a tenth of the rows of a few
    layers, the screen laid over the object's box."""
    kernel, z = compile_scene(stack.root), stack.z[:: max(1, len(stack.z) // LOOKED_AT)].astype(np.float32)
    x, y = (np.linspace(-1.1, 1.1, n, dtype=np.float32) for n in (columns, rows // 10))
    x, y = (a.ravel() for a in np.meshgrid(x, y))
    planes = [np.full_like(x, height) for height in z]

    def evaluate() -> None:
        for plane in planes:
            kernel.points(x, y, plane)  # let go at once: laying new pages takes longer than evaluating

    evaluate()
    return 10 * seconds(evaluate)[1] / len(z) * len(stack.z)


def main() -> None:
    machine = printer("photon-mono-4k")
    whole = plan_stack(mandelbulb(), SliceJob(size=80, layer=0.05, pixel=machine.pixel))
    count = min(int(sys.argv[1]) if sys.argv[1:] else len(whole.z), len(whole.z))
    stack = part(whole, range((len(whole.z) - count) // 2, (len(whole.z) + count) // 2))
    run = SliceRun(stack, Screen(stack, machine))
    rows, columns = run.screen.shape
    list(Slicer(stack).map(run.screen.deflated, [count // 2]))
    with tempfile.TemporaryDirectory() as folder:
        wall, cpu = seconds(lambda: write_slices(run, Path(folder) / "layers", "png"))
        size = sum(f.stat().st_size for f in Path(folder).rglob("*.png"))
    sampling = seconds(lambda: list(Slicer(stack).map(lambda layer: layer.evaluations)))[1]
    every = dense(stack, rows, columns)
    print(f"{count} layers of {columns} x {rows}: {wall:.1f} s wall, {cpu:.1f} s CPU, {size / 1e6:.0f} MB")
    print(f"pictures take {1 - sampling / cpu:.0%} of the CPU time; peak memory {peak_rss_mb():.0f} MB")
    print(f"every pixel by the same kernel: {every:.0f} s CPU, {every / cpu:.1f} times; ", end="")
    print(f"without pictures {every / sampling:.1f} times")


if __name__ == "__main__":
    main()
