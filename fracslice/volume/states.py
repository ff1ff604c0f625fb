"""What the sampler knows of each brick of a lattice."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

EMPTY, CANDIDATE, FULL, QUEUED, BORDER = range(5)


@dataclass(frozen=True, eq=False)
class States:
    """The bricks of a lattice with one more around, each addressed by one number.

    flat: uint8 [(bx + 2) (by + 2) (bz + 2)], z the fastest; those outside the lattice are `BORDER`, so that
    every brick has six neighbours, a fixed number away. shape: (bx + 2, by + 2, bz + 2).
    """

    flat: np.ndarray
    shape: tuple[int, ...]

    @classmethod
    def within(cls, grid: np.ndarray) -> States:
        """grid: the states [bx, by, bz] of the lattice's bricks."""
        padded = np.pad(grid, 1, constant_values=BORDER)
        return cls(padded.reshape(-1), padded.shape)

    def step(self, axis: int, step: int) -> int:
        """How much farther the number is of a brick that is so many bricks farther."""
        return step * (self.shape[1] * self.shape[2], self.shape[2], 1)[axis]

    def places(self, numbers: np.ndarray) -> np.ndarray:
        """The bricks of these numbers, [3, n]."""
        return np.stack(np.unravel_index(numbers, self.shape)) - 1

    def distinct(self, numbers: np.ndarray) -> np.ndarray:
        """Numbers in order, each once."""
        those = np.zeros(self.flat.shape, bool)
        those[numbers] = True
        return np.flatnonzero(those)

    def beside(self, those: np.ndarray) -> np.ndarray:
        """Which bricks have one of `those` on a face, for bool arrays like `flat`; anything at the border."""
        found = np.zeros_like(those)
        for axis in range(3):
            step = self.step(axis, 1)
            found[step:] |= those[:-step]
            found[:-step] |= those[step:]
        return found

    def inner(self, flat: np.ndarray) -> np.ndarray:
        """An array like `flat` without the border, [bx, by, bz], C-contiguous."""
        return np.ascontiguousarray(flat.reshape(self.shape)[1:-1, 1:-1, 1:-1])
