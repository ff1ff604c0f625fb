"""The states of bricks, against the plain indices they stand for."""

from __future__ import annotations

import numpy as np
import pytest

from fracslice.common.arrays import distinct
from fracslice.volume.pruning import BORDER, States
from fracslice.work import Work

pytestmark = pytest.mark.once

SHAPE = (3, 4, 5)


def states() -> States:
    return States.within(np.random.default_rng(2).integers(0, 4, SHAPE).astype(np.uint8), Work(2))


def inner(result: States) -> np.ndarray:
    return np.flatnonzero(result.flat != BORDER)


def test_numbers_are_in_the_order_of_places() -> None:
    result = states()
    np.testing.assert_array_equal(result.places(inner(result)), np.indices(SHAPE).reshape(3, -1))
    np.testing.assert_array_equal(result.inner(result.flat, Work(1)).ravel(), result.flat[inner(result)])


def test_a_step_leads_to_the_brick_beside() -> None:
    result = states()
    for axis in range(3):
        for step in (-1, 1):
            moved = result.places(inner(result) + result.step(axis, step)) - result.places(inner(result))
            assert (moved == np.eye(3, dtype=int)[axis][:, None] * step).all()


def test_beside_looks_through_the_six_faces() -> None:
    result = states()
    grid = np.pad(result.inner(result.flat, Work(2)) == 1, 1)
    expected = np.zeros_like(grid)
    for axis in range(3):
        expected |= np.roll(grid, 1, axis) | np.roll(grid, -1, axis)
    seen = result.where(lambda part: result.beside(part, (1,)), Work(2))
    there = inner(result)
    np.testing.assert_array_equal(np.intersect1d(seen, there), there[expected[1:-1, 1:-1, 1:-1].ravel()])


def test_where_is_the_same_for_any_ranges(monkeypatch: pytest.MonkeyPatch) -> None:
    result = states()
    expected = np.flatnonzero(result.flat == 2)
    for size in (1, 7, 1 << 20):
        monkeypatch.setattr("fracslice.volume.pruning.RANGE", size)
        np.testing.assert_array_equal(result.where(lambda part: result.flat[part] == 2, Work(3)), expected)


def test_distinct() -> None:
    assert distinct(np.array([7, 3, 7, 90, 3])).tolist() == [3, 7, 90]
    assert not len(distinct(np.empty(0, int)))
