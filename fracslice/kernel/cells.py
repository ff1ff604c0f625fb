"""Branch and bound: cells of a box that are not proven empty."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..formulas.algebra import length
from ..formulas.box import Box

FIRST = 8
"""Cells along the longest side of the box on the first level."""

LEVELS = 12
"""Largest number of levels."""


def possible_cells(
    field: Callable[[np.ndarray], np.ndarray], lipschitz: float, box: Box, most: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the cells of a box where a field may be negative.

    Cells are split in eight while their number stays at most `most`.

    Parameters
    ----------
    field
        Function of points [3, n], scene units, returns values [n].
    lipschitz
        Lipschitz bound of the field.
    box
        Box to search, scene units.
    most
        Largest number of cells.

    Returns
    -------
    centres : ndarray
        Centres of the cells, float64 [3, n], scene units.
    values : ndarray
        Field values at the centres, [n].
    step : ndarray
        Size of each cell, float64 [3], scene units.
    """
    size = np.maximum(np.array(box.size), 1e-6 * max(box.size))
    counts = np.ceil(FIRST * size / size.max()).astype(int)
    step = size / counts
    centres = (np.array(box.lo) + step * (np.indices(counts).reshape(3, -1).T + 0.5)).T
    eighths = np.indices((2, 2, 2)).reshape(3, 1, 8) / 2 - 0.25
    for level in range(LEVELS):
        values = field(centres)
        kept = ~(values > lipschitz * length(step) / 2)
        centres, values = centres[:, kept], values[kept]
        if 8 * centres.shape[1] > most or level == LEVELS - 1:
            break
        centres = (centres[:, :, None] + eighths * step[:, None, None]).reshape(3, -1)
        step = step / 2
    return centres, values, step
