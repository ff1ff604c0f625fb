"""Interfaces of distance fields to sampling, meshing, slicing and checks."""

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


@dataclass(frozen=True, slots=True)
class Bounds:
    """Properties of a field that hold without evaluating it."""

    box: Box  # encloses all points where the field is negative, in the node's own coordinates
    # L such that ``|f(p) - f(q)| <= L |p - q|``. For a field with an escape-time fractal: L such that a point
    # outside is at least ``f(p) / L`` away from the surface
    lipschitz: float
    # true if the field contains an escape-time fractal. Its interior values are much smaller than the
    # distance to the surface and bound nothing: none proves that its neighbourhood is inside
    exterior_only: bool
    # for such a field, the highest power n in it. Along circles of latitude the derivative changes n times
    # within 2/n of the poles, so level sets other than the surface are steeper; by how much is measured
    # (`docs/how/accuracy.md`)
    steepening: float = 0.0
    boxless: tuple[str, ...] = ()  # names of the formulas in the field that state no box
    measured: tuple[str, ...] = ()  # names of the formulas in the field whose L is measured, not proved

    def slope_less(self, distance: float) -> float:
        """Lipschitz bound of the field less a constant, scene units."""
        n = self.steepening
        # The stretch along circles of latitude ends within 1/n, in narrow rings within 3/n^2.
        return self.lipschitz * (2 + n / 4 + n * n / 128 if self.exterior_only and distance > 0 else 1.0)


class Kernel(Protocol):
    """Evaluator of a field; many threads may call it at once.

    Attributes
    ----------
    dtype : dtype
        Type of the values, float32 or float64.
    batch : int
        Samples that make a call worthwhile.
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
        """Entry point for native code: machine code and its parameters, or a function of points [3, n] that
        writes their values to [1, n].
        """

        def evaluate(points: np.ndarray, out: np.ndarray) -> None:
            out[0] = self.points(*points)

        return evaluate


class FieldLoop(Protocol):
    """A loop over a field."""

    def __call__(self, frame: np.ndarray, rows: np.ndarray, out: np.ndarray) -> None:
        """Run the loop."""

    def native(self, frame: np.ndarray) -> tuple[Any, ...] | Callable[..., None]:
        """Entry point for native code."""


@dataclass(frozen=True, eq=False)
class Loops:
    """Compiled loops over a field."""

    width: int  # the number of points in a call is a multiple of it
    batch: int  # points that make a call worthwhile
    runs: Mapping[str, FieldLoop]  # the loops by name
    on_gpu: bool = False  # whether they can be launched on arrays in GPU memory


class Cells(Protocol):
    """Proofs that a field has one sign on cells, by enclosures of its values; many threads may call it."""

    def __call__(self, centres: np.ndarray, half: float) -> tuple[np.ndarray, np.ndarray]:
        """Prove cells to be empty or full.

        `centres`: [3, n], scene units; `half` in scene units. Returns bool [n].
        """
        ...


def outermost(points: np.ndarray) -> np.ndarray:
    """Outermost of points [n, 3] along -x, -y, -z, x, y and z, float64 [3, 6]."""
    return np.ascontiguousarray(points[np.concatenate([points.argmin(0), points.argmax(0)])].T)


class Field(Protocol):
    """A signed distance field: negative inside, zero on the surface."""

    @property
    def bounds(self) -> Bounds:
        """Box, Lipschitz bound and kind of the field."""
        ...

    @property
    def key(self) -> str:
        """Hash of everything that determines the field's values and bounds.

        Raises
        ------
        KernelError
            If the field cannot be compiled.
        """

    @property
    def tree(self) -> Node | None:
        """The field as a tree of formulas; None if it is not one."""
        return None

    @property
    def escape_time_only(self) -> bool:
        """True if all shapes of the field are escape-time fractals with the field of a potential."""
        return False

    @property
    def proved_box(self) -> Box:
        """Box that is proved to enclose all points where the field is negative."""
        return self.bounds.box

    @property
    def tips(self) -> np.ndarray | None:
        """Outermost points along -x, -y, -z, x, y and z, where they are known exactly, float64 [3, 6]."""
        return None

    def conservative(self) -> Field:
        """Conservative field, for skipping empty space.

        Returns
        -------
        Field
            Its positive values, divided by its own Lipschitz bound, are lower bounds of the distance to this
            field's surface.
        """
        return self

    def kernel(self, device: Device = "cpu", precision: Precision = "float32") -> Kernel:
        """Kernel of the field.

        Parameters
        ----------
        device : {"cpu", "cuda"}
            Device that evaluates the field; the CPU serves where the device cannot.
        precision : {"float32", "float64"}
            Type of the values.

        Returns
        -------
        Kernel

        Raises
        ------
        KernelError
            If the field cannot be compiled.
        """

    def cells(self, precision: Precision = "float32") -> Cells | None:
        """Proofs that the field has one sign on cells.

        Parameters
        ----------
        precision : {"float32", "float64"}
            Type of the values; a proof holds for the exact field and for its kernel of this precision.

        Returns
        -------
        Cells or None
            None if nothing can be proved.

        Raises
        ------
        KernelError
            If the field cannot be compiled.
        """
        return None

    def loops(self, loops: Sequence[Any], precision: Precision, device: Device = "cpu") -> Loops:
        """Compiled loops (`expr.loops`) over the field.

        Parameters
        ----------
        loops : sequence
            The loops to compile.
        precision : {"float32", "float64"}
            Type of the values.
        device : {"cpu", "cuda"}
            Device that runs them; the CPU serves where the device cannot.

        Returns
        -------
        Loops

        Raises
        ------
        KernelError
            If a loop cannot be compiled.
        """
