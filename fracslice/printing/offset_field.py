"""Offset field: a field whose surface is moved outwards or inwards."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..common.keys import key
from ..formulas.box import Box
from ..formulas.confining import moved_slope
from ..formulas.field import Bounds, Device, Precision
from ..kernel import Field, Kernel
from ..kernel.arrays import ArrayField


@dataclass(frozen=True, eq=False)
class OffsetField(ArrayField):
    """A field less a constant.

    Attributes
    ----------
    root : Field
        The field to offset.
    by : float
        Constant to subtract, scene units; positive values grow the inside.
    """

    root: Field
    by: float

    @cached_property
    def bounds(self) -> Bounds:
        """Bounds as of the formula `offset`. A flatter field's inside can extend farther from its box."""
        own = self.root.bounds
        return replace(own, box=own.box.grown(self.by), lipschitz=moved_slope(own, self.by))

    @property
    def key(self) -> str:
        """`Field.key`."""
        return key(self.root.key, "offset", self.by)

    @property
    def proved_box(self) -> Box:
        """`Field.proved_box`."""
        return self.root.proved_box.grown(self.by)

    def conservative(self) -> OffsetField:
        """`Field.conservative`. An escape-time fractal is not shrunk: its interior values bound nothing."""
        by = max(self.by, 0.0) if self.root.bounds.exterior_only else self.by
        return OffsetField(self.root.conservative(), by)

    def kernel(self, device: Device = "cpu", precision: Precision = "float32") -> Kernel:
        """`Field.kernel`."""
        return _Shifted(self.root.kernel(device, precision), self.by)


class _Shifted(Kernel):
    """Kernel of an offset field."""

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
