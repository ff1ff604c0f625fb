"""State of each brick during sampling."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

EMPTY, CANDIDATE, FULL, QUEUED, BORDER = range(5)


@dataclass(frozen=True, eq=False)
class States:
    """States of a lattice's bricks with one layer of border around them, addressed by flat index.

    Attributes
    ----------
    flat
        States, uint8 [(bx + 2) (by + 2) (bz + 2)], z fastest. Those outside the lattice are `BORDER`, so that
        every brick has six neighbours at constant offsets.
    shape
        Dimensions (bx + 2, by + 2, bz + 2).
    """

    flat: np.ndarray
    shape: tuple[int, ...]

    @classmethod
    def within(cls, grid: np.ndarray) -> States:
        """Pad the states [bx, by, bz] of a lattice's bricks by a border."""
        padded = np.pad(grid, 1, constant_values=BORDER)
        return cls(padded.reshape(-1), padded.shape)

    def step(self, axis: int, step: int) -> int:
        """Flat offset of the brick that is `step` bricks farther along an axis."""
        return step * (self.shape[1] * self.shape[2], self.shape[2], 1)[axis]

    def places(self, numbers: np.ndarray) -> np.ndarray:
        """Brick coordinates [3, n] of flat indices [n]."""
        return np.stack(np.unravel_index(numbers, self.shape)) - 1

    def distinct(self, numbers: np.ndarray) -> np.ndarray:
        """Sorted unique flat indices."""
        those = np.zeros(self.flat.shape, bool)
        those[numbers] = True
        return np.flatnonzero(those)

    def beside(self, those: np.ndarray) -> np.ndarray:
        """Mask of the bricks that share a face with a brick of the mask `those`; both like `flat`. Undefined
        at the border.
        """
        found = np.zeros_like(those)
        for axis in range(3):
            step = self.step(axis, 1)
            found[step:] |= those[:-step]
            found[:-step] |= those[step:]
        return found

    def inner(self, flat: np.ndarray) -> np.ndarray:
        """Array like `flat` without the border, [bx, by, bz], C-contiguous."""
        return np.ascontiguousarray(flat.reshape(self.shape)[1:-1, 1:-1, 1:-1])
