"""`fracslice mesh`, from the scene to the checked STL, against hand-written C++ and a copy of the STL.

The C++ samples and makes triangles ("interior never sampled"), the best of what a program could do; the copy
is the least that a file costs. The second run of each, so nothing is compiled. Ratio: wall time over the sum
of both.
"""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path

from ..programs import output
from ..runner import Row, Run, process, timed
from .command import COMMAND

SCENES = {
    "mandelbulb": ('<mandelbulb power="8" iterations="10"/>', "W1"),
    "menger": ('<menger level="4"/>', "W3"),
    "julia": ('<julia c="-0.2 0.8 0 0" iterations="12"/>', "W2"),
}
LEAVES_OUT = "C++: exact surface, edges, welding to float32, components, checks"
RUNS = 3
SMALLEST = {"scenes": ("menger",), "resolutions": (16,)}


def rows(
    run: Run, scenes: tuple[str, ...] = tuple(SCENES), resolutions: tuple[int, ...] = (256, 512)
) -> Iterator[Row]:
    for name in scenes:
        for resolution in resolutions:
            with tempfile.TemporaryDirectory() as folder:
                yield job_row(run, Path(folder), name, resolution)


def scene_text(name: str = "mandelbulb") -> str:
    """XML of one of `SCENES`; the first is W1."""
    return f'<scene version="1"><solid size="80mm">{SCENES[name][0]}</solid></scene>'


def job_row(run: Run, folder: Path, name: str, resolution: int) -> Row:
    """The row of a scene at a resolution."""
    _, peer = SCENES[name]
    scene, stl, mesh = folder / "scene.xml", folder / "mesh.stl", folder / "mesh.bin"
    scene.write_text(scene_text(name))
    threads = "--threads", run.threads[0]
    command = [*COMMAND, "mesh", scene, "-o", stl, "--resolution", resolution, "--quiet", *threads]
    given = peer, resolution, mesh, "--track", 1, "--runs", 1, *threads
    acts = {
        "fracslice": lambda: process(command),
        "C++": lambda: output("sparse", *given)[0],
        "copy": lambda: timed(lambda: shutil.copyfile(stl, folder / "copy.stl")),
    }
    measured = run.interleaved(acts)
    row = {"": name, "voxels": resolution, "triangles": stl.stat().st_size // 50}
    for key, title in {"wall_s": "time, s", "cpu_s": "CPU s", "peak_mb": "peak MB"}.items():
        row[title] = measured.spread("fracslice", key)
    row["/ (C++ + copy)"] = measured.ratio("fracslice", ("C++", "copy"), "wall_s")
    row["CPU / (C++ + copy)"] = measured.ratio("fracslice", ("C++", "copy"), "cpu_s")
    memory = measured.ratio("fracslice", "C++", "peak_mb", "worker_peak_mb")
    return {**row, "memory / C++": memory, "leaves out": LEAVES_OUT}
