"""Thickness statistics: percentiles and a histogram."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..common.arrays import weighted_quantiles

BINS = 0.05 * np.arange(41)
"""Bin edges of the histogram, mm; the last bin includes everything thicker."""


@dataclass(frozen=True)
class Widths:
    """Statistics of the widths of walls or gaps, mm."""

    smallest: float  # minimum, first percentile and median
    thinnest_hundredth: float
    median: float
    # weight in each bin: pixels of medial axes in layers, mm^2 of surface in solids
    counts: tuple[float, ...]
    edges: tuple[float, ...] = tuple(round(float(b), 3) for b in BINS)  # edges of the bins


def widths_of(values: np.ndarray, weights: np.ndarray | None = None) -> Widths | None:
    """Summarise widths.

    `values`: float64 [n], mm; `weights`: float64 [n], optional.
    """
    if not len(values):
        return None
    weight = np.ones(len(values)) if weights is None else weights
    low, hundredth, middle = weighted_quantiles(values, weight, 0, 0.01, 0.5)
    counts = np.histogram(np.minimum(values, BINS[-1] - 1e-9), BINS, weights=weights)[0]
    return Widths(low, hundredth, middle, tuple(counts.tolist()))
