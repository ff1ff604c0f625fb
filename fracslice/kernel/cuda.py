"""CUDA back end: a scene's field on an NVIDIA GPU, by numba-cuda.

Importing this module is cheap and always possible. Functions that need a GPU raise `KernelError` with a line
that names what is missing. Machine code is cached in the cache folder, next to its
source text.
"""

from __future__ import annotations

import math
import sys
import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
from types import ModuleType
from typing import Any

import numpy as np

from ..common.keys import key
from ..formulas.field import Kernel, Loops, Precision
from ..formulas.registry import Node
from . import cuda_source
from .cuda_driver import available as available
from .cuda_driver import missing as missing
from .cuda_driver import require as require
from .cuda_driver import toolchain
from .cuda_loops import bricks, points
from .linker import Linked, link
from .loops import Loop
from .modules import imported

BLOCK = 128
"""Threads per block."""

_LAUNCH = threading.Lock()
"""Lock around kernel launches: Numba's first launch of a kernel must happen only once, and launching holds
the GIL anyway.
"""

LANES = 1 << 18
"""Lanes of a call of a loop: few enough that one call is copied while native code prepares others."""

LOOPS = points, bricks
"""Loops of every CUDA kernel."""


class CudaKernel(Kernel):
    """Compiled field of one scene on the GPU.

    Parameters
    ----------
    linked
        Linked scene.
    precision
        "float32" or "float64".

    Attributes
    ----------
    dtype
        Floating-point type.
    batch
        Samples per call that amortise its overhead.

    Raises
    ------
    KernelError
        If no GPU can be used.
    """

    batch = 1 << 22

    def __init__(self, linked: Linked, precision: Precision = "float32") -> None:
        self._cuda = require()
        self.dtype = np.dtype(precision)
        self._loops = load_loops(linked, precision, LOOPS)
        self._parameters = parameters(linked, precision)

    def points(self, x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
        shape = np.shape(x)
        if np.size(x) == 0:
            return np.empty(shape, self.dtype)
        coordinates = np.empty((3, np.size(x)), self.dtype)
        with np.errstate(over="ignore"):
            for row, values in zip(coordinates, (x, y, z), strict=True):
                row[:] = np.ravel(values)
        placed = self._cuda.to_device(coordinates)
        out = self._cuda.device_array(coordinates.shape[1], self.dtype)
        self.points_on_device(placed[0], placed[1], placed[2], out)
        result: np.ndarray = out.copy_to_host()
        return result.reshape(shape)

    def bricks(
        self, corners: np.ndarray, origin: tuple[float, float, float], voxel: float, out: np.ndarray
    ) -> None:
        assert corners.dtype == np.int32 and corners.flags.c_contiguous and out.flags.c_contiguous
        assert out.dtype == self.dtype and out.shape == (len(corners), 512)
        if len(corners):
            filled = self._cuda.device_array(out.shape, self.dtype)
            self.bricks_on_device(self._cuda.to_device(corners), origin, voxel, filled)
            filled.copy_to_host(out)

    def points_on_device(self, x: Any, y: Any, z: Any, out: Any) -> None:
        """Evaluate the field at points in GPU memory. Copies nothing and does not wait for the GPU.

        Parameters
        ----------
        x, y, z
            Coordinates, scene units: 1-D arrays on the GPU (Numba, CuPy, PyTorch, ...) of the kernel's dtype.
        out
            Receives the values; an array of the same kind.
        """
        launched(self._loops.points, math.prod(out.shape), self._parameters, x, y, z, out)

    def bricks_on_device(
        self, corners: Any, origin: tuple[float, float, float], voxel: float, out: Any
    ) -> None:
        """Evaluate the field on bricks in GPU memory. Copies nothing and does not wait for the GPU.

        Parameters
        ----------
        corners
            Grid index of the first sample of each brick, int32 [n, 3], on the GPU.
        origin, voxel
            Position of grid point (0, 0, 0) and grid spacing, scene units.
        out
            Receives the values, [n, 512] of the kernel's dtype, on the GPU.
        """
        frame = [self.dtype.type(v) for v in (*origin, voxel)]
        launched(self._loops.bricks, math.prod(out.shape), self._parameters, *frame, corners, out)


@dataclass(frozen=True, eq=False)
class CudaLoop:
    """`formulas.field.CompiledLoop` on the GPU, with a thread per lane. Rows are copied there and back.

    Attributes
    ----------
    loop
        Kernel.
    parameters
        Parameters of the scene, on the GPU.
    """

    loop: Any
    parameters: Any

    def __call__(self, frame: np.ndarray, rows: np.ndarray, out: np.ndarray, *numbers: int) -> None:
        cuda, count = require(), rows.shape[1]
        given, result = cuda.to_device(rows), cuda.to_device(out)
        arrays = [self.parameters, cuda.to_device(frame), *map(given.__getitem__, range(len(rows)))]
        arrays += map(result.__getitem__, range(len(out)))
        launched(self.loop, count, *arrays, *numbers, count)
        result.copy_to_host(out)

    def native(self, frame: np.ndarray) -> Callable[..., None]:
        """Return a function for native code.

        Parameters
        ----------
        frame
            Frame of the loop.

        Returns
        -------
        Callable
            Function of the loop's other arguments.
        """
        return partial(self, frame)


@lru_cache(maxsize=32)
def compile_loops(linked: Linked, loops: tuple[Loop, ...], precision: Precision) -> Loops:
    """Compile loops over lanes for the GPU.

    Parameters
    ----------
    linked
        Linked scene.
    loops
        Loops to compile.
    precision
        "float32" or "float64".

    Returns
    -------
    Loops
        Loops by name, with one lane.

    Raises
    ------
    KernelError
        If a loop cannot be compiled, or no GPU can be used.
    """
    module, placed = load_loops(linked, precision, loops), parameters(linked, precision)
    return Loops(1, LANES, {loop.name: CudaLoop(getattr(module, loop.name), placed) for loop in loops})


def launched(loop: Any, threads: int, *arguments: Any) -> None:
    """Launch a loop without waiting for it.

    Parameters
    ----------
    loop
        Compiled loop.
    threads
        Least number of threads, > 0.
    *arguments
        Arguments of the loop.
    """
    with _LAUNCH:
        loop[-(-threads // BLOCK), BLOCK](*arguments)


_kernel = lru_cache(maxsize=32)(CudaKernel)


def compile_scene(root: Node, precision: Precision = "float32") -> CudaKernel:
    """Compile the kernel of a scene tree for the GPU.

    Parameters
    ----------
    root
        Scene with resolved depths.
    precision
        "float32" or "float64".

    Returns
    -------
    CudaKernel
        Compiled field.

    Raises
    ------
    KernelError
        If the scene cannot be linked or compiled, or no GPU can be used.
    """
    return _kernel(link(root), precision)


def parameters(linked: Linked, precision: Precision) -> Any:
    """Copy the parameters P of a linked scene to the GPU.

    Passing them as launch constants is no faster, and makes launching slower.

    Parameters
    ----------
    linked
        Linked scene.
    precision
        "float32" or "float64".

    Returns
    -------
    DeviceNDArray
        Parameters on the GPU.

    Raises
    ------
    KernelError
        If no GPU can be used.
    """
    return require().to_device(linked.parameters.astype(precision))


def load_loops(linked: Linked, precision: Precision, loops: Sequence[Loop]) -> ModuleType:
    """Load loops over a linked scene. Each is compiled at its first call, for the types of its arguments.

    Parameters
    ----------
    linked
        Linked scene.
    precision
        "float32" or "float64".
    loops
        Loops to load.

    Returns
    -------
    module
        Module with the loops as attributes.

    Raises
    ------
    KernelError
        If no GPU can be used.
    """
    require()
    text = cuda_source.module(linked, 32 if precision == "float32" else 64, loops)
    name = f"cuda_{key(text, toolchain())}"
    return sys.modules.get(name) or imported(name, text)
