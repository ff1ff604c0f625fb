"""A C++ program as a peer: `python -m tests.benchmarks.libraries.program FORM WORKLOAD RESOLUTION OUTPUT`.

FORM is one of `FORMS`. The programs write counts, float32 points and triangles, and print a line of JSON with
"wall_s", "cpu_s" and "evals", the medians of their warm runs.
"""

from __future__ import annotations

import json
import sys
import tempfile
from pathlib import Path

import numpy as np

from fracslice.formats import write
from fracslice.mesh import Mesh

from ..programs import output

RUNS = 5
WORKS = {"mandelbulb": "W1", "julia": "W2", "menger4": "W3", "sphere": "W4"}
FORMS: dict[str, tuple[str, ...]] = {
    "sparse": ("sparse",),
    "track": ("sparse", "--track", "1"),
    "openvdb": ("vdb",),
}


def main() -> None:
    form, workload, resolution, path = sys.argv[1:]
    if workload not in WORKS:
        sys.exit(f"{form} does not have {workload}")
    with tempfile.TemporaryDirectory() as scratch:
        made = Path(scratch, "mesh.bin")
        name, *more = FORMS[form]
        (spent,) = output(name, WORKS[workload], resolution, made, "--runs", RUNS, *more)
        data = made.read_bytes()
    count, faces = np.frombuffer(data, np.int64, 2)
    points = np.frombuffer(data, np.float32, 3 * count, 16).reshape(-1, 3)
    triangles = np.frombuffer(data, np.uint32, 3 * faces, 16 + 12 * count).reshape(-1, 3)
    write(Mesh(points.astype(np.float64), triangles.astype(np.int32)), path)
    kept = {"wall_s": spent["wall_s"], "cpu_s": spent["cpu_s"], "evaluations": spent["evals"]}
    print(json.dumps(kept | {"peak_mb": spent["worker_peak_mb"]}))


if __name__ == "__main__":
    main()
