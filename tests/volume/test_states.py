"""The states of bricks, against the plain indices they stand for."""

from __future__ import annotations

import numpy as np

from fracslice.volume.states import BORDER, States

SHAPE = (3, 4, 5)


def states() -> States:
    return States.within(np.random.default_rng(2).integers(0, 4, SHAPE).astype(np.uint8))


def inner(found: States) -> np.ndarray:
    return np.flatnonzero(found.flat != BORDER)


def test_numbers_are_in_the_order_of_places() -> None:
    found = states()
    np.testing.assert_array_equal(found.places(inner(found)), np.indices(SHAPE).reshape(3, -1))
    np.testing.assert_array_equal(found.inner(found.flat).ravel(), found.flat[inner(found)])


def test_a_step_leads_to_the_brick_beside() -> None:
    found = states()
    for axis in range(3):
        for step in (-1, 1):
            moved = found.places(inner(found) + found.step(axis, step)) - found.places(inner(found))
            assert (moved == np.eye(3, dtype=int)[axis][:, None] * step).all()


def test_beside_looks_through_the_six_faces() -> None:
    found = states()
    grid = np.pad(found.inner(found.flat) == 1, 1)
    expected = np.zeros_like(grid)
    for axis in range(3):
        expected |= np.roll(grid, 1, axis) | np.roll(grid, -1, axis)
    seen = found.inner(found.beside(found.flat == 1))
    np.testing.assert_array_equal(seen, expected[1:-1, 1:-1, 1:-1])


def test_distinct() -> None:
    assert states().distinct(np.array([7, 3, 7, 90, 3])).tolist() == [3, 7, 90]
