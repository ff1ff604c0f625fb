"""A field whose inside reaches farther, or less far."""

from __future__ import annotations

import numpy as np

from ..kernel import Kernel


class Raised:
    """A kernel whose values are lower by a constant: its inside reaches farther, or less far."""

    def __init__(self, kernel: Kernel, by: float) -> None:
        self.kernel, self.by = kernel, by

    @property
    def dtype(self) -> np.dtype:
        return self.kernel.dtype

    @property
    def batch(self) -> int:
        return self.kernel.batch

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
