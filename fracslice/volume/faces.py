"""Signs on the faces of bricks, tested one 64-bit word at a time."""

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
"""Bits on a face of a slab of constant x: bit 8 y + z."""


@dataclass(frozen=True, eq=False)
class SignFaces:
    """Sign bits of bricks.

    Attributes
    ----------
    signs
        Sign bits, uint8 [n, 8, 8], C-contiguous: bit z of byte (x, y) is set inside.
    """

    signs: np.ndarray

    @cached_property
    def slabs(self) -> np.ndarray:
        """One 64-bit word per slab of constant x, uint64 [8, n]."""
        return np.ascontiguousarray(self.signs.reshape(-1, 64).view("<u8").T)

    @cached_property
    def either(self) -> np.ndarray:
        """Bits set in any slab, uint64 [n]."""
        result: np.ndarray = np.bitwise_or.reduce(self.slabs)
        return result

    @cached_property
    def both(self) -> np.ndarray:
        """Bits set in all slabs, uint64 [n]."""
        result: np.ndarray = np.bitwise_and.reduce(self.slabs)
        return result

    @property
    def anywhere(self) -> tuple[np.ndarray, np.ndarray]:
        """Masks of the bricks with interior samples and with exterior samples, bool [n] each."""
        return self.either != 0, self.both != ALL

    def shown(self, axis: int, step: int) -> tuple[np.ndarray, np.ndarray]:
        """Test the outermost layer of samples on one side.

        Parameters
        ----------
        axis, step
            Axis, and -1 or 1 for its lower or upper side.

        Returns
        -------
        tuple of ndarray
            Masks of the bricks with interior and with exterior samples in that layer, bool [n] each.
        """
        if axis == 0:
            layer = self.slabs[7 if step > 0 else 0]
            return layer != 0, layer != ALL
        bits = _OF_A_SLAB[axis, step]
        return (self.either & bits) != 0, (self.both & bits) != bits
