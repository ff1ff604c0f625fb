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


def weighted_quantiles(values: np.ndarray, weights: np.ndarray, *shares: float) -> list[float]:
    """Return values below which these shares of the weight lie.

    Parameters
    ----------
    values : ndarray
        Values; at least one.
    weights : ndarray
        Their weights.
    *shares : float
        Shares, 0 to 1.
    """
    order = np.argsort(values, kind="stable")
    upto = np.cumsum(weights[order])
    at = np.searchsorted(upto, np.array(shares) * upto[-1])
    quantiles: list[float] = values[order][np.minimum(at, len(values) - 1)].tolist()
    return quantiles
