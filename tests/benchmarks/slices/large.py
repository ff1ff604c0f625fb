"""A Mandelbulb of 3840 x 2400 pixels and 1582 layers, as a folder of PNG files.

Beside it, every pixel of every layer evaluated with the same kernel: a tenth of the rows of some layers.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from fracslice.common.memory import peak_rss_mb
from fracslice.export.layers import write_slices
from fracslice.export.slice_run import SliceRun
from fracslice.formulas import mandelbulb
from fracslice.slicing import SliceJob, Slicer, Stack, plan_stack
from fracslice.slicing.printers import printer
from fracslice.slicing.raster import Screen
from fracslice.work import Work

from ..runner import Figures, Row, Run, timed

LOOKED_AT = 64
"""Layers."""

SMALLEST = {"layers": 4}


def part(stack: Stack, layers: Sequence[int]) -> Stack:
    return replace(stack, z=stack.z[layers], tops=stack.tops[: len(layers)])


def dense(stack: Stack, shape: tuple[int, int], work: Work) -> Figures:
    """CPU seconds for each pixel of all layers, in order, the screen laid over the object's box."""
    kernel, z = stack.root.kernel(), stack.z[:: max(1, len(stack.z) // LOOKED_AT)].astype(np.float32)
    x, y = (np.linspace(-1.1, 1.1, n, dtype=np.float32) for n in (shape[1], shape[0] // 10))
    x, y = (a.ravel() for a in np.meshgrid(x, y))
    planes = [np.full_like(x, height) for height in z]

    def evaluate(plane: np.ndarray) -> None:
        kernel.points(x, y, plane)  # let go at once: laying new pages takes longer than evaluating

    spent = timed(lambda: work.map(evaluate, planes))["cpu_s"]
    return {"cpu_s": 10 * spent / len(z) * len(stack.z)}


def written(run: SliceRun) -> Figures:
    with tempfile.TemporaryDirectory() as folder:
        figures = timed(lambda: write_slices(run, Path(folder) / "layers", "png"))
        size = sum(f.stat().st_size for f in Path(folder).rglob("*.png"))
    return {**figures, "kB a picture": size / run.layers / 1e3, "peak_mb": peak_rss_mb()}


def rows(run: Run, layers: int = 0) -> Iterator[Row]:
    machine = printer("photon-mono-4k")
    whole = plan_stack(mandelbulb(), SliceJob(size=80, layer=0.05, pixel=machine.pixel))
    count = min(layers or len(whole.z), len(whole.z))
    stack = part(whole, range((len(whole.z) - count) // 2, (len(whole.z) + count) // 2))
    job, work = SliceRun(stack, Screen(stack, printer=machine)), Work(run.threads[0])
    acts = {
        "job": lambda: written(job),
        "sampling": lambda: list(Slicer(stack).map(lambda layer: layer.evaluations)),
        "every pixel": lambda: dense(stack, job.screen.shape, work),
    }
    measured = run.interleaved(acts)
    yield {"": "layers", "figure": count}
    yield {"": "time, s", "figure": measured.spread("job", "wall_s")}
    yield {"": "CPU time, s", "figure": measured.spread("job", "cpu_s")}
    yield {"": "memory, MB", "figure": measured["job"][0]["peak_mb"]}
    yield {"": "picture size, kB", "figure": measured.spread("job", "kB a picture")}
    against = "evaluating each pixel, CPU time / the job's"
    yield {
        "": against,
        "figure": measured.ratio("every pixel", "job", "cpu_s"),
        "leaves out": "pictures",
    }
    yield {"": f"{against}, without pictures", "figure": measured.ratio("every pixel", "sampling", "cpu_s")}
