"""CUDA back end: a scene's field on an NVIDIA GPU, by numba-cuda.

Importing this module is cheap and always possible. Functions that need a GPU raise `KernelError` with a line
that names what is missing.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from ..expr.cuda_driver import available as available
from ..expr.cuda_driver import missing as missing
from ..expr.cuda_driver import require as require
from ..expr.cuda_loops import bricks, points
from ..expr.language import Linked
from .cuda_launching import launch, load_loops, parameters
from .field import Kernel, Precision
from .linker import link

if TYPE_CHECKING:
    from .node import Node

LOOPS = points, bricks
"""Loops of every CUDA kernel."""


class CudaKernel(Kernel):
    """Compiled field of one scene on the GPU.

    `precision`: "float32" or "float64".
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

        `x`, `y`, `z`: scene units: 1-D arrays on the GPU (Numba, CuPy, PyTorch, ...) of the kernel's dtype.
        """
        launch(self._loops.points, math.prod(out.shape), self._parameters, x, y, z, out)

    def bricks_on_device(
        self, corners: Any, origin: tuple[float, float, float], voxel: float, out: Any
    ) -> None:
        """Evaluate the field on bricks in GPU memory. Copies nothing and does not wait for the GPU.

        `corners`: int32 [n, 3]; `origin`, `voxel` in scene units; `out`: [n, 512] of the kernel's dtype.
        """
        frame = [self.dtype.type(v) for v in (*origin, voxel)]
        launch(self._loops.bricks, math.prod(out.shape), self._parameters, *frame, corners, out)


_kernel = lru_cache(maxsize=32)(CudaKernel)


def compile_scene(root: Node, precision: Precision = "float32") -> CudaKernel:
    """Compile the kernel of a scene tree for the GPU; see `cpu.compile_scene`."""
    return _kernel(link(root), precision)
