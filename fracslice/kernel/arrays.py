"""Fields that are no tree of formulas: NumPy runs their loops."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Protocol

import numpy as np

from ..formulas.field import Field, Kernel, Loops, Precision
from .loops import Loop

BATCH = 1 << 14
"""Points that a loop is run on together."""


class ArrayField(Field, Protocol):
    """A field whose kernel is called on arrays."""

    def loops(self, loops: Sequence[Loop], precision: Precision) -> Loops:
        """The same functions run by NumPy: all points are one vector."""
        kernel = self.kernel("cpu", precision)
        return Loops(1, BATCH, {loop.name: ArrayLoop(loop, kernel) for loop in loops})


@dataclass(frozen=True, eq=False)
class ArrayLoop:
    """A `formulas.field.Run` in Python."""

    loop: Loop
    kernel: Kernel

    def __call__(self, frame: np.ndarray, rows: np.ndarray, out: np.ndarray, *numbers: int) -> None:
        with np.errstate(all="ignore"):
            self.loop.function(self.kernel.points, frame, *rows, *out, *numbers, rows.shape[1])

    def native(self, frame: np.ndarray) -> Callable[..., None]:
        return partial(self, frame)
