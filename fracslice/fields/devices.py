"""Fields of scene trees and of arrays on a device: NumPy, which is the oracle, the CPU or a GPU."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from ..common.cache import key as hashed
from ..common.cache import warn
from ..common.parameters import Choice, validate_value
from ..errors import DeviceError
from ..expr import vocabulary
from ..expr.graph import ON_ARRAYS, Evaluator
from ..expr.intervals import ON_CELLS, TINY, Interval, enclosed
from ..expr.language import words
from ..expr.loops import Loop, enclosures
from . import cpu
from .field import Cells, Device, Field, Kernel, Loops, Precision
from .linker import FIELD

if TYPE_CHECKING:
    from .node import Node


DEVICES = Choice("auto", "what computes", ("cpu", "cuda", "auto"))
"""Parameter of the device to compute on."""
FEWEST = 1 << 22
"""Samples of a picture below which "auto" selects the CPU: one core renders them while CUDA starts."""


def choose_device(device: str) -> Device:
    """Select a compute device."""
    validate_value("device", device, DEVICES, DeviceError)
    if device == "cpu":
        return "cpu"
    from ..expr.cuda_driver import missing

    reason = missing()
    if reason and device == "cuda":
        raise DeviceError(f"device cuda: {reason}")
    return "cpu" if reason else "cuda"


def for_field(root: Node, device: Device) -> Device:
    """Select the CPU for a field with a model, outline or other in its memory, with one warning."""
    if device == "cpu":
        return device
    for node in root.solids():
        if node.is_in_memory:
            warn(f"a scene with a <{node.formula.name}> is computed on the CPU, in whose memory that is")
            return "cpu"
    return device


def for_picture(device: str, size: tuple[int, int], samples: int) -> str:
    """Select the CPU for a small picture, unless a device was named.

    `size` in pixels; `samples`: samples per pixel.
    """
    return "cpu" if device == "auto" and size[0] * size[1] * samples < FEWEST else device


def reference(root: Node) -> Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]:
    """Return the signed field of a scene tree.

    Parameters
    ----------
    root
        Scene with resolved depths.

    Returns
    -------
    Callable
        ``f(x, y, z)`` of float64 arrays of one shape, scene units.

    Raises
    ------
    KernelError
        If the scene cannot be linked.
    """
    function = _field(root, ON_ARRAYS)

    def evaluate(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
        return np.asarray(function(*(np.asarray(a, dtype=np.float64) for a in (x, y, z))))

    return evaluate


def enclosure(root: Node) -> Callable[[Interval, Interval, Interval], Interval]:
    """Return the field of a scene tree on cells.

    Returns a value in scene units.
    """
    return _field(root, ON_CELLS)


def _field(root: Node, operations: Mapping[str, Callable[..., Any]]) -> Callable[..., Any]:
    """Field of a tree with given functions of the vocabulary."""
    linked = root.linked
    memory = {words(memory.digest): memory for _, memory in linked.held}

    def asking(function: Callable[..., Any]) -> Callable[..., Any]:
        def asked(*given: Any) -> Any:
            *point, place = given
            shape = memory[tuple(place)]
            if isinstance(point[0], Interval):
                return enclosed(lambda *middle: function(*middle, shape), *point)
            return function(*point, shape)

        return asked

    asked = {name: asking(getattr(vocabulary, name)) for name in vocabulary.OF_FILES}
    named = linked.program.functions
    evaluator = Evaluator({**operations, **asked}, named)

    def evaluate(*points: Any) -> Any:
        with np.errstate(all="ignore"):
            return evaluator(named[FIELD], *points, linked.parameters)

    return evaluate


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
        return cpu.compile_loops(root.linked, tuple(loops), precision)
    from . import cuda

    return cuda.compile_loops(root.linked, tuple(loops), precision)


def cells(root: Node, precision: Precision) -> Cells:
    """Compile proofs that a tree's field has one sign on cells; see `Field.cells`."""
    return Enclosures(cpu.compile_loops(root.signs().linked, (enclosures,), precision), np.dtype(precision))


def key(root: Node) -> str:
    """Hash the text, parameters and bounds of a tree and of its conservative field; see `Field.key`."""
    parts: list[object] = []
    for node in (root, root.conservative()):
        parts += [node.linked.program.identity, node.linked.parameters, node.bounds]
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
