"""Whether a scene comes out the same every time: hashes of files from new processes, by number of threads."""

from __future__ import annotations

import hashlib
import tempfile
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from ..runner import Row, Run, process
from .command import COMMAND

JOBS = {
    "mesh.stl": ("mesh", "--resolution", "256"),
    "slices.sl1": ("slice", "--size", "30mm", "--layer", "0.2mm", "--printer", "sl1s"),
    "picture.png": ("render", "--size", "320x240", "--samples", "8", "--device", "cpu"),
}
RUNS, THREADS = 40, [4, 8, 16]
SMALLEST = {"files": ("picture.png",)}


def file_hash(scene: str, name: str, threads: int) -> str:
    """The hash of a file that a new process makes."""
    job, *options = JOBS[name]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / name
        process(
            [*COMMAND, job, scene, "-o", path, *options, "--threads", threads, "--quiet"],
            SOURCE_DATE_EPOCH="0",
        )
        return hashlib.sha256(path.read_bytes()).hexdigest()[:16]


def rows(run: Run, scene: str = "mandelbulb", files: tuple[str, ...] = tuple(JOBS)) -> Iterator[Row]:
    for name in files:
        hashes: Counter[str] = Counter()
        for threads in run.threads:
            result = Counter(file_hash(scene, name, threads) for _ in range(run.runs))
            hashes += result
            yield {"file": name, "threads": threads, **{key: result[key] for key in hashes}}
        if len(hashes) > 1:
            run.faults.append(f"{name}: {len(hashes)} different files")
