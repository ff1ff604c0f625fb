"""The ways to a mesh that are compared."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..mesh import Mesh
from ..mesh.extract import contour, extract
from ..mesh.simplify import simplify
from ..volume import sample
from ..work import Work
from .workloads import Workload

SIMPLIFY = 0.1
"""The tolerance of the simplified mesh, in voxels."""

Made = tuple[Mesh, int, int]
"""A mesh in scene units, how often the field was evaluated, and how many samples were kept."""


def plain(what: Workload, resolution: int, work: Work) -> Made:
    """Sparse float32 samples and marching cubes."""
    kernel = what.root.kernel()
    bricks = sample(kernel, what.root.bounds, what.lattice(resolution), work)
    return extract(bricks, work.threads), bricks.evaluations, bricks.values.size


def exact(what: Workload, resolution: int, work: Work) -> Made:
    """Sparse float32 samples; vertices on roots of the float64 field, whose evaluations are not told."""
    kernel = what.root.kernel()
    bricks = sample(kernel, what.root.bounds, what.lattice(resolution), work)
    return contour(what.root, bricks, work), bricks.evaluations, bricks.values.size


def simplified(what: Workload, resolution: int, work: Work) -> Made:
    """The exact contour, simplified."""
    mesh, evaluations, kept = exact(what, resolution, work)
    fewer, _ = simplify(mesh, SIMPLIFY * what.voxel(resolution), work)
    return fewer, evaluations, kept


def dense(what: Workload, resolution: int, work: Work) -> Made:
    """Every point of the cube by our kernel, then scikit-image's marching cubes."""
    from skimage.measure import marching_cubes

    values, spacing = grid(what, resolution, work), (what.voxel(resolution),) * 3
    points, triangles, *_ = marching_cubes(values, 0.0, spacing=spacing)  # type: ignore[no-untyped-call]
    mesh = Mesh(points.astype(np.float64) - what.half, triangles.astype(np.int32))
    return mesh, values.size, values.size


def grid(what: Workload, resolution: int, work: Work) -> np.ndarray:
    """The field at every point of the cube, float32 [resolution + 1] * 3, by axes x, y, z."""
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
