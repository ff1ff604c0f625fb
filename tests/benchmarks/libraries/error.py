"""CPU seconds against error of the surface: ours, the C++ programs and all libraries that are installed.

Each method at the finest resolution at which it was measured. `fracslice bench` is the same for users.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path

from fracslice.bench.measurements import BenchmarkTask, Peer, measure, write_report
from fracslice.work import Work

from ..runner import Row, Run
from .mesher import MESHERS
from .program import FORMS

NAMES = {
    "sdf": "sdf (PyPI)",
    "isomesh": "isomesh (PyPI)",
    "mcubes": "dense grid, PyMCubes",
    "pyvista": "dense grid, VTK flying edges",
    "sparse": "C++ sparse marching cubes",
    "track": "C++, interior never sampled",
    "openvdb": "C++ OpenVDB",
}
RUNS = 1
SMALLEST = {"workloads": ("sphere",), "resolutions": (16,), "peers": ("none",)}


def commands(wanted: tuple[str, ...]) -> Iterator[Peer]:
    """The commands of all that can be run here."""
    run, asked = (sys.executable, "-m"), ("{workload}", "{resolution}", "{output}")
    for name in wanted:
        if name in FORMS:
            yield Peer(NAMES[name], (*run, f"{__package__}.program", name, *asked))
        elif name in MESHERS and find_spec(name):
            yield Peer(NAMES[name], (*run, f"{__package__}.mesher", name, *asked))


def rows(
    run: Run,
    workloads: tuple[str, ...] = ("sphere", "mandelbulb", "julia", "menger4"),
    resolutions: tuple[int, ...] = (32, 64, 128, 256),
    peers: tuple[str, ...] = tuple(NAMES),
    limit: float = 20.0,
    plot: str = "",
) -> Iterator[Row]:
    result = measure(
        BenchmarkTask(workloads, resolutions, tuple(commands(peers)), run.runs, limit), Work(run.threads[0])
    )
    finest = {(one.workload, one.method): one for one in result}
    for (workload, method), one in finest.items():
        n, row = one.numbers, {"": workload, "voxels": one.resolution, "by": method}
        for key, title in {"error_voxels": "error, voxels", "volume": "volume", "area": "area"}.items():
            row[title] = f"{n[key]:.1e}" if key in n else ""
        row["CPU s"] = f"{n['cpu_s']:.2f}" if n else one.failed
        for key, title in {
            "triangles": "triangles",
            "evaluations": "evaluations",
            "peak_mb": "peak MB",
        }.items():
            row[title] = int(n[key]) if key in n else ""
        yield row
    if plot:
        with tempfile.TemporaryDirectory() as folder:
            write_report(result, Path(folder))
            Path(plot).write_bytes(Path(folder, "error.png").read_bytes())
