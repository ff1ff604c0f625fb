"""What a picture in the making knows of its pixels does not depend on who computed it, nor on when."""

from __future__ import annotations

import numpy as np
import pytest

from fracslice.rendering import accumulator
from fracslice.rendering.accumulator import HostAccumulator, around, places_of, squared_errors
from fracslice.rendering.cpu import ordered
from fracslice.work import Work

WIDTH, HEIGHT = 37, 23


def begun(threads: int = 1) -> HostAccumulator:
    """A picture of 70 passes."""
    rng = np.random.default_rng(3)
    n = 2.0 ** rng.integers(3, 6, WIDTH * HEIGHT) + rng.integers(0, 2, WIDTH * HEIGHT)
    bright = rng.beta(0.3, 0.5, n.size)
    sums = np.stack([*(n * bright * s for s in (1, 3, 0.2)), n * bright, n * bright**1.5, n], 1)
    return HostAccumulator(WIDTH, HEIGHT, sums.astype(np.float32), 70, work=Work(threads))


def test_pixels_are_chosen_alike_by_any_number_of_threads(monkeypatch: pytest.MonkeyPatch) -> None:
    whole, count = begun().wanted(64, 0.05)
    assert 0 < count < WIDTH * HEIGHT
    monkeypatch.setattr(accumulator, "BAND", 3)
    for threads in (1, 3):
        np.testing.assert_array_equal(begun(threads).wanted(64, 0.05)[0], whole)


def test_errors_follow_what_a_pass_changed() -> None:
    picture = begun()
    before = picture.squares().copy()
    pixels = ordered(WIDTH, HEIGHT)[5:300]

    def add(sums: np.ndarray) -> None:
        sums[places_of(pixels, WIDTH)] += [0.1, 0.2, 0.3, 0.9, 0.81, 1.0]

    picture.receive(pixels, add)
    np.testing.assert_array_equal(picture.squares().ravel(), squared_errors(picture.sums))
    assert (picture.squares() != before).sum() == len(pixels)


def test_a_pass_that_fails_leaves_the_picture_as_it_was() -> None:
    picture, same = begun(), begun()

    def add(sums: np.ndarray) -> None:
        sums[:9] += 1.0
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        picture.receive(ordered(WIDTH, HEIGHT), add)
    np.testing.assert_array_equal(picture.sums, same.sums)
    assert picture.passes == same.passes


@pytest.mark.parametrize("shape", [(5, 7), (1, 4), (3, 1)])
def test_the_largest_around_a_pixel(shape: tuple[int, int]) -> None:
    values = np.random.default_rng(0).normal(size=shape)
    slow = [
        [values[max(y - 1, 0) : y + 2, max(x - 1, 0) : x + 2].max() for x in range(shape[1])]
        for y in range(shape[0])
    ]
    np.testing.assert_array_equal(around(values), slow)
