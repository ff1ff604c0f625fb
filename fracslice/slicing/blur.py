"""Blur of pictures over neighbouring pixels."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def blurred(image: NDArray[np.uint8], radius: int) -> NDArray[np.uint8]:
    """Mean over squares of pixels; beyond its borders the picture is black.

    Parameters
    ----------
    image : uint8 [rows, columns]
        The picture.
    radius : int
        Pixels from the middle of a square to its sides.

    Returns
    -------
    uint8 [rows, columns]
        The means, rounded to the nearest.
    """
    side = 2 * radius + 1
    sums = np.pad(image, ((radius + 1, radius), (radius + 1, radius))).astype(np.uint32)
    for axis in (0, 1):
        sums = np.cumsum(sums, axis, out=sums)
    means = sums[side:, side:] - sums[:-side, side:] - sums[side:, :-side] + sums[:-side, :-side]
    return ((means + side * side // 2) // (side * side)).astype(np.uint8)
