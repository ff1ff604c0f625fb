"""Quantiles as NumPy's."""

from __future__ import annotations

import numpy as np
import pytest

from fracslice.common.arrays import quantile, weighted_quantiles

pytestmark = pytest.mark.once


@pytest.mark.parametrize("count", [1, 2, 3, 1000])
@pytest.mark.parametrize("share", [0.0, 0.5, 0.9, 0.99, 1.0])
def test_a_quantile_is_numpys(count: int, share: float) -> None:
    values = np.random.default_rng(count).normal(size=count)
    assert quantile(values, share) == pytest.approx(np.quantile(values, share), rel=1e-14)
    assert np.isnan(quantile(np.append(values, np.nan), share))


def test_weighted_quantiles_are_values_by_weight() -> None:
    values, weights = np.array([3.0, 1.0, 2.0]), np.array([1.0, 1.0, 98.0])
    assert weighted_quantiles(values, weights, 0, 0.005, 0.5, 1) == [1, 1, 2, 3]
