"""Thicknesses as numbers and as a histogram."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

BINS = 0.05 * np.arange(41)
"""Edges of the histogram's bins, mm; what is thicker is in the last one."""


@dataclass(frozen=True)
class Widths:
    """Of walls or gaps in mm: the smallest, the thinnest hundredth, the median; and how much is in each bin,
    whose edges `edges` are: pixels of middle lines in layers, mm^2 of surface in space.
    """

    smallest: float
    thinnest_hundredth: float
    median: float
    counts: tuple[float, ...]
    edges: tuple[float, ...] = tuple(round(float(b), 3) for b in BINS)


def widths_of(values: np.ndarray, weights: np.ndarray | None = None) -> Widths | None:
    """The summary of widths in mm, float64 [n], each with a weight; None if there are none."""
    if not len(values):
        return None
    weight = np.ones(len(values)) if weights is None else weights
    order = np.argsort(values, kind="stable")
    upto = np.cumsum(weight[order])
    at = np.searchsorted(upto, np.array([0, 0.01, 0.5]) * upto[-1])
    low, hundredth, middle = values[order][np.minimum(at, len(values) - 1)].tolist()
    counts = np.histogram(np.minimum(values, BINS[-1] - 1e-9), BINS, weights=weights)[0]
    return Widths(low, hundredth, middle, tuple(counts.tolist()))
