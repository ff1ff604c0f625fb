"""CPU back end: a scene's field as machine code, compiled or read from the cache of object files.

Loading it takes milliseconds. Its functions (`machine`) release the GIL, so plain threads scale.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import astuple, dataclass
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from .._native import Regions
from ..common.cache import Kept, cache_folder, key
from ..expr.frontend import loop_function
from ..expr.graph import Program
from ..expr.loops import Loop, bricks, points
from ..expr.runtime import REGISTERS, CompiledFunction, constant, host, lane_count, load_object, toolchain
from .field import Kernel, Loops, Precision
from .linker import Linked

if TYPE_CHECKING:
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

    def __init__(
        self, linked: Linked, precision: Precision = "float32", region: Region | None = None
    ) -> None:
        self.dtype = np.dtype(precision)
        self.width = lane_count(self.dtype.itemsize * 8)
        functions = load_functions(linked.program, self.dtype.itemsize * 8, self.width, (points, bricks))
        self._points, self._bricks = functions["points"], functions["bricks"]
        self._parameters = constant(linked.parameters, self.dtype, linked.held)
        self._offsets = constant(np.indices((8, 8, 8)).reshape(3, 512), self.dtype)
        if region is not None:
            alone = self if region.union is linked else CpuKernel(region.union, precision)
            self._look_around(linked, region, alone)

    def _look_around(self, linked: Linked, region: Region, alone: CpuKernel) -> None:
        """Let the loops pass over elements of a union that are far from a point; see `Regions`."""
        given = [
            (kernel._points, kernel._parameters, [astuple(one) for one in lists])
            for kernel, lists in ((self, linked.lists), (alone, region.union.lists))
        ]
        where = region.lipschitz, region.centre, region.half, self.width
        regions = Regions(given[0], self._bricks, given[1], *where)
        loops = (CompiledFunction(regions, loop, self.dtype) for loop in (points, bricks))
        self._points, self._bricks = loops
        self._parameters = constant(np.array([regions.address], np.uint64).view(self.dtype), self.dtype)

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
        self._bricks(self._parameters, *origin, voxel, *self._offsets, corners, out, len(corners))


@dataclass(frozen=True)
class Region:
    """Union in a scene, its Lipschitz constant, and a cube around it, scene units."""

    union: Linked  # the union alone
    lipschitz: float
    centre: tuple[float, ...]
    half: float

    @classmethod
    def of(cls, linked: Linked) -> Region | None:
        """Region of a scene with a long union, or None; measured constants bound no element of it."""
        if linked.union is None or sum(one.count for one in linked.lists) < LONG:
            return None
        bounds, union = linked.union.bounds, linked.union.linked
        if not bounds.box.finite or bounds.exterior_only or bounds.measured or not union.lists:
            return None
        centre = tuple((a + b) / 2 for a, b in zip(bounds.box.lo, bounds.box.hi, strict=True))
        return cls(union, bounds.lipschitz, centre, ROOM * max(bounds.box.size))


LONG, ROOM = 32, 0.75
"""Elements of a union from which on those near a point are looked for; half side of the cube, in which they
are, per largest side of the solid.
"""


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
    return _kernel(root.linked, precision, Region.of(root.linked))


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
    parameters = constant(linked.parameters, precision, linked.held)
    bits = parameters.dtype.itemsize * 8
    width = lane_count(bits)
    functions = load_functions(linked.program, bits, width, loops)
    return Loops(width, BATCH, {name: CompiledLoop(f, parameters) for name, f in functions.items()})


def load_functions(
    program: Program, bits: int, width: int, loops: Sequence[Loop]
) -> dict[str, CompiledFunction]:
    """Load or compile the functions of loops over the program of a scene, or over none."""
    return load_object(object_code(program, bits, width, loops), loops, np.dtype(f"float{bits}"))
