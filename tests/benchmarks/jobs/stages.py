"""Stages of `fracslice mesh` with one thread and with many: what does not get faster, and its share.

"Lost" is the time of a stage beyond that of one thread divided by the number of threads, as a share of the
whole job. Finishing, checking and writing overlap. The rest is the start, the flush to disk and the exit.
"""

from __future__ import annotations

import json
import tempfile
from collections.abc import Iterator
from functools import partial
from pathlib import Path

from ..runner import Figures, Measured, Row, Run, process
from .command import COMMAND
from .mesh import scene_text

RUNS, THREADS = 3, [1, 16]
SMALLEST = {"resolutions": (16,)}
REST = "start, flush, exit"


def once(folder: Path, resolution: int, threads: int) -> Figures:
    """Seconds of each stage, of the rest and of the whole job."""
    scene, mesh, report = (folder / name for name in ("w1.xml", "out.stl", "report.json"))
    scene.write_text(scene_text())
    words = "mesh", scene, "--resolution", resolution, "--threads", threads, "--report", report, "--quiet"
    figures = process([*COMMAND, *words, "-o", mesh])
    mesh.unlink()
    stages: Figures = json.loads(report.read_text())["seconds"]
    inside, whole = stages.pop("total"), figures["wall_s"]
    return {**stages, REST: whole - inside, "all": whole, "cpu_s": figures["cpu_s"]}


def rows(run: Run, resolutions: tuple[int, ...] = (512, 1024)) -> Iterator[Row]:
    for resolution in resolutions:
        with tempfile.TemporaryDirectory() as folder:
            acts = {str(p): partial(once, Path(folder), resolution, p) for p in run.threads}
            measured = run.interleaved(acts)
        yield from stage_rows(measured, resolution, run.threads[0], run.threads[-1])


def stage_rows(measured: Measured, resolution: int, few: int, many: int) -> Iterator[Row]:
    """The rows of a resolution: its stages, then the whole job."""
    whole = measured.spread(str(many), "all").median
    for stage in measured[str(few)][0]:
        times = [measured.spread(str(p), stage) for p in (few, many)]
        row: Row = {"voxels": resolution, "stage": "all, CPU time" if stage == "cpu_s" else stage}
        row |= {f"{p} threads, s": time for p, time in zip((few, many), times, strict=True)}
        lost = times[1].median - times[0].median * few / many
        faster = times[0].median / times[1].median
        yield {**row, "times faster": faster, "lost": "" if stage == "cpu_s" else f"{lost / whole:.1%}"}
