"""How the cost of slicing grows with the pixels: cut pixels, evaluations and CPU seconds, pictures included.

Half as many layers as pixels. A doubling makes four times the surface and eight times the volume; a fractal's
surface grows a little more than four times.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import numpy as np

from fracslice.export import images
from fracslice.export.slice_run import SliceRun
from fracslice.formulas import julia, mandelbulb, menger, torus
from fracslice.slicing import Layer, SliceJob, Slicer, plan_stack
from fracslice.slicing.raster import Screen

from ..runner import Figures, Row, Run, timed

SCENES = {
    "torus": torus(),
    "menger": menger(level=3),
    "mandelbulb": mandelbulb(iterations=6),
    "julia": julia(iterations=12),
}
RUNS = 1
SMALLEST = {"scenes": ("torus",), "pixels": (32, 64)}


def cost(name: str, pixels: int) -> Figures:
    """Cut pixels, evaluations and CPU seconds of a whole stack."""
    stack = plan_stack(SCENES[name], SliceJob(size=0.05 * pixels, layer=0.1, pixel=(0.05, 0.05)))
    layers, totals = SliceRun(stack, Screen(stack)), []

    def make(layer: Layer) -> tuple[float, float]:
        images.encode_layer(layers, layer)
        return layer.boundary, layer.evaluations

    figures = timed(lambda: totals.extend(Slicer(stack).map(make)))
    cut, evaluations = np.sum(totals, axis=0).tolist()
    return {**figures, "cut": cut, "evals": evaluations}


def rows(
    run: Run, scenes: tuple[str, ...] = tuple(SCENES), pixels: tuple[int, ...] = (256, 512, 1024)
) -> Iterator[Row]:
    for name in scenes:
        measured = run.interleaved({str(n): partial(cost, name, n) for n in pixels})
        for n, last in zip(pixels, (0, *pixels), strict=False):
            row: Row = {"": name, "pixels": n}
            for key, title in {"cut": "cut pixels", "evals": "evaluations", "cpu_s": "CPU s"}.items():
                row[title] = measured.spread(str(n), key)
                row[f"times, {title}"] = measured.ratio(str(n), str(last), key) if last else None
            yield {**row, "evaluations per cut pixel": measured.ratio(str(n), str(n), "evals", "cut")}
