"""A closed mesh as a signed distance field."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .. import _native
from ..common.cache import key
from ..fields.box import Box
from ..fields.field import Bounds, Device, Kernel, Precision
from ..fields.tree import ArrayField
from .model import Mesh
from .spatial import build


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
    def native(self) -> _native.MeshField:
        """Evaluator of the field."""
        return _native.MeshField(self.mesh.vertices, self.mesh.triangles, *build(self.mesh))


class _MeshKernel(Kernel):
    """Kernel of a mesh."""

    batch = 1 << 14

    def __init__(self, field: MeshField, dtype: np.dtype, measured: bool = True) -> None:
        self._native, self.dtype, self._measured = field.native, dtype, measured

    def points(self, x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
        """`Kernel.points`."""
        u, v, w = (np.asarray(a, np.float64).reshape(-1) for a in (x, y, z))
        values = self._native.points(u, v, w, self._measured)
        return values.reshape(np.shape(x)).astype(self.dtype, copy=False)

    def bricks(
        self, corners: np.ndarray, origin: tuple[float, float, float], voxel: float, out: np.ndarray
    ) -> None:
        """`Kernel.bricks`."""
        if out.dtype == np.float32:
            out[:] = self._native.bricks(corners, origin, voxel, self._measured)
        else:
            super().bricks(corners, origin, voxel, out)
