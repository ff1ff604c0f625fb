"""What bricks show on their faces, told from their sign bits a word at a time."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

FACES = [(axis, step) for axis in range(3) for step in (-1, 1)]

ALL = np.uint64(0xFFFFFFFFFFFFFFFF)
_OF_A_SLAB = {
    (1, -1): np.uint64(0xFF),
    (1, 1): np.uint64(0xFF << 56),
    (2, -1): np.uint64(0x0101010101010101),
    (2, 1): np.uint64(0x8080808080808080),
}
"""The bits on a face of a slab of constant x: bit 8 y + z."""


@dataclass(frozen=True, eq=False)
class SignFaces:
    """signs: uint8 [n, 8, 8], C-contiguous, bit z of byte (x, y) set where inside."""

    signs: np.ndarray

    @cached_property
    def slabs(self) -> np.ndarray:
        """A word for each x, uint64 [8, n]."""
        return np.ascontiguousarray(self.signs.reshape(-1, 64).view("<u8").T)

    @cached_property
    def either(self) -> np.ndarray:
        """The bits set in any slab, uint64 [n]."""
        found: np.ndarray = np.bitwise_or.reduce(self.slabs)
        return found

    @cached_property
    def both(self) -> np.ndarray:
        """The bits set in all slabs, uint64 [n]."""
        found: np.ndarray = np.bitwise_and.reduce(self.slabs)
        return found

    @property
    def anywhere(self) -> tuple[np.ndarray, np.ndarray]:
        """Whether each brick has inside samples, and outside ones, bool [n]."""
        return self.either != 0, self.both != ALL

    def shown(self, axis: int, step: int) -> tuple[np.ndarray, np.ndarray]:
        """The same for the outermost layer of samples on one side."""
        if axis == 0:
            layer = self.slabs[7 if step > 0 else 0]
            return layer != 0, layer != ALL
        bits = _OF_A_SLAB[axis, step]
        return (self.either & bits) != 0, (self.both & bits) != bits
