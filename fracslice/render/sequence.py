"""Low-discrepancy samples: Sobol's sequence, Owen-scrambled for every pixel and dimension by itself.

Sobol 1967 with the direction numbers of Joe and Kuo 2008 ("Constructing Sobol Sequences with Better
Two-Dimensional Projections"); scrambling by a hash: Laine and Karras 2011, "Stratified Sampling for
Stochastic Transparency", with the constants of Vegdahl 2021, "Owen Scrambling Based on Dithered Blue Noise
Sampling"; why that is good: Burley 2020, "Practical Hash-based Owen Scrambling".
"""

from __future__ import annotations

import numpy as np

# Joe and Kuo's table new-joe-kuo-6: degree, coefficients, first direction numbers, for dimensions 2 and up.
_TABLE = (
    (1, 0, (1,)),
    (2, 1, (1, 3)),
    (3, 1, (1, 3, 1)),
    (3, 2, (1, 1, 1)),
    (4, 1, (1, 1, 3, 3)),
    (4, 4, (1, 3, 5, 13)),
    (5, 2, (1, 1, 5, 5, 17)),
    (5, 4, (1, 1, 5, 5, 5)),
    (5, 7, (1, 1, 7, 11, 19)),
    (5, 11, (1, 1, 5, 1, 1)),
    (5, 13, (1, 1, 1, 3, 11)),
    (5, 14, (1, 3, 5, 5, 31)),
    (6, 1, (1, 3, 3, 9, 7, 49)),
    (6, 13, (1, 1, 1, 15, 21, 21)),
    (6, 16, (1, 3, 1, 13, 27, 49)),
)
DIMENSIONS = 1 + len(_TABLE)
MASK = 0xFFFFFFFF


def _directions(dimension: int) -> list[int]:
    """32 direction numbers, the first for the lowest bit of the index."""
    if dimension == 0:
        return [1 << (31 - i) for i in range(32)]
    degree, coefficients, first = _TABLE[dimension - 1]
    numbers = [m << (31 - i) for i, m in enumerate(first)]
    for i in range(degree, 32):
        v = numbers[i - degree] ^ (numbers[i - degree] >> degree)
        for k in range(1, degree):
            v ^= ((coefficients >> (degree - 1 - k)) & 1) * numbers[i - k]
        numbers.append(v)
    return numbers


_DIRECTIONS = [_directions(d) for d in range(DIMENSIONS)]


def point(index: int, dimensions: int) -> np.ndarray:
    """Sobol's point `index` as 32-bit whole numbers, int32 bit patterns [dimensions], each with its bits
    REVERSED.

    Dimensions beyond the table's repeat it: their scrambling is another.
    """
    reversed_bits = []
    for d in range(dimensions):
        value = 0
        for bit, v in enumerate(_DIRECTIONS[d % DIMENSIONS]):
            value ^= v * ((index >> bit) & 1)
        reversed_bits.append(int(f"{value:032b}"[::-1], 2))
    return np.array(reversed_bits, np.uint32).view(np.int32)
