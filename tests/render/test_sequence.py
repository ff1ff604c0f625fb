"""Samples: every elementary interval holds its share, in every pixel."""

from __future__ import annotations

import numpy as np
import pytest

from fracslice.render.sobol import point
from fracslice.render.units.random import centred, sample


def points(pixel: int, count: int, dimensions: int = 2, first: object = sample) -> np.ndarray:
    draw = [first, first, *[sample] * dimensions][:dimensions]
    return np.array(
        [
            [f(int(a), pixel, d) for d, (f, a) in enumerate(zip(draw, point(i, dimensions), strict=True))]
            for i in range(count)
        ]
    )  # type: ignore[operator]


@pytest.mark.parametrize("first", [sample, centred])
@pytest.mark.parametrize("pixel", [0, 77, 65536 * 300 + 5])
def test_the_first_two_dimensions_are_a_net(pixel: int, first: object) -> None:
    p = points(pixel, 64, first=first)
    for a in range(7):
        cells = np.floor(p * [2**a, 2 ** (6 - a)]).astype(int)
        assert len({tuple(c) for c in cells}) == 64


def test_each_dimension_is_stratified() -> None:
    p = points(9, 32, 20)
    for d in range(20):
        assert sorted(np.floor(32 * p[:, d]).astype(int)) == list(range(32))


def test_the_first_point_is_the_middle_of_every_pixel() -> None:
    assert all(centred(int(point(0, 1)[0]), pixel, 0) == 0.5 for pixel in range(50))


def test_neighbours_are_not_correlated() -> None:
    values = np.array([[sample(int(point(i, 1)[0]), pixel, 0) for i in range(16)] for pixel in range(200)])
    first, second = values[:-1].ravel() - 0.5, values[1:].ravel() - 0.5
    assert abs(np.mean(first * second)) < 0.006
    assert values.min() >= 0
    assert values.max() < 1
