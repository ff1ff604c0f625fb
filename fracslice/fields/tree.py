"""Fields of scene trees and of arrays, with proofs by intervals that a field has one sign on cells."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Protocol

import numpy as np

from ..common.cache import key as hashed
from ..expr.intervals import TINY
from ..expr.loops import Loop, enclosures
from . import cpu
from .devices import for_field
from .field import Cells, Device, Field, Kernel, Loops, Precision
from .linker import link

if TYPE_CHECKING:
    from .node import Node


@dataclass(frozen=True, eq=False)
class Enclosures:
    """Implementation of `fields.field.Cells` for scene trees."""

    loops: Loops  # compiled loop `loops.enclosures`
    dtype: np.dtype  # type of the bounds

    def __call__(self, centres: np.ndarray, half: float) -> tuple[np.ndarray, np.ndarray]:
        """See `fields.field.Cells`."""
        low, high = self.bounds(centres, half)
        tiny = TINY[self.dtype.itemsize * 8]
        return low > tiny, high < -tiny

    def bounds(self, centres: np.ndarray, half: float) -> tuple[np.ndarray, np.ndarray]:
        """Enclose the values of the field on cells.

        `centres`: [3, n], scene units; `half` in scene units. Returns [n].
        """
        count, width = centres.shape[1], self.loops.width
        padded = -(-max(count, 1) // width) * width
        rows, out = np.zeros((3, padded), self.dtype), np.empty((2, padded), self.dtype)
        rows[:, :count] = centres
        # Centres are rounded to the type of the rows.
        frame = np.array([half + np.finfo(self.dtype).eps * abs(centres).max(initial=0)], self.dtype)
        self.loops.runs["enclosures"](np.nextafter(frame, self.dtype.type(np.inf)), rows, out)
        return out[0, :count], out[1, :count]


def kernel(root: Node, device: Device, precision: Precision) -> Kernel:
    """Compile the kernel of a tree with resolved depths; see `Field.kernel`."""
    if for_field(root, device) == "cpu":
        return cpu.compile_scene(root, precision)
    from . import cuda

    return cuda.compile_scene(root, precision)


def linked_loops(root: Node, loops: Sequence[Loop], precision: Precision, device: Device = "cpu") -> Loops:
    """Compile loops over a tree with resolved depths; see `Field.loops`."""
    if for_field(root, device) == "cpu":
        return cpu.compile_loops(link(root), tuple(loops), precision)
    from . import cuda

    return cuda.compile_loops(link(root), tuple(loops), precision)


def cells(root: Node, precision: Precision) -> Cells:
    """Compile proofs that a tree's field has one sign on cells; see `Field.cells`."""
    return Enclosures(cpu.compile_loops(link(root.signs()), (enclosures,), precision), np.dtype(precision))


def key(root: Node) -> str:
    """Hash the text, parameters and bounds of a tree and of its conservative field; see `Field.key`."""
    parts: list[object] = []
    for node in (root, root.conservative()):
        linked = link(node)
        parts += [linked.program.identity, linked.parameters, node.bounds]
    return hashed(*parts)


BATCH = 1 << 14
"""Points per call of a loop."""


class ArrayField(Field, Protocol):
    """Field whose kernel evaluates arrays."""

    def loops(self, loops: Sequence[Loop], precision: Precision, device: Device = "cpu") -> Loops:
        """Run loops over the field by NumPy, with all points as one vector; see `Field.loops`."""
        kernel = self.kernel("cpu", precision)
        return Loops(1, BATCH, {loop.name: ArrayLoop(loop, kernel) for loop in loops})


@dataclass(frozen=True, eq=False)
class ArrayLoop:
    """Python implementation of `fields.field.FieldLoop`."""

    loop: Loop  # loop to run
    kernel: Kernel  # kernel of the field

    def __call__(self, frame: np.ndarray, rows: np.ndarray, out: np.ndarray) -> None:
        with np.errstate(all="ignore"):
            self.loop.function(self.kernel.points, frame, *rows, *out, rows.shape[1])

    def native(self, frame: np.ndarray) -> Callable[..., None]:
        """Return the loop for native code; see `FieldLoop.native`."""
        return partial(self, frame)
