"""One measurement in its own process: ``python -m fracslice.bench.measure``, JSON in, JSON out.

Input: {"workload", "resolution"} and either {"method", "threads"}, or {"mesh"}, the file written by a peer.
"""

from __future__ import annotations

import json
import sys
import time
from typing import Any

import numpy as np

from ..common.memory import peak_rss_mb
from ..mesh import Mesh
from ..mesh.fit import surface_error
from ..work import Work
from .methods import WORKLOADS, Workload

SAMPLES = 50_000
WARM = 24
"""Resolution of the warm-up run."""


def measure(method: str, what: Workload, resolution: int, work: Work) -> dict[str, Any]:
    """Measure time, memory and errors of a method after a warm-up run.

    Returns wall_s and cpu_s (seconds), peak_mb, evaluations, kept (samples), and the figures of `errors`.
    """
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
    """Measure the errors of a mesh.

    Parameters
    ----------
    mesh : Mesh
        Mesh in scene units.
    what : Workload
        The exact solid.
    resolution : int
        Voxels along the cube.

    Returns
    -------
    dict
        triangles: their number. error_voxels: the mean distance to the zero set, ``|f| / |grad f|``, at
        points spread evenly over the surface. volume, area: relative errors, if the exact values are known.
    """
    voxel = what.voxel(resolution)
    off = surface_error(what.root, surface_points(mesh, SAMPLES), voxel) / voxel
    result = {"triangles": len(mesh.triangles), "error_voxels": float(off.mean())}
    if what.volume is not None and what.area is not None:
        result |= {"volume": mesh.volume / what.volume - 1, "area": mesh.area / what.area - 1}
    return result


def surface_points(mesh: Mesh, count: int) -> np.ndarray:
    """Sample points on a surface, uniformly by area and deterministically.

    Returns float64 (count, 3).
    """
    rng, ends = np.random.default_rng(1), np.cumsum(np.linalg.norm(mesh.normals, axis=1))
    triangles = np.minimum(np.searchsorted(ends, rng.random(count) * ends[-1]), len(ends) - 1)
    a, b, c = (mesh.vertices[mesh.triangles[triangles, k]] for k in range(3))
    s, t = np.sqrt(rng.random((count, 1))), rng.random((count, 1))
    points: np.ndarray = a + s * (b - a) + s * t * (c - b)
    return points


def main() -> None:
    """Read a task from standard input, measure it, and write the figures to standard output."""
    asked = json.load(sys.stdin)
    what, resolution = WORKLOADS[asked["workload"]], asked["resolution"]
    if "mesh" in asked:
        from ..mesh.models import read_mesh

        figures = errors(read_mesh(asked["mesh"]), what, resolution)
    else:
        figures = measure(asked["method"], what, resolution, Work(threads=asked["threads"]))
    json.dump(figures, sys.stdout)


if __name__ == "__main__":
    main()
