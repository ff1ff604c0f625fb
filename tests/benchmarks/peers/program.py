"""A C++ program as a peer: `python -m tests.benchmarks.peers.program FORM WORKLOAD RESOLUTION OUTPUT FOLDER`.

FORM is one of `FORMS`. The programs write counts, float32 points and triangles, and print a line of JSON with
"wall_s", "cpu_s" and "evals", the medians of their warm runs.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from fracslice.export import write
from fracslice.mesh import Mesh

RUNS = 5
WORKS = {"mandelbulb": "W1", "julia": "W2", "menger4": "W3", "sphere": "W4"}
FORMS = {
    "sparse": "sparse_mc {work} {n} {out} {runs}",
    "track": "sparse_mc {work} {n} {out} {runs} track",
    "openvdb": "vdb_mesh {work} {n} hier {out} {runs}",
}


def main() -> None:
    form, workload, resolution, output, folder = sys.argv[1:]
    if workload not in WORKS:
        sys.exit(f"{form} does not have {workload}")
    with tempfile.TemporaryDirectory() as scratch:
        made = Path(scratch, "mesh.bin")
        line = FORMS[form].format(work=WORKS[workload], n=resolution, out=made, runs=RUNS)
        command = [Path(folder, line.split()[0]), *line.split()[1:]]
        idle = {**os.environ, "OMP_WAIT_POLICY": "passive"}  # else threads that wait count as CPU seconds
        ran = subprocess.run(command, check=True, capture_output=True, env=idle)
        told, data = json.loads(ran.stdout), made.read_bytes()
    count, faces = np.frombuffer(data, np.int64, 2)
    points = np.frombuffer(data, np.float32, 3 * count, 16).reshape(-1, 3)
    triangles = np.frombuffer(data, np.uint32, 3 * faces, 16 + 12 * count).reshape(-1, 3)
    write(Mesh(points.astype(np.float64), triangles.astype(np.int32)), output)
    kept = {"wall_s": told["wall_s"], "cpu_s": told["cpu_s"], "evaluations": told["evals"]}
    print(json.dumps(kept | {"peak_mb": told["worker_peak_mb"]}))


if __name__ == "__main__":
    main()
