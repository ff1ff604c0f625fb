"""Welding of bitwise equal points, as slicers weld the triangles of an STL."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fracslice._native import weld as _weld


def weld(points: NDArray[np.float32]) -> tuple[NDArray[np.int64], NDArray[np.int32]]:
    """Group equal points, in O(n), by hashing.

    Parameters
    ----------
    points : ndarray of float32, shape (n, 3)
        Finite points without negative zeros.

    Returns
    -------
    first : ndarray of int64, shape (k,)
        First point of each group, ascending.
    labels : ndarray of int32, shape (n,)
        Group of each point.

    Raises
    ------
    ValueError
        For more than 2^31 points.
    """
    return _weld(points)
