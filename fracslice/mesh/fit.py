"""Distances of triangles from the zero set of a field and back, and angles between their normals."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from .._native import surface_error as measured
from ..common.arrays import length
from ..fields.box import Box
from ..fields.field import Field
from ..work import Work, chunks
from .model import Mesh

STEP = 1e-4
"""Step of central differences, voxels."""

_SIDES = [(2, 2, 0), (3, 1, 0), (1, 3, 0), (0, 2, 2), (0, 3, 1), (0, 1, 3), (2, 0, 2), (1, 0, 3), (3, 0, 1)]
LATTICE = np.array([*_SIDES, (2, 1, 1), (1, 2, 1), (1, 1, 2)]) / 4
"""Barycentric sample points of a triangle: three on each side, then three inside. The corners are on the
surface.
"""


AROUND = np.array([way for way in product((-1.0, 0.0, 1.0), repeat=3) if np.count_nonzero(way) % 2])
AROUND /= np.linalg.norm(AROUND, axis=1)[:, None]
"""Unit vectors along the axes and the space diagonals."""

BEYOND = 1 + 1e-6

FINEST = 1 / 8
"""Reach, voxels, down to which it is halved where it proves nothing: a wide one sees past thin features."""

UPRIGHT, OFF = 3, 7


class Fit:
    """Distances and normals of a scene's field.

    `reach`, `voxel` in scene units.
    """

    def __init__(self, root: Field, reach: float, voxel: float, work: Work) -> None:
        self._kernel = root.kernel("cpu", "float64")
        self.reach, self._voxel, self._work = reach, voxel, work

    def planes(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Tangent planes of the field.

        `points`: float64 (n, 3), scene units. Returns float64 (n, 4).
        """

        def look(p: NDArray[np.float64], out: NDArray[np.float64]) -> None:
            h = STEP * self._voxel
            for axis, step in enumerate(h * np.eye(3)):
                ends = (self._kernel.points(*(p + sign * step[:, None])) for sign in (1, -1))
                out[:, axis] = np.subtract(*ends) / (2 * h)
            slope = np.maximum(np.linalg.norm(out[:, :3], axis=1), 1e-30)
            out[:, :3] /= slope[:, None]
            out[:, 3] = self._kernel.points(*p) / slope

        return self._each(look, points, 4)

    def distances(self, points: NDArray[np.float64], normals: NDArray[np.float64]) -> NDArray[np.float64]:
        """Distances of points from the surface.

        A continuous field has a zero between two points of opposite signs. A sign change along the normal
        through the point, or else within the ball of radius `reach` around it, proves that the surface is
        within `reach`; so do those of shorter reaches. Elsewhere the distance is a first-order estimate, and
        greater than `reach`.

        `points`: float64 (n, 3), scene units; `normals`: float64 (n, 3). Returns float64 (n,), scene units.
        """

        def look(rows: NDArray[np.float64], out: NDArray[np.float64]) -> None:
            left, reach = np.arange(rows.shape[1]), self.reach
            while True:
                off = self._within(reach, np.ascontiguousarray(rows[:, left]))
                out[left, 0] = np.where(off <= reach, off, np.maximum(off, BEYOND * self.reach))
                left = left[off > reach]
                if not len(left) or reach <= FINEST * self._voxel:
                    return
                reach /= 2

        return self._each(look, np.concatenate([points, normals], axis=1), 1)[:, 0]

    def _within(self, reach: float, rows: NDArray[np.float64]) -> NDArray[np.float64]:
        """Distances of points, with the normals below them, from the surface; greater than `reach` where no
        sign change proves that it is within it, [n].
        """
        p, step = rows[:3], reach * rows[3:]
        up, down = self._kernel.points(*(p + step)), self._kernel.points(*(p - step))
        passed = (up >= 0) & (down <= 0) & (up > down)
        out = np.empty(rows.shape[1])
        out[passed] = reach * np.abs(up + down)[passed] / (up - down)[passed]
        left = np.ascontiguousarray(p[:, ~passed])
        f = self._kernel.points(*left)
        around = np.array([self._kernel.points(*(left + reach * way[:, None])) for way in AROUND])
        steep = np.abs(around - f).max(axis=0) / reach
        far = np.minimum(np.abs(f) / np.maximum(steep, 1e-30), self._voxel)
        near = np.ptp((around < 0).astype(np.int8), axis=0) > 0
        out[~passed] = np.where(near, np.minimum(far, reach), np.maximum(far, BEYOND * reach))
        return out

    def triangles(self, corners: NDArray[np.float64]) -> NDArray[np.float64]:
        """Measure the fit of triangles.

        `corners`: float64 (m, 3, 3), scene units. Returns float64 (m, 8).
        """
        normals = self.planes(corners.mean(axis=1))[:, :3]
        points = (LATTICE @ corners).reshape(-1, 3)
        result = self.distances(points, np.repeat(normals, len(LATTICE), axis=0)).reshape(-1, len(LATTICE))
        sides = result[:, :9].reshape(-1, 3, 3).max(axis=2)
        return np.column_stack([normals, _cosines(corners, normals), sides, result.max(axis=1)])

    def _each(
        self,
        look: Callable[[NDArray[np.float64], NDArray[np.float64]], None],
        rows: NDArray[np.float64],
        width: int,
    ) -> NDArray[np.float64]:
        """Apply a function to columns of the rows, in parallel; float64 [n, width]."""
        out = np.empty((len(rows), width))

        def task(part: slice) -> None:
            look(np.ascontiguousarray(rows[part].T), out[part])

        self._work.map(task, chunks(len(rows), 1 << 14))
        return out


