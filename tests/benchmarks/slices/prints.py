"""A large job in the files of printers beside a folder of PNG.

A Mandelbulb of 2,000 layers on a screen of 8192 x 5120 pixels, the same in each file. A file should take at
most 1.3 times the time of PNG.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from functools import partial
from pathlib import Path

from fracslice.export.layers import write_slices
from fracslice.export.slice_run import SliceRun
from fracslice.formulas import mandelbulb
from fracslice.jobs.slices import StackModel
from fracslice.scene import scene
from fracslice.slicing import SliceJob, plan_stack
from fracslice.slicing.printers import Printer, Resin
from fracslice.slicing.raster import Screen
from fracslice.work import Work

from ..runner import Figures, Row, Run, timed
from .large import part

MACHINE = Printer("large", "8K by 5K", (8192, 5120), (204.8, 128.0), 130)
FORMS = {"png": "layers", "goo": "part.goo", "ctb": "part.ctb", "sl1": "part.sl1", "nanodlp": "part.nanodlp"}
RUNS = 3
SMALLEST = {"layers": 4}


def written(run: SliceRun, name: str) -> Figures:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / name
        figures = timed(lambda: write_slices(run, path))
        files = path.rglob("*.png") if path.is_dir() else [path]
        return {**figures, "kB": sum(file.stat().st_size for file in files) / run.layers / 1e3}


def rows(run: Run, layers: int = 2000) -> Iterator[Row]:
    job = SliceJob(size=100, layer=0.05, pixel=MACHINE.pixel)
    whole = plan_stack(mandelbulb(), job)
    count = min(layers, len(whole.z))
    stack = part(whole, range((len(whole.z) - count) // 2, (len(whole.z) + count) // 2))
    picture = StackModel(scene(mandelbulb(), size=100), job, Work()).picture()
    one = SliceRun(
        stack,
        Screen(stack, printer=MACHINE),
        Work(run.threads[0]),
        Resin(2.5, 30),
        {},
        picture=lambda: picture,
    )
    measured = run.interleaved({form: partial(written, one, name) for form, name in FORMS.items()})
    for form in FORMS:
        yield {
            "": form,
            "layers": count,
            "time, s": measured.spread(form, "wall_s"),
            "CPU time, s": measured.spread(form, "cpu_s"),
            "CPU time / PNG's": measured.ratio(form, "png", "cpu_s"),
            "kB a layer": measured.spread(form, "kB"),
        }
