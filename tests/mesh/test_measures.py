"""Area, volume, bounds and what rounding turns over, against NumPy."""

from __future__ import annotations

import numpy as np
import pytest

from fracslice._native import bounds, turned
from fracslice.errors import MeshError
from fracslice.mesh import Mesh
from fracslice.mesh.cleaning import place_and_round

pytestmark = pytest.mark.once

RNG = np.random.default_rng(5)
SOUP = Mesh(RNG.normal(size=(9000, 3)), RNG.integers(0, 9000, (40000, 3)).astype(np.int32))
"""More than two blocks of triangles, some of them without area."""


def normals(vertices: np.ndarray) -> np.ndarray:
    a, b, c = (vertices[SOUP.triangles[:, k]] for k in range(3))
    return np.cross(b - a, c - a)


def test_measures() -> None:
    n, tips = normals(SOUP.vertices), SOUP.vertices[SOUP.triangles[:, 0]]
    sizes, point = SOUP.sizes(2), SOUP.vertices[SOUP.vertices[:, 0].argmin()]
    assert SOUP.area == sizes.areas[0] == pytest.approx(np.linalg.norm(n, axis=1).sum() / 2, rel=1e-12)
    assert SOUP.volume == sizes.volumes[0] == pytest.approx(((tips - point) * n).sum() / 6, rel=1e-9)
    assert sizes.flat[0] == (np.linalg.norm(n, axis=1) == 0).sum() > 0


def test_bounds() -> None:
    low, high = bounds(SOUP.vertices)
    assert (np.array([low, high]) == [SOUP.vertices.min(0), SOUP.vertices.max(0)]).all()
    with pytest.raises(ValueError, match="no points"):
        bounds(np.empty((0, 3)))


def test_turned() -> None:
    frame = 0.5, (2.0**24, 0.0, 1.0), 0.8
    points = 0.5 * SOUP.vertices + frame[1]
    points[points[:, 2] < 0.8, 2] = 0
    expected = np.flatnonzero((normals(points) * normals(place_and_round(SOUP.vertices, frame))).sum(1) <= 0)
    assert 300 < len(expected) < 39000
    assert turned(SOUP.vertices, SOUP.triangles, frame).tolist() == expected.tolist()


def test_rows_have_three_numbers() -> None:
    with pytest.raises(MeshError, match=r"^vertices: expected an array .*, found one of shape \[9000, 2\]$"):
        Mesh(SOUP.vertices[:, :2], SOUP.triangles)
    with pytest.raises(MeshError, match="triangles"):
        Mesh(SOUP.vertices, SOUP.triangles.reshape(-1, 4))
