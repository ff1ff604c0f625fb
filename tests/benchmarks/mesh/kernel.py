"""Evaluations per second on one core, beside hand-written C++ on the same points.

The C++ program chooses the points: the centres of N^3 cells of a cube ("grid"), and those of them whose
estimate is under four voxels and not 0 ("band"). Its faster form counts: one or two vectors at a time.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import numpy as np

from fracslice.fields.cpu import compile_scene
from fracslice.formulas import julia, mandelbulb, menger

from ..programs import output
from ..runner import Figures, Row, Run, Spread

SCENES = {
    "mandelbulb": ("W1", mandelbulb(iterations=10)),
    "julia": ("W2", julia(iterations=12)),
    "menger": ("W3", menger(level=4)),
}
"""The peer's name for each, and the solid."""

LEAVES_OUT = "C++: sign, bound and level inside (0 there)"
SMALLEST = {"n": 32, "scenes": ("menger",)}


def peer(n: int, folder: Path) -> Figures:
    """CPU seconds of an evaluation of every set of points by every form; the points go to the folder."""
    lines = [line for line in output("kernels", n, "--runs", 1, "--points", folder) if "form" in line]
    named = {f"{line['workload']} {line['form']} {line['points']}": line for line in lines}
    return {"cpu_s": 0.0, **{key: line["n"] / line["million_per_s"] / 1e6 for key, line in named.items()}}


def rows(run: Run, n: int = 128, scenes: tuple[str, ...] = tuple(SCENES)) -> Iterator[Row]:
    with tempfile.TemporaryDirectory() as folder:
        acts: dict[str, Callable[[], object]] = {"C++": partial(peer, n, Path(folder))}
        peer(n, Path(folder))
        points = {
            (name, which): np.fromfile(Path(folder, f"{SCENES[name][0]}-{which}")).reshape(3, -1)
            for name in scenes
            for which in ("grid", "band")
        }
        for (name, which), at in points.items():
            for precision in ("float32", "float64"):
                kernel = compile_scene(SCENES[name][1], precision)  # type: ignore[arg-type]
                acts[f"{name} {precision} {which}"] = partial(kernel.points, *at.astype(precision))
        measured = run.interleaved(acts)
    for (name, which), at in points.items():
        for precision in ("float32", "float64"):
            key = f"{name} {precision} {which}"
            forms = (f"{SCENES[name][0]} {form}_{precision} {which}" for form in ("lanes", "two_lanes"))
            best = min(forms, key=lambda form: measured.spread("C++", form).median)
            speed = Spread.of([at.shape[1] / figures["cpu_s"] / 1e6 for figures in measured[key]])
            against = Spread.of(
                [c[best] / f["cpu_s"] for c, f in zip(measured["C++"], measured[key], strict=True)]
            )
            row = {"": name, "precision": precision, "points": which, "million/s": speed}
            yield {**row, "/ C++": against, "leaves out": LEAVES_OUT}
