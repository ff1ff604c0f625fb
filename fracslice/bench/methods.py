"""Meshing methods that are compared, and the solids that they mesh, some with known volume and area."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..formulas import Box, Node, julia, mandelbulb, menger, sphere, torus
from ..mesh import Mesh
from ..mesh.contouring import contour, extract
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
