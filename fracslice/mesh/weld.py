# mypy: allow-untyped-defs, allow-untyped-calls, allow-untyped-decorators
"""Equal corners made one vertex, bit by bit, as a slicer does with the loose triangles of an STL.

Importing this module imports Numba.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray


def weld(points: NDArray[np.float32]) -> tuple[NDArray[np.int64], NDArray[np.int32]]:
    """Find equal points: float32 [n, 3], finite, without negative zeros.

    Returns the first of each set of equal points (int64 [k], ascending) and the set of each point (int32
    [n]).
    """
    slots = 1 << max(4, int(2 * len(points)).bit_length())
    first, labels, count = _weld(np.ascontiguousarray(points).view(np.uint32), np.full(slots, -1, np.int32))
    return first[:count], labels


@njit(cache=True, nogil=True)
def _weld(bits, table):
    """Open addressing; the table holds set numbers and has a power of two of slots."""
    first = np.empty(len(bits), np.int64)
    labels = np.empty(len(bits), np.int32)
    mask, count = np.uint64(len(table) - 1), 0
    for i in range(len(bits)):
        x, y, z = np.uint64(bits[i, 0]), np.uint64(bits[i, 1]), np.uint64(bits[i, 2])
        mixed = (
            (x * np.uint64(0x9E3779B97F4A7C15))
            ^ (y * np.uint64(0xC2B2AE3D27D4EB4F))
            ^ (z * np.uint64(0x165667B19E3779F9))
        )
        slot = (mixed ^ (mixed >> np.uint64(29))) * np.uint64(0xBF58476D1CE4E5B9)
        slot = (slot ^ (slot >> np.uint64(32))) & mask
        while True:
            found = table[slot]
            if found < 0:
                table[slot] = found = count
                first[count] = i
                count += 1
                break
            j = first[found]
            if bits[j, 0] == bits[i, 0] and bits[j, 1] == bits[i, 1] and bits[j, 2] == bits[i, 2]:
                break
            slot = (slot + np.uint64(1)) & mask
        labels[i] = found
    return first, labels, count
