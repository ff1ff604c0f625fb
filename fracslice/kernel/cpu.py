"""The CPU back end: a scene's field as machine code.

Loading it needs llvmlite but not Numba, and takes milliseconds; its functions are called with the interpreter
unlocked, so plain threads scale.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Sequence
from functools import cached_property, lru_cache
from typing import Any, Literal, Protocol, overload

import numpy as np

from ..formulas.registry import Facts, Node
from .host import lane_count
from .linker import Linked, link
from .loops import BRICKS, POINTS, Loop
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
    def facts(self) -> Facts: ...

    @property
    def key(self) -> str:
        """As `identity.field_key`."""

    def guard(self) -> Compilable: ...

    def compiled(self, precision: Precision, /) -> Kernel: ...


class CpuKernel:
    """The compiled field of one scene. Safe to call from many threads at once."""

    batch = 1 << 17

    def __init__(self, linked: Linked, precision: Precision = "float32") -> None:
        self.dtype: np.dtype = np.dtype(precision)
        self.width = lane_count(self.dtype.itemsize * 8)
        self._parameters = linked.parameters.astype(self.dtype)
        functions = load_functions(linked, self.dtype.itemsize * 8, self.width, (POINTS, BRICKS))
        self._points, self._bricks = functions["points"], functions["bricks"]

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
        self._points(self._address(self._parameters), *(row.ctypes.data for row in coordinates), padded)
        return coordinates[3, :n].reshape(shape)

    @property
    def entry(self) -> tuple[int, int]:
        """The addresses of `loops.POINTS` as compiled and of its parameters, for native code; they live as
        long as the kernel.
        """
        code = ctypes.cast(self._points, ctypes.c_void_p).value  # type: ignore[arg-type]
        assert code
        return code, self._address(self._parameters)

    def bricks(
        self, corners: np.ndarray, origin: tuple[float, float, float], voxel: float, out: np.ndarray
    ) -> None:
        """Field values on bricks of 8 x 8 x 8 grid points.

        corners: int32 [n, 3], C-contiguous, the grid index of each brick's first sample. out: [n, 512] of the
        kernel's dtype, C-contiguous, offset x*64 + y*8 + z. A grid point lies at ``origin + voxel * index``;
        its value depends on nothing else.
        """
        assert corners.dtype == np.int32 and corners.flags.c_contiguous and out.flags.c_contiguous
        assert out.dtype == self.dtype and out.shape == (len(corners), 512)
        frame = np.array([*origin, voxel], self.dtype)
        offsets = (row.ctypes.data for row in self._brick_offsets)
        self._bricks(
            self._address(self._parameters),
            frame.ctypes.data,
            *offsets,
            corners.ctypes.data,
            out.ctypes.data,
            len(corners),
        )

    @cached_property
    def _brick_offsets(self) -> np.ndarray:
        return np.ascontiguousarray(np.indices((8, 8, 8)).reshape(3, 512).astype(self.dtype))

    @staticmethod
    def _address(array: np.ndarray) -> int:
        return array.ctypes.data


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


def load_functions(
    linked: Linked, bits: int, width: int, loops: Sequence[Loop]
) -> dict[str, Callable[..., None]]:
    """The C functions of loops over a linked scene, by name.

    They take addresses and whole numbers, release the interpreter, and may run in many threads. Raises
    `KernelError`.
    """
    return _functions(object_code(linked, bits, width, loops), loops)


_ENGINES: list[Any] = []
_C_TYPES = {"r": ctypes.c_void_p, "i": ctypes.c_void_p, "n": ctypes.c_ssize_t}


def _functions(code: bytes, loops: Sequence[Loop]) -> dict[str, Callable[..., None]]:
    import llvmlite.binding as llvm

    machine = llvm.Target.from_triple(llvm.get_process_triple()).create_target_machine(jit=True)
    engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), machine)
    engine.add_object_file(llvm.ObjectFileRef.from_data(code))
    engine.finalize_object()
    _ENGINES.append(engine)  # the code lives as long as its engine
    return {
        loop.name: ctypes.CFUNCTYPE(None, *[_C_TYPES[a] for a in loop.arguments])(
            engine.get_function_address(loop.name)
        )
        for loop in loops
    }
