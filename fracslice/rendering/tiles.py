"""Pixels in tile order, so that the pixels of a packet are neighbours."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from ..work import chunks
from .film import BAND


@lru_cache(maxsize=4)
def band_order(width: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the pixels of a band in tile order, so that the pixels of a packet are neighbours.

    Pixels are ordered by blocks of 64 x 32 pixels; within a block, by tiles of 8 x 4.

    Parameters
    ----------
    width : int
        Picture width, pixels.

    Returns
    -------
    pixels : ndarray of int32, shape (BAND * width,)
        Pixels, ``y << 16 | x``. Read-only.
    places : ndarray of intp, shape (BAND * width,)
        Their row-major indices. Read-only.
    """
    y, x = np.divmod(np.arange(BAND * width, dtype=np.int32), np.int32(width))
    places = np.lexsort((x, y, x // 8, y // 4, x // 64))
    pixels = (y << 16 | x)[places]
    for array in (pixels, places):
        array.setflags(write=False)
    return pixels, places


def ordered(width: int, height: int) -> np.ndarray:
    """Return all pixels of a picture in tile order.

    Parameters
    ----------
    width, height : int
        Picture size, pixels.

    Returns
    -------
    ndarray of int32, shape (width * height,)
        Pixels, ``y << 16 | x``.
    """
    order, _ = band_order(width)
    bands = [order + np.int32(rows.start << 16) for rows in chunks(height, BAND)]
    pixels = np.concatenate(bands)
    return pixels[pixels >> 16 < height]
