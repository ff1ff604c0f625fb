"""Quantiles without NumPy's masked arrays, whose import takes longer than most of them."""

from __future__ import annotations

import math

import numpy as np


def quantile(values: np.ndarray, share: float) -> float:
    """Return a quantile, interpolated linearly between neighbours in rank.

    Parameters
    ----------
    values : ndarray
        Values; at least one.
    share : float
        Share of the values below it, 0 to 1.

    Returns
    -------
    float
        Quantile; NaN if a value is NaN.
    """
    rank = (values.size - 1) * share
    low = min(math.floor(rank), max(values.size - 2, 0))
    high = min(low + 1, values.size - 1)
    ordered = np.partition(values, [low, high, values.size - 1], axis=None)
    if math.isnan(ordered[-1]):
        return math.nan
    return float(ordered[low] + (ordered[high] - ordered[low]) * (rank - low))
