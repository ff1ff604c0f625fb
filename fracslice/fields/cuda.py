"""CUDA back end: a scene's field on an NVIDIA GPU, as machine code that is kept in the cache.

Importing this module is cheap and always possible. Functions that need a GPU raise `KernelError` with a line
that names what is missing.
"""

from __future__ import annotations

import ctypes
import struct
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import TYPE_CHECKING, Any

import numpy as np

from ..common.cache import Kept, cache_folder, key
from ..errors import KernelError
from ..expr import cuda_driver
from ..expr.cuda_driver import DeviceArray, address, device_array, require, to_device
from ..expr.frontend import loop_function
from ..expr.graph import Program
from ..expr.loops import OWN, Loop, bricks, element_type, is_array, points
from ..expr.runtime import toolchain
from .field import Kernel, Loops, Precision
from .linker import Linked

if TYPE_CHECKING:
    from .node import Node

BLOCK = 128
"""Threads per block."""

REGISTERS = {"float32": 96, "float64": 255}
"""Most registers of a thread. With 96, five blocks run on a multiprocessor; with the 170 that path tracing
would have, it takes a fifth longer.
"""

LANES = 1 << 18
"""Lanes of a call of a loop: few enough that one call is copied while native code prepares others."""


@dataclass(frozen=True, eq=False)
class CudaFunction:
    """Compiled loop, launched with arrays in GPU memory and numbers; see `machine.CompiledFunction`."""

    code: ctypes.c_void_p  # loaded function
    kinds: Sequence[tuple[str, np.dtype]]  # letter and type of each argument that is passed

    def launch(self, threads: int, *values: Any) -> None:
        """Launch the loop without waiting for it."""
        words = [_word(*kind, value) for kind, value in zip(self.kinds, values, strict=True)]
        cuda_driver.launch(self.code, -(-threads // BLOCK), BLOCK, words)


def _word(letter: str, dtype: np.dtype, value: Any) -> bytes:
    """Eight bytes of an argument."""
    if is_array(letter):
        return struct.pack("<q", address(value, dtype))
    return np.array(value, dtype).tobytes().ljust(8, b"\0")


def load_functions(
    program: Program, precision: Precision, loops: Sequence[Loop]
) -> Mapping[str, CudaFunction]:
    """Load or compile the functions of loops; see `cpu.load_functions`."""
    require()
    return _functions(program, precision, tuple(loops))


@lru_cache(maxsize=64)
def _functions(program: Program, precision: Precision, loops: tuple[Loop, ...]) -> Mapping[str, CudaFunction]:
    code = machine_code(program, precision, loops)
    loaded = cuda_driver.load_code(code, [loop.name for loop in loops])
    real, functions = np.dtype(precision), {}
    for loop, function in zip(loops, loaded, strict=True):
        kinds = [(a, element_type(a, real)) for a in loop.arguments if a not in OWN]
        functions[loop.name] = CudaFunction(function, kinds)
    return functions


def machine_code(program: Program, precision: Precision, loops: tuple[Loop, ...]) -> bytes:
    """Return the machine code of loops: cached, or compiled and cached; see `cpu.object_code`."""
    capability = cuda_driver.capability()
    about = program.identity, [(loop_function(one).identity, one.arguments, one.own) for one in loops]
    name = f"{key(*about, precision, capability, toolchain())}.cubin"

    def compiled() -> bytes:
        from ..expr.emitter import compile_ptx

        bits = 8 * np.dtype(precision).itemsize
        ptx = compile_ptx(program, bits, capability, loops)
        return cuda_driver.assemble(ptx, REGISTERS[precision])

    return Kept(cache_folder()).cached(name, compiled)


def parameters(linked: Linked, precision: Precision) -> DeviceArray:
    """Copy the parameters P of a linked scene to the GPU.

    Passing them as launch constants is no faster, and makes launching slower. Raises `KernelError` for data
    in the memory of the CPU.
    """
    if linked.held:
        raise KernelError("a scene with data in memory: expected the device cpu, found cuda")
    return to_device(linked.parameters.astype(precision))


class CudaKernel(Kernel):
    """Compiled field of one scene on the GPU.

    `precision`: "float32" or "float64".
    """

    batch = 1 << 22

    def __init__(self, linked: Linked, precision: Precision = "float32") -> None:
        self.dtype = np.dtype(precision)
        functions = load_functions(linked.program, precision, (points, bricks))
        self._points, self._bricks = functions["points"], functions["bricks"]
        self._parameters = parameters(linked, precision)
        self._offsets = to_device(np.indices((8, 8, 8)).reshape(3, 512).astype(precision))

    def points(self, x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
        shape = np.shape(x)
        if np.size(x) == 0:
            return np.empty(shape, self.dtype)
        coordinates = np.empty((3, np.size(x)), self.dtype)
        with np.errstate(over="ignore"):
            for row, values in zip(coordinates, (x, y, z), strict=True):
                row[:] = np.ravel(values)
        out = device_array(coordinates.shape[1], self.dtype)
        placed = to_device(coordinates)
        self.points_on_device(placed[0], placed[1], placed[2], out)
        return out.copy_to_host().reshape(shape)

    def bricks(
        self, corners: np.ndarray, origin: tuple[float, float, float], voxel: float, out: np.ndarray
    ) -> None:
        assert corners.dtype == np.int32 and corners.flags.c_contiguous and out.flags.c_contiguous
        assert out.dtype == self.dtype and out.shape == (len(corners), 512)
        if len(corners):
            filled = device_array(out.shape, self.dtype)
            self.bricks_on_device(to_device(corners), origin, voxel, filled)
            filled.copy_to_host(out)

    def points_on_device(self, x: Any, y: Any, z: Any, out: Any) -> None:
        """Evaluate the field at points in GPU memory. Copies nothing and does not wait for the GPU.

        `x`, `y`, `z`: scene units: 1-D arrays on the GPU (CuPy, PyTorch, ...) of the kernel's dtype.
        """
        (n,) = out.shape
        self._points.launch(n, self._parameters, x, y, z, out, n)

    def bricks_on_device(
        self, corners: Any, origin: tuple[float, float, float], voxel: float, out: Any
    ) -> None:
        """Evaluate the field on bricks in GPU memory. Copies nothing and does not wait for the GPU.

        `corners`: int32 [n, 3]; `origin`, `voxel` in scene units; `out`: [n, 512] of the kernel's dtype.
        """
        n = len(out)
        self._bricks.launch(512 * n, self._parameters, *origin, voxel, *self._offsets, corners, out, n)


_kernel = lru_cache(maxsize=32)(CudaKernel)


def compile_scene(root: Node, precision: Precision = "float32") -> CudaKernel:
    """Compile the kernel of a scene tree for the GPU; see `cpu.compile_scene`."""
    return _kernel(root.linked, precision)


@dataclass(frozen=True, eq=False)
class CudaLoop:
    """`fields.field.CompiledLoop` on the GPU, with a thread per lane. Rows are copied there and back."""

    function: CudaFunction  # compiled loop
    parameters: DeviceArray  # parameters of the scene

    def __call__(self, frame: np.ndarray, rows: np.ndarray, out: np.ndarray) -> None:
        result = to_device(out)
        self.launch(rows.shape[1], to_device(frame), *to_device(rows), *result)
        result.copy_to_host(out)

    def launch(self, count: int, frame: DeviceArray, *arguments: Any) -> None:
        """Launch the loop on rows in GPU memory, without waiting for it."""
        self.function.launch(count, self.parameters, frame, *arguments, count)

    def native(self, frame: np.ndarray) -> Callable[..., None]:
        """Return a function for native code; see `FieldLoop.native`."""
        return partial(self, frame)


@lru_cache(maxsize=32)
def compile_loops(linked: Linked, loops: tuple[Loop, ...], precision: Precision) -> Loops:
    """Compile loops for the GPU, with one lane; see `cpu.compile_loops`."""
    placed = parameters(linked, precision)
    functions = load_functions(linked.program, precision, loops)
    runs = {name: CudaLoop(function, placed) for name, function in functions.items()}
    return Loops(1, LANES, runs, on_gpu=True)
