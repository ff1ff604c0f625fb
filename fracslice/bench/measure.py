"""Methods that are compared, the solids that they mesh, and one measurement in its own process:
``python -m fracslice.bench.measure``, JSON in, JSON out.

Input: {"workload", "resolution"} and either {"method", "threads"}, or {"mesh"}, the file written by a peer.
"""

from __future__ import annotations

import json
import math
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..common.memory import peak_rss_mb
from ..formulas import Box, Node, julia, mandelbulb, menger, sphere, torus
from ..mesh import Mesh
from ..mesh.contouring import contour, extract
from ..mesh.fit import surface_error
from ..mesh.simplify import simplify
from ..volume import Bricks, Lattice, sample
from ..work import Work


@dataclass(frozen=True)
class Workload:
    """Solid in a cube."""

    root: Node  # the solid
    half: float  # half width of the cube, scene units
    volume: float | None = None  # exact values, where a closed form is known; scene units
    area: float | None = None

    def voxel(self, resolution: int) -> float:
        """Return the voxel size at a resolution.

        Returns a value in scene units.
        """
        return 2 * self.half / resolution

    def lattice(self, resolution: int) -> Lattice:
        """Return the grid of the cube."""
        return Lattice.around(Box.centred(self.half), self.voxel(resolution))


def _menger(level: int) -> Workload:
    return Workload(
        menger(level=level),
        1.2,
        8 * (20 / 27) ** level,
        8 * (20 / 9) ** level + 16 * (8 / 9) ** level,
    )


WORKLOADS = {
    "sphere": Workload(sphere(), 1.2, 4 / 3 * math.pi, 4 * math.pi),
    "torus": Workload(torus(radius=1, tube=0.3), 1.4, 2 * math.pi**2 * 0.09, 4 * math.pi**2 * 0.3),
    "menger3": _menger(3),
    "menger4": _menger(4),
    "mandelbulb": Workload(mandelbulb(power=8, iterations=10), 1.2),
    "julia": Workload(julia(c=(-0.2, 0.8, 0, 0), iterations=12), 1.5),
}
"""No measured voxel size divides the cubes of the Menger sponges, so the sponges are as hard as any other
solid."""


SIMPLIFY = 0.1
"""Simplification tolerance, voxels."""

Made = tuple[Mesh, int, int]
"""Mesh in scene units, field evaluations, samples kept."""


def plain(what: Workload, resolution: int, work: Work) -> Made:
    """Sparse float32 samples and marching cubes."""
    bricks = _sample_workload(what, resolution, work)
    return extract(bricks, work.threads), bricks.evaluations, bricks.values.size


def exact(what: Workload, resolution: int, work: Work) -> Made:
    """Sparse float32 samples, with vertices on roots of the float64 field.

    Evaluations of the float64 field are not counted.
    """
    bricks = _sample_workload(what, resolution, work)
    return contour(what.root, bricks, work), bricks.evaluations, bricks.values.size


def _sample_workload(what: Workload, resolution: int, work: Work) -> Bricks:
    return sample(what.root.kernel(), what.root.bounds, what.lattice(resolution), work)


def simplify_mesh(what: Workload, resolution: int, work: Work) -> Made:
    """The mesh of `exact`, simplified."""
    mesh, evaluations, kept = exact(what, resolution, work)
    fewer, _ = simplify(mesh, SIMPLIFY * what.voxel(resolution), work)
    return fewer, evaluations, kept


def dense(what: Workload, resolution: int, work: Work) -> Made:
    """Dense samples by our kernel and scikit-image's marching cubes."""
    from skimage.measure import marching_cubes

    values, spacing = grid(what, resolution, work), (what.voxel(resolution),) * 3
    points, triangles, *_ = marching_cubes(values, 0.0, spacing=spacing)  # type: ignore[no-untyped-call]
    mesh = Mesh(points.astype(np.float64) - what.half, triangles.astype(np.int32))
    return mesh, values.size, values.size


def grid(what: Workload, resolution: int, work: Work) -> np.ndarray:
    """Sample the field at every grid point of the cube.

    Returns float32 (resolution + 1, resolution + 1, resolution + 1).
    """
    kernel, axis = what.root.kernel(), np.linspace(-what.half, what.half, resolution + 1)
    values = np.empty((len(axis),) * 3, np.float32)
    y, z = (a.ravel().astype(np.float32) for a in np.meshgrid(axis, axis, indexing="ij"))

    def layer(i: int) -> None:
        values[i] = kernel.points(np.full_like(y, axis[i]), y, z).reshape(values[i].shape)

    work.map(layer, range(len(axis)))
    return values


METHODS: dict[str, Callable[[Workload, int, Work], Made]] = {
    "samples alone": plain,
    "exact": exact,
    "exact, simplified": simplify_mesh,
    "dense grid, scikit-image": dense,
}


SAMPLES = 50_000
WARM = 24
"""Resolution of the warm-up run."""


def measure(method: str, what: Workload, resolution: int, work: Work) -> dict[str, Any]:
    """Measure time, memory and errors of a method after a warm-up run.

    Returns wall_s and cpu_s (seconds), peak_mb, evaluations, kept (samples), and the figures of `errors`.
    """

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
