"""Boxes around the inside of a field: branch and bound by its Lipschitz constant, and proofs by intervals."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ..expr.intervals import ARRAYS, Interval
from .algebra import length
from .box import Box, Triple

FIRST = 8
"""Cells along the longest side of the box on the first level."""

LEVELS = 12
"""Largest number of levels."""


def possible_cells(
    field: Callable[[np.ndarray], np.ndarray], lipschitz: float, box: Box, most: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the cells of a box where a field may be negative.

    Cells are split in eight while their number stays at most `most`.

    `field`: function of points [3, n], scene units, returns values [n]; `box` in scene units. Returns
    centres float64 [3, n], scene units; values [n]; step float64 [3], scene units.
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


BOXES_A_SIDE, BOX_LEVELS, MOST = 16, 8, 1 << 12
"""Cells along each axis of the first level; levels of cells; cells of a level from which none is split."""

Corners = np.ndarray
"""Least or greatest corners of cells, [3, n]."""


def undecided_cells(
    wanted: Callable[[Corners, Corners], np.ndarray],
    proved: Callable[[Corners, Corners], np.ndarray],
    radius: float,
    most: int = MOST,
    levels: int = BOX_LEVELS,
) -> tuple[Corners, Corners]:
    """Split cells of a cube around the origin in eight until they are proved, or many, or small.

    Returns [3, n].
    """
    size, eighths = 2.0 * radius / BOXES_A_SIDE, np.indices((2, 2, 2)).reshape(3, 1, 8)
    places = np.indices((BOXES_A_SIDE,) * 3).reshape(3, -1) - BOXES_A_SIDE // 2
    for level in range(levels):
        places = places[:, wanted(size * places, size * (places + 1))]
        places = places[:, ~proved(size * places, size * (places + 1))]
        if places.shape[1] == 0 or places.shape[1] > most or level == levels - 1:
            break
        places = (2 * places[:, :, None] + eighths).reshape(3, -1)
        size /= 2
    return size * places, size * (places + 1)


def proved_half(field: Callable[..., Any], radius: float, half: Triple) -> Triple:
    """Enlarge a box around the origin until everything outside is proved to be empty.

    Cells that reach out of the box are split until intervals prove them to be empty, or until they are many
    or small: then the box takes them in.
    """
    box = np.array(half)

    def wanted(lo: Corners, hi: Corners) -> np.ndarray:
        outside: np.ndarray = (np.maximum(-lo, hi) > box[:, None]).any(0)
        return outside

    def proved(lo: Corners, hi: Corners) -> np.ndarray:
        low = field(*(Interval(a, b, ARRAYS).outward() for a, b in zip(lo, hi, strict=True))).lo
        positive: np.ndarray = np.broadcast_to(low, lo.shape[1]) > 0
        return positive

    lo, hi = undecided_cells(wanted, proved, radius)
    x, y, z = np.maximum(box, np.maximum(-lo, hi).max(axis=1, initial=0)).tolist()
    return x, y, z
