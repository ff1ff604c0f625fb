"""How whole jobs scale with threads: time of a process by number of threads, and the serial share.

One process per run, warm. The share is that of Amdahl's law, T(p) = T(1) (s + (1 - s) / p), fitted by least
squares to all numbers of threads. An installed wheel is measured as well as a checkout, see
`tests.benchmarks.jobs.command`.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path

from ..runner import Figures, Row, Run, process
from .command import COMMAND
from .mesh import scene_text

JOBS = {
    "mesh": "{w1} --resolution",
    "slice": "mandelbulb --printer saturn-3-ultra --exposure 2.5 30 --layer 0.05mm --size",
    "render": "mandelbulb --device cpu --samples 64 --size",
}
ENDINGS = {"mesh": "stl", "slice": "goo", "render": "png"}
RUNS, THREADS = 3, [1, 4, 16, 64]
SMALLEST = {"jobs": ("render=32x16",)}


def serial_share(threads: Sequence[int], seconds: Sequence[float]) -> float:
    """The share s of T(p) = T(1) (s + (1 - s) / p), by least squares; the first is of one thread."""
    weights = [1 - 1 / p for p in threads]
    rest = [t / seconds[0] - 1 / p for p, t in zip(threads, seconds, strict=True)]
    share = sum(w * r for w, r in zip(weights, rest, strict=True)) / (sum(w * w for w in weights) or 1.0)
    return min(1.0, max(0.0, share))


def once(words: Sequence[object], path: Path, threads: int) -> Figures:
    """One run; the output is removed, for a job resumes what is there."""
    figures = process([*COMMAND, *words, "--quiet", "--threads", threads, "-o", path])
    path.unlink()
    return figures


def rows(
    run: Run, jobs: tuple[str, ...] = ("mesh=512", "mesh=1024", "slice=110mm", "render=1920x1080")
) -> Iterator[Row]:
    for job in jobs:
        name, size = job.split("=")
        with tempfile.TemporaryDirectory() as folder:
            (scene := Path(folder) / "w1.xml").write_text(scene_text())
            path = Path(folder) / f"out.{ENDINGS[name]}"
            words = [name, *(word.format(w1=scene) for word in JOBS[name].split()), size]
            measured = run.interleaved({str(p): partial(once, words, path, p) for p in run.threads})
        times = [measured.spread(str(p), "wall_s") for p in run.threads]
        share = serial_share(run.threads, [time.median for time in times])
        for p, time in zip(run.threads, times, strict=True):
            faster = measured.ratio(str(run.threads[0]), str(p), "wall_s")
            row = {"": name, "size": size, "threads": p, "time, s": time, "times faster": faster}
            row["CPU s"] = measured.spread(str(p), "cpu_s")
            yield {**row, "peak MB": measured.spread(str(p), "peak_mb"), "serial share": f"{share:.1%}"}
