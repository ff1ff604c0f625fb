"""Boxes around the inside of a field, proved by intervals."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ..formulas.box import Triple
from .interval_numbers import ARRAYS
from .intervals import Interval

FIRST, LEVELS, MOST = 16, 8, 1 << 12
"""Cells along each axis of the first level; levels of cells; cells of a level from which none is split."""

Corners = np.ndarray
"""Least or greatest corners of cells, [3, n]."""


def undecided(
    wanted: Callable[[Corners, Corners], np.ndarray],
    proved: Callable[[Corners, Corners], np.ndarray],
    radius: float,
    most: int = MOST,
    levels: int = LEVELS,
) -> tuple[Corners, Corners]:
    """Split cells of a cube around the origin in eight until they are proved, or many, or small.

    Parameters
    ----------
    wanted
        Function of cells that returns a mask of those to be proved.
    proved
        Function of cells that returns a mask of those that are.
    radius
        Half the size of the cube.
    most
        Cells of a level from which none is split.
    levels
        Levels of cells.

    Returns
    -------
    (ndarray, ndarray)
        Corners of the wanted cells that are not proved, [3, n]. Faces of cells in coordinate planes are
        exactly 0.
    """
    size, eighths = 2.0 * radius / FIRST, np.indices((2, 2, 2)).reshape(3, 1, 8)
    places = np.indices((FIRST,) * 3).reshape(3, -1) - FIRST // 2
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
    box = np.array(half)

    def wanted(lo: Corners, hi: Corners) -> np.ndarray:
        outside: np.ndarray = (np.maximum(-lo, hi) > box[:, None]).any(0)
        return outside

    def proved(lo: Corners, hi: Corners) -> np.ndarray:
        low = field(*(Interval(a, b, ARRAYS).outward() for a, b in zip(lo, hi, strict=True))).lo
        positive: np.ndarray = np.broadcast_to(low, lo.shape[1]) > 0
        return positive

    lo, hi = undecided(wanted, proved, radius)
    x, y, z = np.maximum(box, np.maximum(-lo, hi).max(axis=1, initial=0)).tolist()
    return x, y, z
