"""CPU seconds of small jobs, each a process: the first run, with an empty cache, and the second.

Most of the first run is compiling the scene.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from pathlib import Path

from ..runner import Figures, Measured, Row, Run, process
from .command import COMMAND

SPHERE = '<scene version="1"><solid size="20mm"><sphere/></solid></scene>'
JOBS: dict[str, tuple[object, ...]] = {
    "help": ("--help",),
    "mesh, a sphere at 64 voxels": ("mesh", "{scene}", "-o", "{folder}/a.stl", "--resolution", 64),
    "render, 640 x 360, one sample": (
        "render",
        "mandelbulb",
        "-o",
        "{folder}/a.png",
        "--size",
        "640x360",
        "--samples",
        1,
    ),
    "slice, 100 layers": (
        "slice",
        "{scene}",
        "-o",
        "{folder}/a.sl1",
        "--layer",
        "0.2mm",
        "--printer",
        "sl1s",
    ),
}
SMALLEST = {"jobs": ("help",)}


def command(job: str, folder: Path, threads: int) -> list[object]:
    """The words of a job."""
    places = {"folder": folder, "scene": folder / "sphere.xml"}
    words = [word.format(**places) if isinstance(word, str) else word for word in JOBS[job]]
    more = () if words == ["--help"] else ("--threads", threads, "--quiet")
    return [*COMMAND, *words, *more]


def rows(run: Run, jobs: tuple[str, ...] = tuple(JOBS)) -> Iterator[Row]:
    first, second = (Measured({job: [] for job in jobs}) for _ in range(2))
    for _ in range(run.runs):
        for job in jobs:
            for kept, figures in zip((first, second), both(job, run.threads[0]), strict=True):
                kept[job].append(figures)
    for job in jobs:
        spent = {"first, CPU s": first.spread(job, "cpu_s"), "second, CPU s": second.spread(job, "cpu_s")}
        yield {
            "": job,
            **spent,
            "second, s": second.spread(job, "wall_s"),
            "peak MB": second.spread(job, "peak_mb"),
        }


def both(job: str, threads: int) -> Iterator[Figures]:
    """Figures of a first and a second run."""
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "sphere.xml").write_text(SPHERE)
        for _ in range(2):
            yield process(command(job, Path(folder), threads), FRACSLICE_CACHE=f"{folder}/cache")
            for path in Path(folder).glob("a.*"):
                path.unlink()
