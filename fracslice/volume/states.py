"""State of each brick during sampling."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ..work import Work, chunks
from .faces import FACES

EMPTY, CANDIDATE, FULL, QUEUED, BORDER = range(5)

RANGE = 1 << 20
"""Bricks per task."""


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
    def within(cls, grid: np.ndarray, work: Work) -> States:
        """Pad the states of a lattice's bricks by a border.

        Parameters
        ----------
        grid
            States, uint8 [bx, by, bz].
        work
            Execution settings.

        Returns
        -------
        States
            Padded states.
        """
        padded = np.full([n + 2 for n in grid.shape], BORDER, np.uint8)

        def task(layer: int) -> None:
            padded[layer + 1, 1:-1, 1:-1] = grid[layer]

        work.map(task, range(len(grid)))
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

    def where(self, test: Callable[[slice], np.ndarray], work: Work) -> np.ndarray:
        """Find the bricks that pass a test.

        Parameters
        ----------
        test
            Mask of the bricks of a range of flat indices, which has a brick beside each.
        work
            Execution settings.

        Returns
        -------
        ndarray
            Their flat indices, ascending, int [n].
        """
        layer = self.step(0, 1)
        return where(test, layer, self.flat.size - layer, work)

    def beside(self, part: slice, kinds: Sequence[int]) -> np.ndarray:
        """Test whether a face of bricks borders on a brick of some states.

        Parameters
        ----------
        part
            Range of flat indices, as for `where`.
        kinds
            The states.

        Returns
        -------
        ndarray
            Mask, bool; undefined at the border.
        """
        result = np.zeros(part.stop - part.start, bool)
        for step in (self.step(*face) for face in FACES):
            seen = self.flat[part.start + step : part.stop + step]
            for kind in kinds:
                result |= seen == kind
        return result

    def inner(self, flat: np.ndarray, work: Work) -> np.ndarray:
        """Remove the border of an array like `flat`.

        Parameters
        ----------
        flat
            Array like `flat`, of any dtype.
        work
            Execution settings.

        Returns
        -------
        ndarray
            Array [bx, by, bz], C-contiguous.
        """
        grid = flat.reshape(self.shape)[1:-1, 1:-1, 1:-1]
        result = np.empty(grid.shape, flat.dtype)

        def task(layer: int) -> None:
            result[layer] = grid[layer]

        work.map(task, range(len(grid)))
        return result


def where(test: Callable[[slice], np.ndarray], first: int, end: int, work: Work) -> np.ndarray:
    """Find the numbers of a range that pass a test.

    Parameters
    ----------
    test
        Mask of the numbers of a part of the range.
    first, end
        The range; its end is excluded.
    work
        Execution settings.

    Returns
    -------
    ndarray
        The numbers, ascending, int [n].
    """
    parts = [slice(first + part.start, first + part.stop) for part in chunks(end - first, RANGE)]
    numbers = work.collect(lambda part: part.start + np.flatnonzero(test(part)), parts)
    return np.concatenate([np.empty(0, np.intp), *numbers])


def distinct(numbers: np.ndarray) -> np.ndarray:
    """Sort flat indices and remove duplicates. `numpy.unique` uses hashes, which take five times as long.

    Parameters
    ----------
    numbers
        Flat indices, int [n].

    Returns
    -------
    ndarray
        Sorted unique indices, int [m].
    """
    ordered = np.sort(numbers)
    fresh = np.ones(len(ordered), bool)
    fresh[1:] = ordered[1:] != ordered[:-1]
    return np.asarray(ordered[fresh])
