"""Supports, and directions up, of objects in layers of 0.05 mm, beside the supports of PrusaSlicer.

The Mandelbulb is 60 mm long. PrusaSlicer exports layers, too, as its supports cannot be made alone; without a
result within 600 s of wall time it has none.
"""

from __future__ import annotations

import shutil
import subprocess
import tempfile
import zipfile
from collections.abc import Iterator
from pathlib import Path

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
"""Seconds that PrusaSlicer has."""

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
layer_height = 0.05
initial_layer_height = 0.05
"""


def rows(run: Run, names: tuple[str, ...] = tuple(OBJECTS), peer: int = 1) -> Iterator[Row]:
    for name in names:
        row = _ours(run, *OBJECTS[name])
        if peer and shutil.which("prusa-slicer"):
            row |= _prusa(*OBJECTS[name], float(row["supports, CPU s"].median), row["supports, mm3"])
        yield {"": name, **row}


def _ours(run: Run, root: Node, size: float) -> Row:
    """Volume of supports, and the time of both searches."""
    work, made = Work(threads=run.threads[0]), list[float]()
    job = SliceJob(size=size, layer=0.05, printing=Print(supports="medium"))

    def supports() -> None:
        stack = plan_stack(root, job, work)
        made.append(stack.supports.volume if stack.supports else 0.0)

    acts = {"supports": supports, "orient": lambda: orientations(root, Sizing(size), work)}
    figures = run.interleaved(acts, warm=False)
    return {"supports, mm3": made[-1], **{f"{act}, CPU s": figures.spread(act, "cpu_s") for act in acts}}


def _prusa(root: Node, size: float, seconds: float, volume: float) -> Row:
    """Supports of PrusaSlicer, and ours in relation to them."""
    with tempfile.TemporaryDirectory() as folder:
        model, settings, output = (Path(folder) / name for name in ("o.stl", "sla.ini", "o.sl1"))
        settings.write_text(SETTINGS)
        own = make_mesh(scene(root, size=size), MeshJob(simplify=0.02), path=model).report.mesh.volume_mm3
        words = ["prusa-slicer", "--load", settings, "--export-sla", model, "--output", output]
        try:
            figures: Figures = process(["timeout", str(LIMIT), *words])
        except (SystemExit, subprocess.SubprocessError):
            return {"PrusaSlicer": f"none within {LIMIT} s"}
        with zipfile.ZipFile(output) as archive:
            lines = archive.read("config.ini").decode().splitlines()
        used = next(float(line.partition("=")[2]) for line in lines if line.startswith("usedMaterial"))
        theirs = 1000 * used - own
        return {
            "PrusaSlicer, mm3": theirs,
            "PrusaSlicer, CPU s": figures["cpu_s"],
            "volume, ratio": volume / theirs,
            "time, ratio": seconds / figures["cpu_s"],
        }
