"""What a picture in the making knows of its pixels does not depend on who computed it, nor on when."""

from __future__ import annotations

import numpy as np
import pytest

from fracslice.rendering.accumulator import CHANNELS, COUNT, GOAL
from fracslice.rendering.host_accumulator import HostAccumulator, around
from fracslice.rendering.tiles import ordered
from fracslice.scene.view import View
from fracslice.work import Work

WIDTH, HEIGHT = 37, 23


def begun(threads: int = 1) -> HostAccumulator:
    """A picture of 5 passes."""
    rng = np.random.default_rng(3)
    n = 2.0 ** rng.integers(3, 6, WIDTH * HEIGHT)
    bright = rng.beta(0.3, 0.5, n.size)
    sums = np.stack([*(n * bright * s for s in (1, 3, 0.2)), n * bright, n * bright**1.5, n, n, n], 1)
    return HostAccumulator(WIDTH, HEIGHT, sums.astype(np.float32).ravel(), 5, work=Work(threads))


def test_pixels_are_chosen_alike_by_any_number_of_threads() -> None:
    whole = begun().plan(64, 0.05)
    assert 0 < len(whole.pixels) < WIDTH * HEIGHT
    picture = begun(3)
    np.testing.assert_array_equal(picture.plan(64, 0.05).pixels, whole.pixels)
    goals, counts = picture.channels[..., GOAL], picture.counts
    assert whole.samples == (goals - counts).sum()
    assert set(np.unique(goals / counts)) == {1, 2}, "a net is doubled"


def test_every_pixel_is_in_the_order_once() -> None:
    for width, height in ((1, 1), (70, 33), (64, 32), (5, 64)):
        pixels = ordered(width, height)
        places = (pixels >> 16) * width + (pixels & 65535)
        np.testing.assert_array_equal(np.sort(places), np.arange(width * height))


def test_statistics_are_those_of_the_samples() -> None:
    rng = np.random.default_rng(1)
    bright = rng.random((16, WIDTH * HEIGHT))
    sums = np.zeros((WIDTH * HEIGHT, CHANNELS))
    sums[:, 3], sums[:, 4], sums[:, COUNT] = bright.sum(0), (bright**2).sum(0), 16
    samples, error = HostAccumulator(WIDTH, HEIGHT, sums.ravel(), 5).statistics()
    assert samples == 16
    assert error == pytest.approx(np.sqrt(bright.var(0, ddof=1).mean() / 16))


def test_an_interrupted_second_pass_shows_its_samples_and_the_grid_elsewhere() -> None:
    picture = HostAccumulator.empty(8, 8, np.dtype(np.float32))
    picture.plan(4, 0.0)
    picture.channels[::4, ::4, :6] = (2, 2, 2, 0, 0, 1)
    picture.passes = 1
    assert (picture.mean()[..., :3] == 2).all()
    picture.plan(4, 0.0)
    picture.channels[0, 1, :6] = (5, 5, 5, 0, 0, 1)
    assert picture.mean()[0, 1, 0] == 5
    assert (np.delete(picture.mean()[..., 0].ravel(), 1) == 2).all()
    assert picture.shown(View()).shape == (8, 8, 3)


def test_a_picture_of_one_pixel_gets_all_its_samples() -> None:
    picture = HostAccumulator.empty(1, 1, np.dtype(np.float32))
    for samples in (1, 1, 2, 4):
        assert picture.plan(64, 0.0).samples == samples
        picture.sums[COUNT] = picture.sums[GOAL]
        picture.passes += 1


@pytest.mark.parametrize("shape", [(5, 7), (1, 4), (3, 1)])
def test_the_largest_around_a_pixel(shape: tuple[int, int]) -> None:
    values = np.random.default_rng(0).normal(size=shape)
    slow = [
        [values[max(y - 1, 0) : y + 2, max(x - 1, 0) : x + 2].max() for x in range(shape[1])]
        for y in range(shape[0])
    ]
    np.testing.assert_array_equal(around(values), slow)
