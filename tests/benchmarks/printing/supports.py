"""Supports, and directions up, of objects in layers of 0.05 mm, beside the supports of PrusaSlicer.

The Mandelbulb is 60 mm long. PrusaSlicer exports layers, too, as its supports cannot be made alone; without a
result within 600 CPU seconds it has none.
"""

from __future__ import annotations

import shutil
import subprocess
import tempfile
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from fracslice import MeshJob, make_mesh
from fracslice.formulas import Node, box, cylinder, mandelbulb, sphere, transform, union
from fracslice.records import Print
from fracslice.scene import scene
from fracslice.slicing import SliceJob, plan_stack
from fracslice.slicing.orientation import orientations
from fracslice.volume.amount import Sizing
from fracslice.work import Work

from ..runner import Figures, Row, Run, process

SMALLEST = {"names": ("ball",), "peer": 0}
RUNS = 1
LIMIT = 600
"""CPU seconds that PrusaSlicer has, whatever else the machine does."""

LEGS = [transform(box(size=(3, 3, 20)), translate=(x, y, 0)) for x in (-17, 17) for y in (-12, 12)]
OBJECTS: dict[str, tuple[Node, float]] = {
    "ball": (sphere(radius=15), 30),
    "mushroom": (
        union(cylinder(radius=3, height=20), transform(cylinder(radius=12, height=4), translate=(0, 0, 12))),
        24,
    ),
    "table": (union(transform(box(size=(40, 30, 2)), translate=(0, 0, 10)), *LEGS), 40),
    "mandelbulb": (mandelbulb(), 60),
}
SETTINGS = """printer_technology = SLA
supports_enable = 1
pad_enable = 0
layer_height = {0}
initial_layer_height = {0}
"""


def rows(run: Run, names: tuple[str, ...] = tuple(OBJECTS), peer: int = 1) -> Iterator[Row]:
    for name in names:
        row = ours(run, *OBJECTS[name], layer=0.05)
        if peer:
            root, size = OBJECTS[name]
            with tempfile.TemporaryDirectory() as folder:
                model = Path(folder) / "o.stl"
                own = make_mesh(scene(root, size=size), MeshJob(simplify=0.02), path=model).report.mesh
                row |= prusa(model, own.volume_mm3, 0.05, row)
        yield {"": name, **row}


def ours(run: Run, root: Node, size: float, layer: float, orient: bool = True) -> Row:
    """Volume of our supports, and the time of both searches."""
    work, made = Work(threads=run.threads[0]), list[float]()
    job = SliceJob(size=size, layer=layer, printing=Print(supports="medium"))

    def supports() -> None:
        stack = plan_stack(root, job, work)
        made.append(stack.supports.volume if stack.supports else 0.0)

    acts: dict[str, Callable[[], Any]] = {"supports": supports}
    if orient:
        acts["orient"] = lambda: orientations(root, Sizing(size), work)
    figures = run.interleaved(acts, warm=False)
    return {"supports, mm3": made[-1], **{f"{act}, CPU s": figures.spread(act, "cpu_s") for act in acts}}


def prusa(model: Path, own: float, layer: float, of: Row) -> Row:
    """Supports of PrusaSlicer for an STL file, and ours in relation to them.

    `own`: volume of the model, mm3; `of`: what `ours` found.
    """
    if not shutil.which("prusa-slicer"):
        return {"PrusaSlicer": "not installed"}
    settings, output = model.with_suffix(".ini"), model.with_suffix(".sl1")
    settings.write_text(SETTINGS.format(layer))
    words = ["prusa-slicer", "--load", settings, "--export-sla", model, "--output", output]
    try:
        figures: Figures = process(["prlimit", f"--cpu={LIMIT}", *words])
    except (SystemExit, subprocess.SubprocessError):
        return {"PrusaSlicer": f"none within {LIMIT} CPU s"}
    with zipfile.ZipFile(output) as archive:
        lines = archive.read("config.ini").decode().splitlines()
    used = next(float(line.partition("=")[2]) for line in lines if line.startswith("usedMaterial"))
    theirs = 1000 * used - own
    return {
        "PrusaSlicer, mm3": theirs,
        "PrusaSlicer, CPU s": figures["cpu_s"],
        "volume, ratio": of["supports, mm3"] / theirs,
        "time, ratio": of["supports, CPU s"].median / figures["cpu_s"],
    }
