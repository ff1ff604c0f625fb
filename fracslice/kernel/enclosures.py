"""Proofs by intervals that a field has one sign on cells."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..formulas.field import Loops
from .interval_numbers import TINY


@dataclass(frozen=True, eq=False)
class Enclosures:
    """Implementation of `formulas.field.Cells` for scene trees.

    Attributes
    ----------
    loops
        Compiled loop `loops.enclosures`.
    dtype
        Type of the bounds.
    """

    loops: Loops
    dtype: np.dtype

    def __call__(self, centres: np.ndarray, half: float) -> tuple[np.ndarray, np.ndarray]:
        """See `formulas.field.Cells`."""
        low, high = self.bounds(centres, half)
        tiny = TINY[self.dtype.itemsize * 8]
        return low > tiny, high < -tiny

    def bounds(self, centres: np.ndarray, half: float) -> tuple[np.ndarray, np.ndarray]:
        """Enclose the values of the field on cells.

        Parameters
        ----------
        centres
            Centres of the cells, [3, n], scene units.
        half
            Half the size of the cells, scene units.

        Returns
        -------
        (ndarray, ndarray)
            Lower and upper bounds, [n].
        """
        count, width = centres.shape[1], self.loops.width
        padded = -(-max(count, 1) // width) * width
        rows, out = np.zeros((3, padded), self.dtype), np.empty((2, padded), self.dtype)
        rows[:, :count] = centres
        # Centres are rounded to the type of the rows.
        frame = np.array([half + np.finfo(self.dtype).eps * abs(centres).max(initial=0)], self.dtype)
        self.loops.runs["enclosures"](np.nextafter(frame, self.dtype.type(np.inf)), rows, out)
        return out[0, :count], out[1, :count]
