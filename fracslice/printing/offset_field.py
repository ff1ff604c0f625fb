"""A field whose inside reaches farther, or less far."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..formulas.confining import moved_slope
from ..formulas.field import Bounds, Device, Precision
from ..kernel import Field, Kernel
from ..kernel.arrays import ArrayField
from ..keys import key


@dataclass(frozen=True, eq=False)
class OffsetField(ArrayField):
    """A field less a constant."""

    root: Field
    by: float

    @cached_property
    def bounds(self) -> Bounds:
        """Those of the formula `offset`. The flatter the field is, the farther its inside can reach from the
        box.
        """
        own = self.root.bounds
        return replace(own, box=own.box.grown(self.by), lipschitz=moved_slope(own, self.by))

    @property
    def key(self) -> str:
        """`Field.key`."""
        return key(self.root.key, "offset", self.by)

    def conservative(self) -> OffsetField:
        """`Field.conservative`. A shrunk escape-time fractal stays as it is: its inside bounds nothing."""
        by = max(self.by, 0.0) if self.root.bounds.exterior_only else self.by
        return OffsetField(self.root.conservative(), by)

    def kernel(self, device: Device = "cpu", precision: Precision = "float32") -> Kernel:
        """`Field.kernel`."""
        return _Shifted(self.root.kernel(device, precision), self.by)


class _Shifted(Kernel):
    """The kernel of an offset field."""

    def __init__(self, root: Kernel, by: float) -> None:
        self.dtype, self.batch = root.dtype, root.batch
        self._root, self._by = root, root.dtype.type(by)

    def points(self, x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
        """`Kernel.points`."""
        f: np.ndarray = self._root.points(x, y, z) - self._by
        return f

    def bricks(
        self, corners: np.ndarray, origin: tuple[float, float, float], voxel: float, out: np.ndarray
    ) -> None:
        """`Kernel.bricks`."""
        self._root.bricks(corners, origin, voxel, out)
        out -= self._by
