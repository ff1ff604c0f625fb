"""The CPU back end: a scene's field as machine code.

Loading it takes milliseconds; its functions (`machine`) are called with the interpreter unlocked, so plain
threads scale.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Literal, Protocol, overload

import numpy as np

from ..formulas.registry import Bounds, Node
from .host import lane_count
from .linker import Linked, link
from .loops import BRICKS, POINTS, Loop
from .machine import Function, constant, loaded
from .objects import object_code

Precision = Literal["float32", "float64"]


class Kernel(Protocol):
    """A field that can be evaluated, with the methods of `CpuKernel`."""

    @property
    def dtype(self) -> np.dtype: ...

    @property
    def batch(self) -> int:
        """How many samples are worth a call."""

    def points(self, x: np.ndarray, y: np.ndarray, z: np.ndarray, /) -> np.ndarray: ...

    def bricks(
        self, corners: np.ndarray, origin: tuple[float, float, float], voxel: float, out: np.ndarray, /
    ) -> None: ...


class Compilable(Protocol):
    """What stands where the root of a scene does, though it is more than a tree of formulas."""

    @property
    def bounds(self) -> Bounds: ...

    @property
    def key(self) -> str:
        """As `identity.field_key`."""

    def conservative(self) -> Compilable: ...

    def compiled(self, precision: Precision, /) -> Kernel: ...


class CpuKernel:
    """The compiled field of one scene. Safe to call from many threads at once.

    entry: `loops.POINTS` as compiled, and its parameters, for native code.
    """

    batch = 1 << 17

    def __init__(self, linked: Linked, precision: Precision = "float32") -> None:
        self.dtype: np.dtype = np.dtype(precision)
        self.width = lane_count(self.dtype.itemsize * 8)
        functions = load_functions(linked, self.dtype.itemsize * 8, self.width, (POINTS, BRICKS))
        self._points, self._bricks = functions["points"], functions["bricks"]
        self._parameters = constant(linked.parameters, self.dtype)
        self._offsets = constant(np.indices((8, 8, 8)).reshape(3, 512), self.dtype)
        self.entry = self._points, self._parameters

    def points(self, x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
        """Field values at points.

        x, y, z: arrays of one shape, any float type, scene units. Returns that shape in the kernel's dtype. A
        point with a NaN gives NaN.
        """
        shape, n = np.shape(x), np.size(x)
        padded = -(-max(n, 1) // self.width) * self.width
        coordinates = np.empty((4, padded), self.dtype)
        coordinates[:3, n:] = 0
        with np.errstate(over="ignore"):
            for row, values in zip(coordinates, (x, y, z), strict=False):
                row[:n].reshape(shape)[...] = values
        self._points(self._parameters, *coordinates, padded)
        return coordinates[3, :n].reshape(shape)

    def bricks(
        self, corners: np.ndarray, origin: tuple[float, float, float], voxel: float, out: np.ndarray
    ) -> None:
        """Field values on bricks of 8 x 8 x 8 grid points.

        corners: int32 [n, 3], C-contiguous, the grid index of each brick's first sample. out: [n, 512] of the
        kernel's dtype, C-contiguous, offset x*64 + y*8 + z. A grid point lies at ``origin + voxel * index``;
        its value depends on nothing else.
        """
        assert corners.shape == (len(out), 3) and out.shape == (len(corners), 512)
        frame = np.array([*origin, voxel], self.dtype)
        self._bricks(self._parameters, frame, *self._offsets, corners, out, len(corners))


@lru_cache(maxsize=32)
def _kernel(source: str, parameters: bytes, precision: Precision) -> CpuKernel:
    return CpuKernel(Linked(source, np.frombuffer(parameters)), precision)


@overload
def compile_scene(root: Node, precision: Precision = "float32") -> CpuKernel: ...
@overload
def compile_scene(root: Node | Compilable, precision: Precision = "float32") -> Kernel: ...
def compile_scene(root: Node | Compilable, precision: Precision = "float32") -> Kernel:
    """The kernel of a scene tree whose depths are resolved, or of another field. Raises `KernelError`."""
    if not isinstance(root, Node):
        return root.compiled(precision)
    linked = link(root)
    return _kernel(linked.source, linked.parameters.tobytes(), precision)


def load_functions(linked: Linked, bits: int, width: int, loops: Sequence[Loop]) -> dict[str, Function]:
    """The functions of loops over a linked scene, by name. Raises `KernelError`."""
    return loaded(object_code(linked, bits, width, loops), loops, np.dtype(f"float{bits}"))
