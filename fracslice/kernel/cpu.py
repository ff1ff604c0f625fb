"""The CPU back end: a scene's field as machine code.

Loading it takes milliseconds; its functions (`machine`) are called with the interpreter unlocked, so plain
threads scale.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from ..formulas.field import Kernel, Loops, Precision
from ..formulas.registry import Node
from .host import lane_count
from .linker import Linked, link
from .loops import Loop, bricks, points
from .machine import Function, constant, loaded
from .objects import object_code

BATCH = 1 << 10
"""Points that a loop is run on together: they stay in the fastest memory."""


class CpuKernel(Kernel):
    """The compiled field of one scene."""

    def __init__(self, linked: Linked, precision: Precision = "float32") -> None:
        self.dtype = np.dtype(precision)
        self.width = lane_count(self.dtype.itemsize * 8)
        functions = load_functions(linked, self.dtype.itemsize * 8, self.width, (points, bricks))
        self._points, self._bricks = functions["points"], functions["bricks"]
        self._parameters = constant(linked.parameters, self.dtype)
        self._offsets = constant(np.indices((8, 8, 8)).reshape(3, 512), self.dtype)

    @property
    def entry(self) -> tuple[Function, np.ndarray]:
        """`loops.points` as compiled, and its parameters."""
        return self._points, self._parameters

    def points(self, x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
        """`Kernel.points`."""
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
        """`Kernel.bricks`."""
        assert corners.shape == (len(out), 3) and out.shape == (len(corners), 512)
        frame = np.array([*origin, voxel], self.dtype)
        self._bricks(self._parameters, frame, *self._offsets, corners, out, len(corners))


@lru_cache(maxsize=32)
def _kernel(source: str, parameters: bytes, precision: Precision) -> CpuKernel:
    return CpuKernel(Linked(source, np.frombuffer(parameters)), precision)


def compile_scene(root: Node, precision: Precision = "float32") -> CpuKernel:
    """The kernel of a scene tree whose depths are resolved. Raises `KernelError`."""
    linked = link(root)
    return _kernel(linked.source, linked.parameters.tobytes(), precision)


@dataclass(frozen=True, eq=False)
class CompiledLoop:
    """A `formulas.field.Run` in machine code."""

    function: Function
    parameters: np.ndarray

    def __call__(self, frame: np.ndarray, rows: np.ndarray, out: np.ndarray, *numbers: int) -> None:
        self.function(self.parameters, frame, *rows, *out, *numbers, rows.shape[1])

    def native(self, frame: np.ndarray) -> tuple[Function, np.ndarray, np.ndarray]:
        return self.function, self.parameters, frame


@lru_cache(maxsize=32)
def compile_loops(source: str, numbers: bytes, loops: tuple[Loop, ...], precision: Precision) -> Loops:
    """Loops over a linked scene, given as its text and its parameters. Raises `KernelError`."""
    parameters = constant(np.frombuffer(numbers), precision)
    bits = parameters.dtype.itemsize * 8
    width = lane_count(bits)
    functions = load_functions(Linked(source, parameters), bits, width, loops)
    return Loops(width, BATCH, {name: CompiledLoop(f, parameters) for name, f in functions.items()})


def load_functions(linked: Linked, bits: int, width: int, loops: Sequence[Loop]) -> dict[str, Function]:
    """The functions of loops over a linked scene, by name. Raises `KernelError`."""
    return loaded(object_code(linked, bits, width, loops), loops, np.dtype(f"float{bits}"))
