"""A distance field, as all that samples, meshes, slices and checks it sees it, whatever it is made of."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, Protocol

import numpy as np

from .box import Box

if TYPE_CHECKING:
    from .registry import Node

Precision = Literal["float32", "float64"]
Device = Literal["cpu", "cuda"]


@dataclass(frozen=True)
class Bounds:
    """What is known of a field without evaluating it.

    box: encloses all points where the field is negative, in the node's own coordinates.
    lipschitz: L such that ``|f(p) - f(q)| <= L |p - q|``; of a field with an escape-time fractal in it: such
    that a point outside is at least ``f(p) / L`` away from the surface.
    exterior_only: True if there is an escape-time fractal in it. Its inside values are much smaller than the
    distance to the surface, and bound nothing: the inside cannot be recognised from afar.
    steepening: of such a field, the highest power n in it. Along circles of latitude the derivative changes
    n times within 2/n of the poles; so level sets other than the surface are steeper: how much is measured
    (`docs/how/accuracy.md`).
    boxless: the names of the formulas in it that state no box.
    """

    box: Box
    lipschitz: float
    exterior_only: bool
    steepening: float = 0.0
    boxless: tuple[str, ...] = ()


class Kernel(Protocol):
    """A field that can be evaluated, by many threads at once.

    dtype: of its values, float32 or float64. batch: samples worth a call.
    """

    dtype: np.dtype
    batch: int = 1 << 17

    def points(self, x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
        """Evaluate the field at points.

        Parameters
        ----------
        x, y, z
            Coordinates in scene units: arrays of one shape, of any float type.

        Returns
        -------
        Values of that shape in the kernel's dtype; NaN at a point with a NaN.
        """

    def bricks(
        self, corners: np.ndarray, origin: tuple[float, float, float], voxel: float, out: np.ndarray
    ) -> None:
        """Evaluate the field on bricks of 8 x 8 x 8 grid points.

        Parameters
        ----------
        corners
            Grid index of the first sample of each brick, int32 [n, 3], C-contiguous.
        origin, voxel
            A grid point lies at ``origin + voxel * index``; its value depends on nothing else.
        out
            Receives the values, [n, 512] of the kernel's dtype, C-contiguous, at x*64 + y*8 + z.
        """
        inner = np.indices((8, 8, 8)).reshape(3, 512)
        out[:] = self.points(*(origin[k] + voxel * (corners[:, k, None] + inner[k]) for k in range(3)))

    @property
    def entry(self) -> Any:
        """The field for native code: machine code and its parameters, or a function of points [3, n] that
        writes their values to [1, n].
        """

        def evaluate(points: np.ndarray, out: np.ndarray) -> None:
            out[0] = self.points(*points)

        return evaluate


class Run(Protocol):
    """A loop over a field."""

    def __call__(self, frame: np.ndarray, rows: np.ndarray, out: np.ndarray, *numbers: int) -> None:
        """Run the loop on its frame, the rows that it reads, those that it writes, both C-contiguous, and its
        numbers.
        """

    def native(self, frame: np.ndarray) -> tuple[Any, ...] | Callable[..., None]:
        """The loop for native code: machine code, parameters and frame, or a function of rows, rows to write
        and numbers.
        """


@dataclass(frozen=True, eq=False)
class Loops:
    """Loops over a field by their names. width: points come in multiples of it. batch: worth a call."""

    width: int
    batch: int
    runs: Mapping[str, Run]


class Field(Protocol):
    """A signed distance field: negative inside, zero on the surface."""

    @property
    def bounds(self) -> Bounds: ...

    @property
    def key(self) -> str:
        """The hash of all that the field's values, and what is known of them, follow from. Raises
        `KernelError`.
        """

    @property
    def tree(self) -> Node | None:
        """The field as a tree of formulas, if it is one."""
        return None

    @property
    def escape_time_only(self) -> bool:
        """True if the field is made of nothing but escape-time fractals."""
        return False

    def conservative(self) -> Field:
        """The field by which space may be skipped: its values, where positive, divided by its own Lipschitz
        bound are lower bounds of the distance to this field's surface.
        """
        return self

    def kernel(self, device: Device = "cpu", precision: Precision = "float32") -> Kernel:
        """What evaluates the field on a device, or on the CPU where it cannot be on that one. Raises
        `KernelError`.
        """

    def loops(self, loops: Sequence[Any], precision: Precision) -> Loops:
        """Loops (`kernel.loops`) over the field on the CPU. Raises `KernelError`."""
