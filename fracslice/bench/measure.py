"""One measurement in a process of its own: ``python -m fracslice.bench.measure``, JSON in, JSON out.

What it reads: {"workload", "resolution"} and {"method"}, or {"mesh"}: the file a peer wrote.
"""

from __future__ import annotations

import json
import sys
import time
from typing import Any

import numpy as np

from ..memory import peak_rss_mb
from ..mesh import Mesh
from ..volume.accuracy import surface_error
from ..work import Work
from .workloads import WORKLOADS, Workload

SAMPLES = 50_000
WARM = 24
"""The resolution at which everything is done once before it is measured."""


def measured(method: str, what: Workload, resolution: int, work: Work) -> dict[str, Any]:
    """Time, memory and errors of one of our methods, warm."""
    from .methods import METHODS

    make = METHODS[method]
    make(what, WARM, work)
    wall, cpu = time.perf_counter(), time.process_time()
    mesh, evaluations, kept = make(what, resolution, work)
    wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
    memory = peak_rss_mb()
    figures = {"wall_s": wall, "cpu_s": cpu, "peak_mb": memory, "evaluations": evaluations, "kept": kept}
    return figures | errors(mesh, what, resolution)


def errors(mesh: Mesh, what: Workload, resolution: int) -> dict[str, Any]:
    """How far a mesh is from its solid.

    error_voxels: the mean distance to the zero set, |f| / |grad f|, at points spread evenly over the surface;
    volume and area: relative errors, where the truth is known.
    """
    voxel = what.voxel(resolution)
    off = surface_error(what.root, spread(mesh, SAMPLES), voxel) / voxel
    found = {"triangles": len(mesh.triangles), "error_voxels": float(off.mean())}
    if what.volume is not None and what.area is not None:
        found |= {"volume": mesh.volume / what.volume - 1, "area": mesh.area / what.area - 1}
    return found


def spread(mesh: Mesh, count: int) -> np.ndarray:
    """Points on the surface, float64 [count, 3], evenly by area, the same ones each time."""
    rng, ends = np.random.default_rng(1), np.cumsum(np.linalg.norm(mesh.normals, axis=1))
    triangles = np.minimum(np.searchsorted(ends, rng.random(count) * ends[-1]), len(ends) - 1)
    a, b, c = (mesh.vertices[mesh.triangles[triangles, k]] for k in range(3))
    s, t = np.sqrt(rng.random((count, 1))), rng.random((count, 1))
    points: np.ndarray = a + s * (b - a) + s * t * (c - b)
    return points


def main() -> None:
    asked = json.load(sys.stdin)
    what, resolution = WORKLOADS[asked["workload"]], asked["resolution"]
    if "mesh" in asked:
        from ..mesh.reading import read_mesh

        figures = errors(read_mesh(asked["mesh"]), what, resolution)
    else:
        figures = measured(asked["method"], what, resolution, Work(threads=asked["threads"]))
    json.dump(figures, sys.stdout)


if __name__ == "__main__":
    main()
