"""Equal corners made one vertex, bit by bit, as a slicer does with the loose triangles of an STL."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fracslice._native import weld as _weld


def weld(points: NDArray[np.float32]) -> tuple[NDArray[np.int64], NDArray[np.int32]]:
    """Find equal points: float32 [n, 3], finite, without negative zeros.

    Returns the first of each set of equal points (int64 [k], ascending) and the set of each point (int32
    [n]). O(n), by hashing. Raises ValueError for more than 2^31 points.
    """
    return _weld(points)
