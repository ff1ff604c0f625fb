"""Boxes around the inside of a field, proved by intervals."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ..formulas.box import Triple
from .intervals import ARRAYS, Interval

FIRST, LEVELS, MOST = 16, 8, 1 << 12
"""Cells along each axis of the first level; levels of cells; cells of a level from which none is split."""


def proved_half(field: Callable[..., Any], radius: float, half: Triple) -> Triple:
    """Enlarge a box around the origin until what is outside of it is proved to be empty.

    Cells that reach out of the box are split in eight until intervals prove them to be empty, or until they
    are many or small: then the box takes them in.

    Parameters
    ----------
    field
        Function of intervals of x, y and z; positive outside.
    radius
        Radius of a ball around the origin that holds the inside.
    half
        Half sizes of the box.

    Returns
    -------
    (float, float, float)
        Half sizes of the proved box.
    """
    size, box = 2.0 * radius / FIRST, np.array(half)
    cells = -radius + size * (np.indices((FIRST,) * 3).reshape(3, -1) + 0.5)
    eighths = (np.indices((2, 2, 2)).reshape(3, 1, 8) - 0.5) / 2
    for level in range(LEVELS):
        cells = cells[:, (abs(cells) + size / 2 > box[:, None]).any(0)]
        bounds = field(*(Interval(c - size / 2, c + size / 2, ARRAYS).outward() for c in cells))
        cells = cells[:, ~(np.broadcast_to(bounds.lo, cells.shape[1]) > 0)]
        if cells.shape[1] == 0 or cells.shape[1] > MOST or level == LEVELS - 1:
            break
        cells = (cells[:, :, None] + size * eighths).reshape(3, -1)
        size /= 2
    x, y, z = np.maximum(box, (abs(cells) + size / 2).max(axis=1, initial=0)).tolist()
    return x, y, z
