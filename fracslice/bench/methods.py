"""Meshing methods that are compared: functions of a workload, the voxels along its cube, and the work."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..mesh import Mesh
from ..mesh.extract import contour, extract
from ..mesh.simplify import simplify
from ..volume import Bricks, sample
from ..work import Work
from .workloads import Workload

SIMPLIFY = 0.1
"""Simplification tolerance, voxels."""

Made = tuple[Mesh, int, int]
"""Mesh in scene units, field evaluations, samples kept."""


def plain(what: Workload, resolution: int, work: Work) -> Made:
    """Sparse float32 samples and marching cubes."""
    bricks = _sampled(what, resolution, work)
    return extract(bricks, work.threads), bricks.evaluations, bricks.values.size


def exact(what: Workload, resolution: int, work: Work) -> Made:
    """Sparse float32 samples, with vertices on roots of the float64 field.

    Evaluations of the float64 field are not counted.
    """
    bricks = _sampled(what, resolution, work)
    return contour(what.root, bricks, work), bricks.evaluations, bricks.values.size


def _sampled(what: Workload, resolution: int, work: Work) -> Bricks:
    return sample(what.root.kernel(), what.root.bounds, what.lattice(resolution), work)


def simplified(what: Workload, resolution: int, work: Work) -> Made:
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

    Returns
    -------
    ndarray of float32, shape (resolution + 1, resolution + 1, resolution + 1)
        Field values by x, y, z.
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
    "exact, simplified": simplified,
    "dense grid, scikit-image": dense,
}