@dataclass(frozen=True, eq=False)
class Fitted:
    """A mesh with the measures of `Fit.triangles`."""

    mesh: Mesh  # the mesh
    fit: Fit  # the measuring fit
    measured: NDArray[np.float64]  # measures of each triangle

    @classmethod
    def of(cls, mesh: Mesh, fit: Fit) -> Fitted:
        """Measure a mesh."""
        return cls(mesh, fit, fit.triangles(mesh.corners))

    def become(self, mesh: Mesh, parents: NDArray[np.int64], fresh: NDArray[np.bool_]) -> Fitted:
        """Measures of an edited mesh; only changed triangles are measured.

        `parents`: int64 (k,); `fresh`: bool (k,).
        """
        measured = self.measured[parents]
        measured[fresh] = self.fit.triangles(mesh.corners[fresh])
        return Fitted(mesh, self.fit, measured)

    @property
    def normals(self) -> NDArray[np.float64]:
        """Unit normals of the field at the centroids, float64 [m, 3]."""
        return self.measured[:, :3]

    @property
    def upright(self) -> NDArray[np.float64]:
        """Cosines between the normals of the field and of the triangles, float64 [m]."""
        return self.measured[:, UPRIGHT]

    @property
    def sides(self) -> NDArray[np.float64]:
        """Greatest distance of the samples on each side, float64 [m, 3]."""
        return self.measured[:, 4:7]

    @property
    def off(self) -> NDArray[np.float64]:
        """Greatest distance of all samples, float64 [m]."""
        return self.measured[:, OFF]


def _cosines(corners: NDArray[np.float64], normals: NDArray[np.float64]) -> NDArray[np.float64]:
    """Cosine between normals of triangles and unit vectors, [m]; -1 for triangles without area."""
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    size = np.linalg.norm(across, axis=1)
    cosine: NDArray[np.float64] = np.where(
        size > 0, (across * normals).sum(axis=1) / np.maximum(size, 1e-300), -1.0
    )
    return cosine


REACH = 1e-4
"""Step of the finite differences, in voxels."""

AT_ONCE = 1 << 16
"""Points per thread between two checks for cancellation."""

_AXES = np.eye(3)
_DIAGONALS = [way for way in product((-1.0, 0.0, 1.0), repeat=3) if np.count_nonzero(way) > 1]
DIRECTIONS = np.array([way / length(way) for way in np.array([*_AXES, *-_AXES, *_DIAGONALS])])
"""Directions of the differences: along the axes, against them, and along diagonals, [26, 3]."""

STARTS, STEPS = 1024, 24
"""Random starting points of the search for the surface, and Newton steps per point."""

NEAR = 1e-3
"""Length of the last step, in voxels, below which a point is on the surface."""


def surface_points(root: Field, box: Box, voxel: float, count: int, work: Work | None = None) -> np.ndarray:
    """Find points on the zero set without samples or a mesh.

    Newton's method from random points of a box, with a fixed seed. If the field is no distance inside, the
    starting points are outside. A part of the surface is reached from the starting points closest to it, so
    thin wires are found too.

    `box`, `voxel` in scene units. Returns float64 [n, 3], scene units.
    """
    kernel, work = root.kernel("cpu", "float64"), work or Work()
    rng = np.random.default_rng(0)
    p = rng.uniform(np.array(box.lo)[:, None], np.array(box.hi)[:, None], (3, STARTS))
    h = REACH * voxel
    if root.bounds.exterior_only:
        p = p[:, ~(kernel.points(*p) < 0)]
    for _ in range(STEPS):
        work.check()
        f = kernel.points(*p)
        gradient = np.stack([kernel.points(*(p + step[:, None])) - f for step in h * np.eye(3)]) / h
        square = (gradient**2).sum(0)
        step = -f * gradient / np.where(square > 0, square, np.inf)
        move = np.where(square > 0, np.linalg.norm(step, axis=0), np.inf)
        p = p + step
    result: np.ndarray = p[:, move < NEAR * voxel][:, :count].T
    return result


def surface_error(
    root: Field,
    points: np.ndarray,
    voxel: float,
    work: Work | None = None,
    scale: float = 1.0,
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> np.ndarray:
    """Estimate distances from the zero set to first order, ``|f| / |grad f|``.

    The float64 kernel is used. Along each axis the steeper of the two one-sided differences counts, because
    they cancel at an edge or corner; the backward one is taken only where the forward one does not suffice.
    Where two solids touch in an edge the axes lie in the surface: where they are flat, the steepest of all
    directions counts, diagonals included.

    `points`: float [n, 3]; `voxel` in scene units; `scale`, `offset`: placement of the points: scale * p +
    offset for a point p in scene units. Returns float64 [n], scene units, limited to one voxel.
    """
    work, step = work or Work(), REACH * voxel
    points, error = np.asarray(points, np.float64), np.empty(len(points))
    rest = scale, offset, step * DIRECTIONS, step, voxel, work.threads
    entry = root.kernel("cpu", "float64").entry
    for part in chunks(len(points), AT_ONCE * work.threads):
        work.check()
        error[part] = measured(entry, points[part], *rest)
    return error
