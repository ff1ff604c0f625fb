"""What a picture in the making knows of its pixels does not depend on who computed it, nor on when."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from fracslice.rendering.accumulator import (
    CHANNELS,
    COARSE,
    COUNT,
    GOAL,
    SOON,
    UNIFORM,
    HostAccumulator,
    fill_gaps,
    grids,
    least_gain,
    tile_order,
)
from fracslice.rendering.units.camera import squared_error
from fracslice.scene.view import View
from fracslice.work import Work

pytestmark = pytest.mark.once

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
        pixels = tile_order(width, height)
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


def test_an_interrupted_second_pass_shows_its_samples_and_means_of_blocks_elsewhere() -> None:
    picture = HostAccumulator.empty(8, 8, np.dtype(np.float32))
    picture.plan(4, 0.0)
    picture.channels[::4, ::4, :6] = (2, 2, 2, 0, 0, 1)
    picture.passes = 1
    assert (picture.mean()[..., :3] == 2).all()
    picture.plan(4, 0.0)
    picture.channels[0, 1, :6] = (5, 5, 5, 0, 0, 1)
    assert picture.mean()[0, 1, 0] == 5
    assert (picture.mean()[1:4, :4, 0] == 3.5).all()
    assert (picture.mean()[:, 4:, 0] == 2).all() and (picture.mean()[4:, :, 0] == 2).all()
    assert picture.shown(View()).shape == (8, 8, 3)


def test_a_picture_of_one_pixel_gets_all_its_samples() -> None:
    picture = HostAccumulator.empty(1, 1, np.dtype(np.float32))
    for samples in (1, 1, 2, 4):
        assert picture.plan(64, 0.0).samples == samples
        picture.sums[COUNT] = picture.sums[GOAL]
        picture.passes += 1


def test_samples_go_where_they_take_most_from_the_error() -> None:
    """By the largest error, and error a sample, of a pixel and its neighbours."""
    picture, most, tolerance = begun(), 64, 0.05
    bright, squares, n = np.moveaxis(picture.channels[..., 3 : COUNT + 1].astype(float), -1, 0)
    error = squared_error(bright, squares, n)
    around = [
        np.pad(values, 1)[y : y + HEIGHT, x : x + WIDTH]
        for values in (error, error / n)
        for y in range(3)
        for x in range(3)
    ]
    worst, gain = np.max(around[:9], 0), np.max(around[9:], 0)
    unfinished = (n < most) & (worst > tolerance**2)
    chosen = unfinished & (gain >= least_gain(UNIFORM))
    assert 0.1 < chosen.mean() < 0.9
    picture.plan(most, tolerance)
    np.testing.assert_array_equal(picture.channels[..., GOAL], np.where(chosen, 2 * n, n))


@pytest.mark.parametrize("size", [(8192, 8192), (1920, 1080), (32768, 1), (640, 360), (1, 1)])
def test_the_first_pass_of_a_large_picture_is_short(size: tuple[int, int]) -> None:
    spacings = grids(*size)
    assert spacings[-2:] == (COARSE, 1)
    assert size[0] * size[1] / spacings[0] ** 2 <= SOON
    assert {a // b for a, b in pairwise(spacings)} == {COARSE}


def test_pixels_without_samples_show_those_around() -> None:
    """A picture that was interrupted in its first pass."""
    rng = np.random.default_rng(4)
    known = rng.random((HEIGHT, WIDTH)) < 0.05
    known[:16, :16] = False
    mean = np.where(known[..., None], rng.random((HEIGHT, WIDTH, 4)), 0).astype(np.float32)
    result = fill_gaps(mean.copy(), known, Work(2))
    np.testing.assert_array_equal(result[known], mean[known])
    for y, x in zip(*np.nonzero(~known), strict=True):
        side = next(s for s in (4, 16, 64) if known[y // s * s :, x // s * s :][:s, :s].any())
        block = np.s_[y // side * side :, x // side * side :]
        inside = mean[block][:side, :side][known[block][:side, :side]]
        assert (inside.min(0) - 1e-6 <= result[y, x]).all() and (result[y, x] <= inside.max(0) + 1e-6).all()
