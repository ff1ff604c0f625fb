"""Samples: every elementary interval holds its share, in every pixel."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest

from fracslice.rendering.accumulator import DIMENSIONS
from fracslice.rendering.accumulator import points as sequence
from fracslice.rendering.units.camera import centred, sample

pytestmark = pytest.mark.once


def points(pixel: int, count: int, dimensions: int = 2, first: object = sample) -> np.ndarray:
    draw = [first, first, *[sample] * dimensions][:dimensions]
    return np.array(
        [
            [f(int(a), pixel, d) for d, (f, a) in enumerate(zip(draw, row, strict=True))]
            for row in sequence(count, dimensions)
        ]
    )  # type: ignore[operator]


@pytest.mark.parametrize("first", [sample, centred])
@pytest.mark.parametrize("pixel", [0, 77, 65536 * 300 + 5])
@pytest.mark.parametrize("pair", range(DIMENSIONS // 2))
def test_each_pair_of_dimensions_is_a_net(pixel: int, first: object, pair: int) -> None:
    p = points(pixel, 64, DIMENSIONS, first=first)[:, 2 * pair : 2 * pair + 2]
    for a in range(7):
        cells = np.floor(p * [2**a, 2 ** (6 - a)]).astype(int)
        assert len({tuple(c) for c in cells}) == 64


def test_any_two_dimensions_are_a_net_in_base_16() -> None:
    p = np.floor(points(3, 256, DIMENSIONS) * 16).astype(int)
    for a, b in combinations(range(DIMENSIONS), 2):
        assert len(set(zip(p[:, a], p[:, b], strict=True))) == 256


def test_a_longer_table_begins_with_the_shorter() -> None:
    assert (sequence(1000, 20)[:37, :18] == sequence(37, 18)).all()


def test_each_dimension_is_stratified() -> None:
    p = points(9, 32, 20)
    for d in range(20):
        assert sorted(np.floor(32 * p[:, d]).astype(int)) == list(range(32))


def test_the_first_point_is_the_middle_of_every_pixel() -> None:
    assert all(centred(int(sequence(1, 1)[0, 0]), pixel, 0) == 0.5 for pixel in range(50))


def test_neighbours_are_not_correlated() -> None:
    values = np.array([[sample(int(a), pixel, 0) for a in sequence(16, 1)[:, 0]] for pixel in range(200)])
    first, second = values[:-1].ravel() - 0.5, values[1:].ravel() - 0.5
    assert abs(np.mean(first * second)) < 0.006
    assert values.min() >= 0
    assert values.max() < 1
