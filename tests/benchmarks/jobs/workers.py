"""Speed of several workers against one: a mesh and frames, tasks on threads of each worker.

Each worker is a process with some threads, of which each makes a task at a time. A worker plans the scene
itself; kernels are cached on disk by a small job before.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path

from fracslice.cluster import connect
from fracslice.work import Work

from ..runner import Figures, Row, Run, Spread
from .cluster import Job, cpu_of, jobs

RUNS, THREADS = 1, [4]
SMALLEST = {"voxels": 16, "width": 16, "frames": 1, "samples": 1, "workers": 1}


def rows(
    run: Run,
    voxels: int = 1024,
    width: int = 1920,
    frames: int = 64,
    samples: int = 2,
    workers: int = 8,
    kinds: tuple[str, ...] = ("frames", "mesh"),
) -> Iterator[Row]:
    each, sizes = run.threads[0], (64, 8, voxels, width, frames, samples)
    large, small = jobs(*sizes), jobs(64, 8, 64, 64, 2, samples)
    pairs = [(large[kind], small[kind]) for kind in kinds]
    alone, many = ([measured(pairs, count, each) for _ in range(run.runs)] for count in (1, workers))
    for number, kind in enumerate(kinds):
        one, all_ = (Spread.of([turn[number]["wall_s"] for turn in turns]) for turns in (alone, many))
        yield {
            "": kind,
            f"1 worker of {each} threads, s": one.median,
            f"{workers} workers, s": all_.median,
            "times faster": one.median / all_.median,
            "CPU s": alone[0][number]["cpu_s"],
            "CPU s of all": many[0][number]["cpu_s"],
        }


def measured(pairs: Sequence[tuple[Job, Job]], workers: int, threads: int) -> list[Figures]:
    """Figures of large jobs by fresh workers, each after a small one."""
    found = []
    with (
        tempfile.TemporaryDirectory() as name,
        connect(f"local:{workers}", f"{name}/pieces", workers * threads) as pool,
    ):
        work = Work(threads, cluster=pool)
        for number, (large, small) in enumerate(pairs):
            folders = [Path(name, f"{number}-{size}") for size in ("small", "large")]
            for folder in folders:
                folder.mkdir()
            small(work, folders[0])
            found.append(cpu_of(partial(large, work, folders[1]), pool))
    return found
