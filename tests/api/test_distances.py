"""The field of a shape at points."""

from __future__ import annotations

import numpy as np
import pytest

from fracslice import bounds, box, mandelbulb, repeat, sphere
from fracslice.errors import SceneError
from fracslice.fields.devices import reference
from fracslice.volume import with_depths

SHAPE = (box() - sphere(0.6)).twist(40) + (0.1, 0, 0)


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_it_is_the_reference_in_the_points_own_precision(dtype: type) -> None:
    points = np.random.default_rng(1).uniform(-1, 1, (7, 11, 3)).astype(dtype)
    result = SHAPE.distance(points)
    assert (result.dtype, result.shape) == (points.dtype, (7, 11))
    limit = 1e-6 if dtype == np.float32 else 1e-13
    np.testing.assert_allclose(result, reference(SHAPE)(*np.moveaxis(points, -1, 0)), rtol=0, atol=limit)


def test_any_numbers_are_points() -> None:
    assert sphere(2).distance([3, 0, 0]) == 1.0
    assert sphere(2).distance([[3, 0, 0]] * 4).tolist() == [1.0] * 4
    assert sphere(2).distance(np.empty((0, 3))).shape == (0,)
    columns = np.asfortranarray(np.random.default_rng(2).normal(size=(100, 3)))
    assert np.array_equal(sphere().distance(columns[::2]), sphere().distance(columns[::2].copy()))


def test_many_points_are_the_same_as_few() -> None:
    points = np.random.default_rng(3).normal(size=(300_000, 3))
    assert np.array_equal(SHAPE.distance(points)[-1000:], SHAPE.distance(points[-1000:]))


def test_depths_are_those_of_the_mesh() -> None:
    points = np.random.default_rng(4).uniform(-1, 1, (200, 3))
    expected = reference(with_depths(mandelbulb()))(*points.T)
    np.testing.assert_allclose(mandelbulb().distance(points), expected, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize(
    "points", [[1, 2], np.zeros((3, 2)), 1.0, "here", [[1, 2, 3], [4, 5]], 1j * np.ones(3)]
)
def test_what_are_no_points_is_said(points: object) -> None:
    with pytest.raises(SceneError, match="points: expected"):
        sphere().distance(points)  # type: ignore[arg-type]


def test_an_endless_fractal_needs_a_depth() -> None:
    endless = repeat(mandelbulb(), period=(3, 3, 3))
    with pytest.raises(SceneError, match="<mandelbulb> iterations: expected a number"):
        endless.distance([0, 0, 0])
    assert bounds(endless, min=(-1, -1, -1), max=(1, 1, 1)).distance([0, 0, 0]) < 0
