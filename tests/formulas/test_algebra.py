"""Small matrices: exact where they can be, right elsewhere, and the same bits on every processor."""

from __future__ import annotations

import numpy as np
import pytest

from fracslice.common import arrays

RNG = np.random.default_rng(3)
MATRICES = [RNG.normal(size=(3, 3)) * 10.0 ** RNG.integers(-6, 7, size=(3, 1)) for _ in range(50)]


@pytest.mark.parametrize("matrix", MATRICES)
def test_inverse(matrix: np.ndarray) -> None:
    stretch = np.linalg.svd(matrix, compute_uv=False)
    off = np.abs(arrays.product(arrays.inverse(matrix), matrix) - np.eye(3)).max()
    assert off < 4e-15 * stretch[0] / stretch[-1]


def test_what_only_scales_is_inverted_exactly() -> None:
    assert (arrays.inverse(np.diag([0.4, 3, 1e-15])) == np.diag([1 / 0.4, 1 / 3, 1 / 1e-15])).all()


@pytest.mark.parametrize("matrix", MATRICES)
def test_stretches_are_the_singular_values(matrix: np.ndarray) -> None:
    expected = np.linalg.svd(matrix, compute_uv=False)
    np.testing.assert_allclose(arrays.stretches(matrix), expected, rtol=1e-13, atol=1e-15 * expected[0])


def test_stretches_of_what_flattens_space_are_zero() -> None:
    assert arrays.stretches(np.array([[1.0, 1, 0], [1, 1, 0], [0, 0, 2]]))[-1] < 1e-15


def test_products_of_matrices_and_vectors() -> None:
    a, b = MATRICES[:2]
    np.testing.assert_allclose(arrays.product(a, b), a @ b, rtol=1e-12, atol=1e-12 * np.abs(a @ b).max())
    np.testing.assert_allclose(arrays.product(a, b[0]), a @ b[0], rtol=1e-12, atol=1e-9)
