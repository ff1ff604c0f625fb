"""Where an object can be: cells of its box that are not proven empty, by branch and bound."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..formulas.algebra import length
from ..formulas.box import Box

FIRST = 8
"""Cells along the box' longest side on the first level."""

LEVELS = 12


def possible_cells(
    field: Callable[[np.ndarray], np.ndarray], lipschitz: float, box: Box, most: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The cells of a box where a field may be negative, cut in eight as long as there are at most `most`.

    field: values [n] at points [3, n], scene units. lipschitz: its bound. Returns the cells' centres [3, n],
    the values there [n], and the size of each cell [3].
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
