"""Kernels around another one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..kernel import Kernel


@dataclass(frozen=True, eq=False)
class Wrapped:
    """What changes the values of a kernel is of the same precision, and takes as many points at a time."""

    kernel: Kernel

    @property
    def dtype(self) -> np.dtype:
        return self.kernel.dtype

    @property
    def batch(self) -> int:
        return self.kernel.batch


@dataclass(frozen=True, eq=False)
class OffsetField(Wrapped):
    """Lowers all values by a constant: the inside reaches farther, or less far."""

    by: float

    def points(self, x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
        """Field values at points, as `CpuKernel.points`."""
        f: np.ndarray = self.kernel.points(x, y, z) - self.dtype.type(self.by)
        return f

    def bricks(
        self, corners: np.ndarray, origin: tuple[float, float, float], voxel: float, out: np.ndarray
    ) -> None:
        """Field values on bricks, as `CpuKernel.bricks`."""
        self.kernel.bricks(corners, origin, voxel, out)
        out -= self.dtype.type(self.by)
