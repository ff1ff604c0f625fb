"""Where a field is zero on many segments at once: the loops that its compiled kernel runs, and their rounds.

A segment is six rows: where it starts, and from there to its end; a root is a share t of it. Every lane is
for itself: what it finds does not depend on its neighbours, nor on how the segments are dealt out.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache, partial

import numpy as np

from ..formulas import vocabulary
from ..formulas.registry import Node
from ..kernel import Compilable, compile_scene
from ..kernel.cpu import Precision, load_functions
from ..kernel.host import lane_count
from ..kernel.linker import Linked, link
from ..kernel.loops import Loop
from ..kernel.machine import Function, constant
from .root_loops import AIM, FIND, LEAD, POLISH

FRAMES = {"float32": (1e-6, 1e-5, 5e-2, 1e-6, 3e-4), "float64": (1e-9, 1e-7, 1e-5, 1e-6, 1e-7)}
"""FRAME but for its first number, the lengths in voxels."""

QUICK, MOST = 8, 48
"""Steps towards a root that all segments are given, and those that then are left."""

LOOPS = {"float32": (FIND, LEAD), "float64": (FIND, POLISH, AIM)}


class Roots:
    """The loops over one scene's field. Safe to call from many threads at once.

    precision: "float32" or "float64". voxel: scene units. Segments are float [6, n] of that precision, n a
    multiple of `width`. Where the root is not a scene tree its own kernel is called, on NumPy's arrays.
    """

    def __init__(self, root: Node | Compilable, precision: Precision, voxel: float) -> None:
        self.dtype = np.dtype(precision)
        small, near, reach, tight, close = FRAMES[precision]
        frame = np.array([1 / voxel, small, near, reach * voxel, tight * voxel, close])
        self._frame = constant(frame, self.dtype)
        if isinstance(root, Node):
            linked = link(root)
            made = _compiled(linked.source, linked.parameters.tobytes(), precision)
        else:
            made = _on_arrays(root, precision)
        self.width, self._functions = made

    def padded(self, index: np.ndarray) -> np.ndarray:
        """The numbers of some segments, the last one repeated until they fill their lanes."""
        return np.concatenate([index, np.repeat(index[-1:], -len(index) % self.width)])

    def found(self, segments: np.ndarray) -> np.ndarray:
        """The roots, [n], as shares of the segments; where the ends have one sign, the end nearer to zero."""
        roots = self._stepped(segments, QUICK)
        slow = np.flatnonzero(roots > 1)
        if len(slow):
            slow = self.padded(slow)
            left = self._stepped(segments.take(slow, 1), MOST)
            roots[slow] = np.where(left > 1, left - 2, left)
        return roots

    def _stepped(self, segments: np.ndarray, steps: int) -> np.ndarray:
        roots = np.empty((1, segments.shape[1]), self.dtype)
        self._functions["find"](self._frame, segments, roots, steps)
        found: np.ndarray = roots[0]
        return found

    def native(self, name: str) -> Native:
        """One of the loops for native code."""
        run = self._functions[name]
        if isinstance(run, CompiledLoop):
            return run.function, run.parameters, self._frame
        return partial(run, self._frame)

    def aimed(self, segments: np.ndarray, roots: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Roots brought nearer, [n], and |f| in voxels, [n]."""
        out = np.empty((2, len(roots)), self.dtype)
        out[0] = roots
        self._functions["aim"](self._frame, segments, out)
        return out[0], out[1]

    def lead(self, trust_regions: np.ndarray) -> np.ndarray:
        """The ways, [3, n], from points to the surface. trust_regions: [15, n]: the points, the space
        below and above them, the ways to somewhere of the other sign and to the middle, or NaN."""
        ways = np.empty((3, trust_regions.shape[1]), self.dtype)
        self._functions["lead"](self._frame, trust_regions, ways)
        return ways


Run = Callable[..., None]
"""A loop on its frame, the rows that it reads, those that it writes, both C-contiguous, and its numbers."""

Native = tuple[Function, np.ndarray, np.ndarray] | Callable[..., None]
"""A loop, its parameters and its frame; or a function of the rows that it reads, those that it writes and its
numbers."""


@dataclass(frozen=True, eq=False)
class CompiledLoop:
    """A `Run` in machine code."""

    function: Function
    parameters: np.ndarray

    def __call__(self, frame: np.ndarray, rows: np.ndarray, out: np.ndarray, *numbers: int) -> None:
        self.function(self.parameters, frame, *rows, *out, *numbers, rows.shape[1])


@lru_cache(maxsize=32)
def _compiled(source: str, numbers: bytes, precision: Precision) -> tuple[int, dict[str, Run]]:
    """How many lanes the compiled loops take at once, and these by name."""
    parameters = constant(np.frombuffer(numbers), precision)
    bits = parameters.dtype.itemsize * 8
    width = lane_count(bits)
    functions = load_functions(Linked(source, parameters), bits, width, LOOPS[precision])
    return width, {name: CompiledLoop(function, parameters) for name, function in functions.items()}


def _on_arrays(root: Compilable, precision: Precision) -> tuple[int, dict[str, Run]]:
    """The same texts run by NumPy, for a field that is not linked: all segments are one vector."""
    kernel = compile_scene(root, precision)
    words = {
        **vars(vocabulary),
        "WIDTH": sys.maxsize,
        "load": lambda row, _: row,
        "store": lambda row, _, values: np.copyto(row, values),
        "field": lambda x, y, z, _: kernel.points(x, y, z),
    }

    def runs(loop: Loop) -> Run:
        exec(loop.source, words)

        def run(frame: np.ndarray, rows: np.ndarray, out: np.ndarray, *numbers: int) -> None:
            with np.errstate(all="ignore"):
                words[loop.name](None, frame, *rows, *out, *numbers, rows.shape[1])

        return run

    return 1, {loop.name: runs(loop) for loop in LOOPS[precision]}
