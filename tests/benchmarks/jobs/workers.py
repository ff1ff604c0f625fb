"""Speed of several workers against one: a mesh and frames, tasks on threads of each worker.

Each worker is a process with some threads, of which each makes a task at a time. A worker plans the scene
itself; kernels are cached on disk by a small job before.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from pathlib import Path

from fracslice.cluster import connected
from fracslice.work import Work

from ..runner import Figures, Row, Run, Spread
from .cluster import Job, cpu_of, jobs

RUNS, THREADS = 1, [4]
SMALLEST = {"voxels": 16, "width": 16, "frames": 1, "workers": 1}
KINDS = "mesh", "frames"


def rows(
    run: Run, voxels: int = 1024, width: int = 1920, frames: int = 48, workers: int = 8
) -> Iterator[Row]:
    each, sizes = run.threads[0], (64, 8, voxels, width, frames)
    large, small = jobs(*sizes), jobs(64, 8, 64, 64, 2)
    for kind in KINDS:
        alone = [measured(large[kind], small[kind], 1, each) for _ in range(run.runs)]
        many = [measured(large[kind], small[kind], workers, each) for _ in range(run.runs)]
        one, all_ = (Spread.of([figures["wall_s"] for figures in found]) for found in (alone, many))
        yield {
            "": kind,
            f"1 worker of {each} threads, s": one.median,
            f"{workers} workers, s": all_.median,
            "times faster": one.median / all_.median,
            "CPU s": alone[0]["cpu_s"],
            "CPU s of all": many[0]["cpu_s"],
        }


def measured(job: Job, small: Job, workers: int, threads: int) -> Figures:
    """Figures of a job by fresh workers, after a small one."""
    with (
        tempfile.TemporaryDirectory() as name,
        connected(f"local:{workers}", f"{name}/pieces", workers * threads) as pool,
    ):
        work, folder = Work(threads, cluster=pool), Path(name)
        small(work, folder)
        (folder / "large").mkdir()
        return cpu_of(lambda: job(work, folder / "large"), pool)
