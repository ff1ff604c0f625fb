"""A Mandelbulb of 3840 x 2400 pixels and 1600 layers: ``python -m tests.benchmarks.slices.large [LAYERS]``.

LAYERS: only so many, around the middle. Prints the time of the whole job (a folder of PNG files), the share
of it that pictures take, peak memory, and how many times longer evaluating each pixel with the same kernel
would take, measured on a part of them. All three run in turn, five times; times are medians, ratios those of
each turn. Last comes what ISA-L's fastest deflate alone would take for the same pictures.
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from statistics import median

import numpy as np
from isal import isal_zlib

from fracslice.export.jobs import SliceRun
from fracslice.export.slices import write_slices
from fracslice.formulas import mandelbulb
from fracslice.job import peak_rss_mb
from fracslice.slicing import SliceJob, Slicer, Stack, plan_stack
from fracslice.slicing.printers import printer
from fracslice.slicing.raster import Screen
from fracslice.work import Work

LOOKED_AT, RUNS = 64, 5
"""Layers; turns."""


def seconds(make: Callable[[], object]) -> tuple[float, float]:
    """Wall and processor time."""
    wall, cpu = time.perf_counter(), time.process_time()
    make()
    return time.perf_counter() - wall, time.process_time() - cpu


def part(stack: Stack, layers: Sequence[int]) -> Stack:
    return replace(stack, z=stack.z[layers], tops=stack.tops[: len(layers)])


def dense(stack: Stack, rows: int, columns: int) -> float:
    """Processor seconds for each pixel of all layers, in order, on all cores as the job; measured on a tenth
    of the rows of a few layers, the screen laid over the object's box."""
    kernel, z = stack.root.kernel(), stack.z[:: max(1, len(stack.z) // LOOKED_AT)].astype(np.float32)
    x, y = (np.linspace(-1.1, 1.1, n, dtype=np.float32) for n in (columns, rows // 10))
    x, y = (a.ravel() for a in np.meshgrid(x, y))
    planes = [np.full_like(x, height) for height in z]

    def evaluate(plane: np.ndarray) -> None:
        kernel.points(x, y, plane)  # let go at once: laying new pages takes longer than evaluating

    Work().map(evaluate, planes)
    return 10 * seconds(lambda: Work().map(evaluate, planes))[1] / len(z) * len(stack.z)


def by_isal(run: SliceRun, layers: Sequence[int]) -> tuple[float, float]:
    """Processor seconds for the pictures of all layers, and how many times the bytes; measured on some."""
    ours = list(run.slicer.map(run.screen.deflated, layers))
    rows = [isal_zlib.decompress(data) for data in ours]
    theirs: list[bytes] = []
    spent = seconds(lambda: theirs.extend(isal_zlib.compress(row, 1) for row in rows))[1]
    return spent / len(layers) * run.layers, sum(map(len, theirs)) / sum(map(len, ours))


def times(longer: list[float], shorter: list[float]) -> str:
    ratios = [a / b for a, b in zip(longer, shorter, strict=True)]
    return f"{median(ratios):.1f} times ({min(ratios):.1f} to {max(ratios):.1f})"


def main() -> None:
    machine = printer("photon-mono-4k")
    whole = plan_stack(mandelbulb(), SliceJob(size=80, layer=0.05, pixel=machine.pixel))
    count = min(int(sys.argv[1]) if sys.argv[1:] else len(whole.z), len(whole.z))
    stack = part(whole, range((len(whole.z) - count) // 2, (len(whole.z) + count) // 2))
    run = SliceRun(stack, Screen(stack, machine))
    rows, columns = run.screen.shape
    list(Slicer(stack).map(run.screen.deflated, [count // 2]))
    walls, jobs, sampling, every, peaks = [], [], [], [], []
    for _ in range(RUNS):
        with tempfile.TemporaryDirectory() as folder:
            wall, cpu = seconds(lambda folder=folder: write_slices(run, Path(folder) / "layers", "png"))
            size = sum(f.stat().st_size for f in Path(folder).rglob("*.png"))
        walls.append(wall)
        jobs.append(cpu)
        sampling.append(seconds(lambda: list(Slicer(stack).map(lambda layer: layer.evaluations)))[1])
        peaks.append(peak_rss_mb())
        every.append(dense(stack, rows, columns))
    print(f"{count} layers of {columns} x {rows}: {median(walls):.2f} s wall, {median(jobs):.2f} s CPU")
    print(f"{size / 1e6:.0f} MB of pictures, peak memory {peaks[0]:.0f} MB")
    print(f"every pixel by the same kernel: {median(every):.0f} s CPU")
    print(f"the job against that: {times(every, jobs)}; without pictures {times(every, sampling)}")
    spent, larger = by_isal(run, range(0, count, -(-count // LOOKED_AT)))
    print(f"deflating its pictures by ISA-L: {spent:.2f} s CPU, {larger:.1f} times the bytes")


if __name__ == "__main__":
    main()
