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
        """Pad the states of a lattice's bricks by a border.

        Parameters
        ----------
        grid
            States, uint8 [bx, by, bz].

        Returns
        -------
        States
            Padded states.
        """
        padded = np.pad(grid, 1, constant_values=BORDER)
        return cls(padded.reshape(-1), padded.shape)

    def step(self, axis: int, step: int) -> int:
        """Return the flat offset between bricks.

        Parameters
        ----------
        axis, step
            Axis, and distance along it in bricks.

        Returns
        -------
        int
            Offset of the flat index.
        """
        return step * (self.shape[1] * self.shape[2], self.shape[2], 1)[axis]

    def places(self, numbers: np.ndarray) -> np.ndarray:
        """Convert flat indices to brick coordinates.

        Parameters
        ----------
        numbers
            Flat indices, int [n].

        Returns
        -------
        ndarray
            Brick coordinates, int [3, n].
        """
        return np.stack(np.unravel_index(numbers, self.shape)) - 1

    def distinct(self, numbers: np.ndarray) -> np.ndarray:
        """Sort flat indices and remove duplicates.

        Parameters
        ----------
        numbers
            Flat indices, int [n].

        Returns
        -------
        ndarray
            Sorted unique indices, int [m].
        """
        those = np.zeros(self.flat.shape, bool)
        those[numbers] = True
        return np.flatnonzero(those)

    def beside(self, those: np.ndarray) -> np.ndarray:
        """Return a mask of the bricks that share a face with given bricks.

        Parameters
        ----------
        those
            Mask of the given bricks, bool, like `flat`.

        Returns
        -------
        ndarray
            Mask, bool, like `flat`; undefined at the border.
        """
        result = np.zeros_like(those)
        for axis in range(3):
            step = self.step(axis, 1)
            result[step:] |= those[:-step]
            result[:-step] |= those[step:]
        return result

    def inner(self, flat: np.ndarray) -> np.ndarray:
        """Remove the border of an array like `flat`.

        Parameters
        ----------
        flat
            Array like `flat`, of any dtype.

        Returns
        -------
        ndarray
            Array [bx, by, bz], C-contiguous.
        """
        return np.ascontiguousarray(flat.reshape(self.shape)[1:-1, 1:-1, 1:-1])
