"""CPU back end: a scene's field as machine code, compiled or read from the cache of object files.

Loading it takes milliseconds. Its functions (`machine`) release the GIL, so plain threads scale.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Literal

import numpy as np

from ..common.cache import Kept, cache_folder, key
from ..expr.frontend import loop_function
from ..expr.graph import Program
from ..expr.language import InMemory
from ..expr.loops import Loop, bricks, points
from ..expr.runtime import REGISTERS, CompiledFunction, constant, host, lane_count, load_object, toolchain
from .field import Kernel, Loops, Precision
from .linker import Linked
from .regions import Region

if TYPE_CHECKING:
    from .._native import Regions
    from .node import Node


def object_code(program: Program, bits: int, width: int, loops: Sequence[Loop]) -> bytes:
    """Return the object file of loops over the program of a scene: cached, or compiled and cached.

    A file that other users could have written is not used.
    """
    about = program.identity, [(loop_function(loop).identity, loop.arguments) for loop in loops]
    name = f"{key(*about, bits, width, toolchain())}.o"

    def compiled() -> bytes:
        from ..expr.emitter import Target, compile_object

        return compile_object(program, Target(bits, width, min(REGISTERS, width), *host()), loops)

    return Kept(cache_folder()).cached(name, compiled)  # incomplete code would crash the process


def parameters(
    linked: Linked, dtype: np.dtype | str, loop: Literal["points", "bricks"] = "points"
) -> np.ndarray:
    """Return the parameters P of a linked scene, with the addresses of what is in memory.

    `loop`: what asks for the elements of long unions, "bricks" or anything else.
    """
    regions = (
        (place, InMemory(int(region.digest[:16], 16), getattr(regions_of(region), loop)))
        for place, region in linked.regions
    )
    return constant(linked.parameters, dtype, (*linked.held, *regions))


@lru_cache(maxsize=8)
def regions_of(region: Region) -> Regions:
    """Return a long union as native code knows it; kernels with the same one share it."""
    from .._native import Regions

    width = lane_count(64)
    loop = load_functions(region.program, 64, width, (points,))["points"]
    numbers = constant(region.numbers.ravel(), "float64", region.held).reshape(region.numbers.shape)
    place = region.smooth, region.lipschitz, region.centre, region.half
    return Regions(loop, numbers, width, *place)


BATCH = 1 << 10
"""Points per call of a loop: few enough to stay in the fastest cache."""


class CpuKernel(Kernel):
    """Compiled field of one scene.

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
    width
        Lanes.
    """

    def __init__(self, linked: Linked, precision: Precision = "float32") -> None:
        self.dtype = np.dtype(precision)
        self.width = lane_count(self.dtype.itemsize * 8)
        self._parameters = self._of_bricks = parameters(linked, precision)
        loop, offsets = bricks, np.indices((8, 8, 8)).reshape(3, 512)
        if linked.regions:  # corners come first, which tell a long union where a brick lies
            self._of_bricks = parameters(linked, precision, "bricks")
            corners = offsets[:, np.isin(offsets, (0, 7)).all(0)]
            offsets = np.hstack([np.resize(corners.T, (self.width, 3)).T, offsets])
            loop = bricks.fix(ahead=self.width)
        functions = load_functions(linked.program, self.dtype.itemsize * 8, self.width, (points, loop))
        self._points, self._bricks = functions["points"], functions["bricks"]
        self._offsets = constant(offsets, self.dtype)

    @property
    def entry(self) -> tuple[CompiledFunction, np.ndarray]:
        """Compiled `loops.points` and its parameters."""
        return self._points, self._parameters

    def points(self, x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
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
        assert corners.shape == (len(out), 3) and out.shape == (len(corners), 512)
        self._bricks(self._of_bricks, *origin, voxel, *self._offsets, corners, out, len(corners))


_kernel = lru_cache(maxsize=32)(CpuKernel)


def compile_scene(root: Node, precision: Precision = "float32") -> CpuKernel:
    """Compile the kernel of a scene tree.

    Parameters
    ----------
    root
        Scene with resolved depths.
    precision
        "float32" or "float64".

    Returns
    -------
    CpuKernel
        Compiled field.

    Raises
    ------
    KernelError
        If the scene cannot be linked or compiled.
    """
    return _kernel(root.linked, precision)


@dataclass(frozen=True, eq=False)
class CompiledLoop:
    """Machine-code implementation of `fields.field.FieldLoop`."""

    function: CompiledFunction  # compiled loop
    parameters: np.ndarray  # parameters P of the scene

    def __call__(self, frame: np.ndarray, rows: np.ndarray, out: np.ndarray) -> None:
        self.function(self.parameters, frame, *rows, *out, rows.shape[1])

    def native(self, frame: np.ndarray) -> tuple[CompiledFunction, np.ndarray, np.ndarray]:
        """Return the loop for native code; see `FieldLoop.native`."""
        return self.function, self.parameters, frame


@lru_cache(maxsize=32)
def compile_loops(linked: Linked, loops: tuple[Loop, ...], precision: Precision) -> Loops:
    """Compile loops over a linked scene.

    `precision`: "float32" or "float64".
    """
    placed = parameters(linked, precision)
    bits = placed.dtype.itemsize * 8
    width = lane_count(bits)
    functions = load_functions(linked.program, bits, width, loops)
    return Loops(width, BATCH, {name: CompiledLoop(f, placed) for name, f in functions.items()})


def load_functions(
    program: Program, bits: int, width: int, loops: Sequence[Loop]
) -> dict[str, CompiledFunction]:
    """Load or compile the functions of loops over the program of a scene, or over none."""
    return load_object(object_code(program, bits, width, loops), loops, np.dtype(f"float{bits}"))
