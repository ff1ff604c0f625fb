"""How far a mesh is from the surface it stands for."""

from __future__ import annotations

import numpy as np

from ..formulas.registry import Node
from ..kernel import compile_scene
from ..work import Work, chunks

REACH = 1e-4
"""The step of the differences, in voxels."""


def surface_error(root: Node, points: np.ndarray, voxel: float, work: Work | None = None) -> np.ndarray:
    """Distances of points from the zero set to first order, ``|f| / |grad f|``.

    points: float [n, 3], scene units; voxel: scene units. Returns float64 [n], scene units, at most a voxel
    each (where the gradient vanishes or jumps it says nothing more). By the float64 kernel, with central
    differences.
    """
    kernel, h = compile_scene(root, "float64"), REACH * voxel
    error = np.empty(len(points))

    def task(part: slice) -> None:
        p = np.ascontiguousarray(points[part].T, np.float64)
        square = np.zeros(p.shape[1])
        for axis in range(3):
            step = h * np.eye(3)[:, [axis]]
            square += ((kernel.points(*(p + step)) - kernel.points(*(p - step))) / (2 * h)) ** 2
        f = np.abs(kernel.points(*p))
        error[part] = np.minimum(f / np.maximum(np.sqrt(square), 1e-30), voxel)

    (work or Work()).map(task, chunks(len(points), 1 << 14))
    return error
