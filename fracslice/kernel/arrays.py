"""Fields that are no tree of formulas; NumPy runs their loops."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Protocol

import numpy as np

from ..formulas.field import Device, Field, Kernel, Loops, Precision
from .loops import Loop

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
    """Python implementation of `formulas.field.FieldLoop`.

    Attributes
    ----------
    loop
        Loop to run.
    kernel
        Kernel of the field.
    """

    loop: Loop
    kernel: Kernel

    def __call__(self, frame: np.ndarray, rows: np.ndarray, out: np.ndarray) -> None:
        with np.errstate(all="ignore"):
            self.loop.function(self.kernel.points, frame, *rows, *out, rows.shape[1])

    def native(self, frame: np.ndarray) -> Callable[..., None]:
        """Return the loop for native code; see `FieldLoop.native`."""
        return partial(self, frame)
