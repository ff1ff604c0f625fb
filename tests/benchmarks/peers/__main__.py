"""Run time against error, ours and all peers that are installed: ``python -m tests.benchmarks.peers``.

The C++ programs are built first. With --write the table and the picture go to docs/measurements.md.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
import tempfile
from importlib.util import find_spec
from pathlib import Path

from fracslice.bench.report import write_report
from fracslice.bench.runs import Measurement, Peer, Task, measure
from fracslice.work import Work

from ..tables import PAGE, publish, table
from .mesher import MESHERS, SYSTEM_PYTHON
from .program import FORMS

WORKLOADS = ("sphere", "mandelbulb", "julia", "menger4")
NAMES = {
    "sdf": "sdf (PyPI)",
    "isomesh": "isomesh (PyPI)",
    "mcubes": "dense grid, PyMCubes",
    "pyvista": "dense grid, VTK flying edges",
    "pyopenvdb": "dense grid, OpenVDB",
    "sparse": "C++ sparse marching cubes",
    "track": "C++, interior never sampled",
    "openvdb": "C++ OpenVDB",
}
HEAD = ("", "voxels", "", "error, voxels", "volume", "area", "CPU s", "triangles", "evaluations", "peak MB")


def peers() -> tuple[Peer, ...]:
    """The commands of all that can be run here."""
    run, asked = (sys.executable, "-m"), ("{workload}", "{resolution}", "{output}")
    found = [name for name in MESHERS if name != "pyopenvdb" and find_spec(name)]
    if subprocess.run([SYSTEM_PYTHON, "-c", "import pyopenvdb"], capture_output=True).returncode == 0:
        found.append("pyopenvdb")
    made = [Peer(NAMES[name], (*run, f"{__package__}.mesher", name, *asked)) for name in found]
    made += [Peer(NAMES[form], (*run, f"{__package__}.program", form, *asked)) for form in FORMS]
    return tuple(made)


def rows(found: list[Measurement]) -> list[list[str]]:
    """Each method at the finest resolution at which it was measured, or why it was not."""
    finest = {(one.workload, one.method): one for one in found}
    lines, last = [], ""
    for workload in WORKLOADS:
        for (of, method), one in finest.items():
            if of != workload:
                continue
            n = one.numbers
            told = [f"{n[key]:.1e}" if key in n else "" for key in ("error_voxels", "volume", "area")]
            told += [f"{n['cpu_s']:.2f}", f"{n['triangles']:,.0f}"] if n else [one.failed, ""]
            told += [f"{n[key]:,.0f}" if key in n else "" for key in ("evaluations", "peak_mb")]
            lines.append([workload if workload != last else "", str(one.resolution), method, *told])
            last = workload
    return lines


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--repeat", type=int, default=1)
    parser.add_argument("--limit", type=float, default=20.0)
    parser.add_argument("--resolution", type=int, nargs="+", default=[32, 64, 128, 256])
    parser.add_argument("--write", action="store_true")
    given = parser.parse_args()
    task = Task(WORKLOADS, tuple(given.resolution), peers(), given.repeat, given.limit)
    found = measure(task, Work())
    publish("peers", table(HEAD, rows(found)))
    with tempfile.TemporaryDirectory() as folder:
        write_report(found, Path(folder))
        if given.write:
            shutil.copyfile(Path(folder, "error.png"), PAGE.parent / "figures/error.png")


if __name__ == "__main__":
    main()
