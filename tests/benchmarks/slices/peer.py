"""512 slices of 1024 x 1024 of a Mandelbulb with 10 iterations in [-1.2, 1.2]^3, beside hand-written C++.

Ratios are C++ / fracslice. The C++ marks the pixels whose centre is inside; ours have grey rims.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from fracslice.export import images
from fracslice.export.slice_run import SliceRun
from fracslice.fields.box import Box
from fracslice.formulas import mandelbulb
from fracslice.slicing import Layer, Slicer, Stack
from fracslice.slicing.raster import Screen
from fracslice.work import Work

from ..programs import output
from ..runner import Figures, Row, Run, timed

REACH = 1.2
SMALLEST = {"side": 64, "layers": 8}


def stack(side: int, layers: int) -> Stack:
    """The job as a stack: the same lattice as the peer's, half a pixel aside."""
    width, height = 2 * REACH / side, 2 * REACH / layers
    z = -REACH + height * (np.arange(layers) + 0.5)
    corner, size = (-REACH, -REACH), (2 * REACH, 2 * REACH, 2 * REACH)
    root, tops = mandelbulb(iterations=10), height * np.arange(1, layers + 1)
    return Stack(
        root, 1.0, corner, (width, width), (side, side), z, tops, size, Box.centred(REACH), side=size[0]
    )


def ours(job: Stack, folder: Path, work: Work) -> Figures:
    layers, totals = SliceRun(job, Screen(job)), []

    def make(layer: Layer) -> tuple[float, int, int]:
        data = images.encode_layer(layers, layer)
        (folder / f"{layer.index:04d}.png").write_bytes(data)
        return layer.evaluations, layer.boundary, len(data)

    figures = timed(lambda: totals.extend(Slicer(job, work).map(make)))
    evaluations, boundary, size = np.sum(totals, axis=0).tolist()
    return {**figures, "evals": evaluations, "cut": boundary, "bytes": size}


def rows(run: Run, side: int = 1024, layers: int = 512) -> Iterator[Row]:
    job, work = stack(side, layers), Work(run.threads[0])
    with tempfile.TemporaryDirectory() as folder:
        given = Path(folder, "peer"), side, layers, "--threads", run.threads[0]
        acts = {
            "fracslice": lambda: ours(job, Path(folder), work),
            "C++": lambda: output("slices", *given)[0],
        }
        measured = run.interleaved(acts)
    for key, name in {"wall_s": "time", "cpu_s": "CPU time", "evals": "evaluations"}.items():
        ratio, out = measured.ratio("C++", "fracslice", key), "" if key == "evals" else "C++: grey rims"
        yield {
            "": name,
            "fracslice": measured.spread("fracslice", key),
            "C++ / fracslice": ratio,
            "leaves out": out,
        }
    yield {
        "": "evaluations per cut pixel",
        "fracslice": measured.ratio("fracslice", "fracslice", "evals", "cut"),
    }
