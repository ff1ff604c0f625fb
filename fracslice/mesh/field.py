"""A closed mesh as a signed distance field."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..common.cache import key
from ..common.compiled import compiled
from ..formulas.box import Box
from ..formulas.field import Bounds, Device, Precision
from ..kernel import Kernel
from ..kernel.tree import ArrayField
from .model import Mesh
from .spatial import Nearest

CELLS = 1024
"""Maximum number of cells along each side of the grid in which rays find their triangles."""


@dataclass(frozen=True, eq=False)
class MeshField(ArrayField):
    """Distance to a mesh, negative where the mesh winds around a point: bodies that overlap are united."""

    mesh: Mesh  # A closed mesh; its unit is the scene unit

    @cached_property
    def bounds(self) -> Bounds:
        """`Field.bounds`."""
        low, high = self.mesh.vertices.min(0).tolist(), self.mesh.vertices.max(0).tolist()
        return Bounds(Box(tuple(low), tuple(high)), 1.0, False)

    @cached_property
    def key(self) -> str:
        """`Field.key`."""
        return key("mesh", self.mesh.vertices, self.mesh.triangles)

    def kernel(self, device: Device = "cpu", precision: Precision = "float32") -> Kernel:
        """`Field.kernel`, always on the CPU."""
        return _MeshKernel(self, np.dtype(precision))

    def sign_kernel(self) -> Kernel:
        """`Field.sign_kernel`: the winding number alone, without distances."""
        return _MeshKernel(self, np.dtype("float32"), False)

    @cached_property
    def nearest(self) -> Nearest:
        """Distance queries."""
        return Nearest(self.mesh)

    @cached_property
    def columns(self) -> tuple[np.ndarray, ...]:
        """Corners of the triangles, and a grid over x and y with the triangles of each cell.

        The grid is its lower corner and cells per unit, float64 [2, 2], its numbers of cells, the first entry
        of each cell, and the triangles.
        """
        corners = self.mesh.vertices[self.mesh.triangles]
        low, high = self.mesh.vertices.min(0)[:2], self.mesh.vertices.max(0)[:2]
        side = np.full(2, np.clip(int(len(corners) ** 0.5), 1, CELLS))
        frame = np.stack([low, side / np.maximum(high - low, 1e-30)])
        first = np.zeros(int(side.prod()) + 1, np.int64)
        _assign(corners, frame, side, first, np.empty(0, np.int32))
        starts = np.cumsum(first)
        filled = np.empty(starts[-1], np.int32)
        _assign(corners, frame, side, starts.copy(), filled)
        return corners, frame, side, starts, filled


class _MeshKernel(Kernel):
    """Kernel of a mesh."""

    batch = 1 << 14

    def __init__(self, field: MeshField, dtype: np.dtype, measured: bool = True) -> None:
        self._field, self.dtype, self._measured = field, dtype, measured

    def points(self, x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
        """`Kernel.points`."""
        axes = [np.asarray(a, np.float64).ravel() for a in (x, y, z)]
        known = np.isfinite(axes[0] + axes[1] + axes[2])
        these, values = np.stack([a[known] for a in axes], 1), np.full(len(known), np.nan)
        inside = np.empty(len(these), np.bool_)
        _inside(these, *self._field.columns, inside)
        away = self._field.nearest.points(these, threads=1) if self._measured else 1.0
        values[known] = np.where(inside, -away, away)
        return values.reshape(np.shape(x)).astype(self.dtype, copy=False)


@compiled
def _assign(corners, frame, side, first, filled):  # type: ignore[no-untyped-def]
    """Count the triangles of each cell in the entry after its own, or write them if there is room.

    In the second case each entry of `first` is moved to the end of its cell.
    """
    for t in range(len(corners)):
        low, high = np.empty(2, np.int64), np.empty(2, np.int64)
        for k in range(2):
            least = min(corners[t, 0, k], corners[t, 1, k], corners[t, 2, k])
            most = max(corners[t, 0, k], corners[t, 1, k], corners[t, 2, k])
            low[k] = _cell(least, frame, side, k)
            high[k] = _cell(most, frame, side, k)
        for i in range(low[0], high[0] + 1):
            for j in range(low[1], high[1] + 1):
                cell = i * side[1] + j
                if len(filled):
                    filled[first[cell]] = t
                    first[cell] += 1
                else:
                    first[cell + 1] += 1


@compiled
def _cell(value, frame, side, axis):  # type: ignore[no-untyped-def]
    """Cell of a coordinate."""
    return min(max(int((value - frame[0, axis]) * frame[1, axis]), 0), side[axis] - 1)


@compiled
def _inside(points, corners, frame, side, starts, filled, inside):  # type: ignore[no-untyped-def]
    """True for points around which the mesh winds: a ray upwards adds the orientation of all triangles.

    Consecutive points above each other share the crossings of their line.
    """
    height, turn = np.empty(16), np.empty(16, np.int64)
    count, x, y = 0, np.nan, np.nan
    for n in range(len(points)):
        if points[n, 0] != x or points[n, 1] != y:
            x, y = points[n, 0], points[n, 1]
            count = _crossings(x, y, corners, frame, side, starts, filled, height, turn)
            if count > len(height):
                height, turn = np.empty(2 * count), np.empty(2 * count, np.int64)
                count = _crossings(x, y, corners, frame, side, starts, filled, height, turn)
        winding = 0
        for k in range(count):
            if height[k] > points[n, 2]:
                winding += turn[k]
        inside[n] = winding != 0


@compiled
def _crossings(x, y, corners, frame, side, starts, filled, height, turn):  # type: ignore[no-untyped-def]
    """Write the heights at which triangles cross the vertical line at x, y, and whether they face up, 1, or
    down, -1; return their number, which may exceed the length of the arrays.

    In projection, edges cross a line along x by one rule for both of their triangles, so that exactly one of
    them contains a point on an edge.
    """
    cell = _cell(x, frame, side, 0) * side[1] + _cell(y, frame, side, 1)
    count = 0
    for entry in range(starts[cell], starts[cell + 1]):
        t = filled[entry]
        ax, ay, az = corners[t, 0, 0], corners[t, 0, 1], corners[t, 0, 2]
        bx, by, bz = corners[t, 1, 0], corners[t, 1, 1], corners[t, 1, 2]
        cx, cy, cz = corners[t, 2, 0], corners[t, 2, 1], corners[t, 2, 2]
        if _crosses(ax, ay, bx, by, x, y) ^ _crosses(bx, by, cx, cy, x, y) ^ _crosses(cx, cy, ax, ay, x, y):
            up = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
            if up == 0:
                continue
            if count < len(height):
                b = ((x - ax) * (cy - ay) - (y - ay) * (cx - ax)) / up
                c = ((bx - ax) * (y - ay) - (by - ay) * (x - ax)) / up
                height[count], turn[count] = az + b * (bz - az) + c * (cz - az), 1 if up > 0 else -1
            count += 1
    return count


@compiled
def _crosses(ax, ay, bx, by, x, y):  # type: ignore[no-untyped-def]
    """True if an edge crosses the line from a point along x, the same for both directions of the edge."""
    if (ay > y) == (by > y):
        return False
    if ay > by:
        ax, ay, bx, by = bx, by, ax, ay
    return ax + (y - ay) / (by - ay) * (bx - ax) > x
