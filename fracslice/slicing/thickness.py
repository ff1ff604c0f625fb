"""How thick walls are, and how wide gaps, in a layer."""

from __future__ import annotations

import numpy as np


def widths(image: np.ndarray, pixel: tuple[float, float]) -> tuple[np.ndarray, np.ndarray]:
    """Widths of walls and of gaps along their middle lines, mm, float64 [n] and [m]; one for each pixel of
    those lines.

    Twice the distance to the outline, where the distance has no slope (Blum 1967, "A transformation for
    extracting new descriptors of shape"): along the lines that run into right corners it has one of 0.7,
    and in a corner's last pixel it is lower than beside. The outline lies at half coverage, so a width is
    right within a pixel.
    """
    solid = image >= 128
    rows, columns = np.flatnonzero(solid.any(1)), np.flatnonzero(solid.any(0))
    if not len(rows):
        return np.empty(0), np.empty(0)
    cut = np.pad(solid[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1], 2)
    return _across(cut, pixel), _across(~cut, pixel)


def _across(region: np.ndarray, pixel: tuple[float, float]) -> np.ndarray:
    from scipy.ndimage import distance_transform_edt, maximum_filter

    unit = min(pixel)
    # The nearest pixel's middle is half a pixel beyond the outline.
    distance = np.maximum(distance_transform_edt(region, sampling=pixel[::-1]) - unit / 2, 0)
    slope = np.hypot(*np.gradient(distance, *pixel[::-1]))[1:-1, 1:-1]
    beside = maximum_filter(distance, 3)[1:-1, 1:-1]
    middle = (slope < 0.6) & region[1:-1, 1:-1] & (distance[1:-1, 1:-1] > beside - 0.4 * unit)
    # Where two pixels are in the middle, the middle lies between them.
    return np.asarray(2 * distance[1:-1, 1:-1][middle] + unit * (slope[middle] > 0.25))
