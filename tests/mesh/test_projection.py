"""Vertices brought to the surface, and the measure of how near they are."""

from __future__ import annotations

import numpy as np
import pytest

from fracslice._native import trust_regions
from fracslice.fields.cpu import compile_scene
from fracslice.formulas import Node, box, mandelbulb, sphere, transform, union
from fracslice.mesh.contouring import project
from fracslice.mesh.fit import surface_error

pytestmark = pytest.mark.once


def projected(
    root: Node,
    points: np.ndarray,
    low: np.ndarray,
    high: np.ndarray,
    *ends: np.ndarray,
    middle: np.ndarray | None = None,
) -> np.ndarray:
    """ends: for each point one inside and one outside."""

    def trust_regions(which: np.ndarray, inside: np.ndarray) -> np.ndarray:
        none = np.full((3, len(which)), np.nan)
        other = np.where(inside, ends[1][which].T, ends[0][which].T) if ends else none
        return np.stack([low[which].T, high[which].T, other, none if middle is None else middle[which].T])

    moved = points.copy()
    project(root, moved, trust_regions, 0.1)
    return moved


def test_points_reach_the_surface_and_stay_in_their_boxes() -> None:
    rng = np.random.default_rng(0)
    points = rng.normal(size=(500, 3))
    points *= 1.02 / np.linalg.norm(points, axis=1, keepdims=True)
    low, high = points - 0.05, points + 0.05
    there = projected(sphere(), points, low, high)
    assert np.abs(np.linalg.norm(there, axis=1) - 1).max() < 1e-9
    assert (there >= low).all() and (there <= high).all()


def test_a_flat_box_holds_its_coordinate_and_a_narrow_one_its_point() -> None:
    points = np.array([[0.9, 0.3, 0.2], [0.9, 0.0, 0.0]])
    region = np.array([0, 0.3, 0.3])
    low, high = points - region, points + region
    high[1] = points[1] + np.array([0.01, 0, 0])
    there = projected(sphere(), points, low, high)
    assert there[0, 0] == 0.9 and abs(np.linalg.norm(there[0]) - 1) < 1e-6
    assert np.allclose(there[1], [0.91, 0, 0], atol=1e-5)


def test_where_no_gradient_leads_a_point_is_drawn_to_the_other_sign() -> None:
    """Next to a Mandelbulb, in boxes of a tenth with an end of either sign: whatever is between."""
    root, rng = mandelbulb(iterations=8), np.random.default_rng(0)
    kernel = compile_scene(root, "float64")
    ends = rng.uniform(-1, 1, (2, 40000, 3))
    ends[1] = ends[0] + rng.uniform(-0.1, 0.1, (40000, 3))
    signs = kernel.points(*np.moveaxis(ends, 2, 0)) < 0
    inside, outside = ends[0, signs[0] & ~signs[1]], ends[1, signs[0] & ~signs[1]]
    low, high = np.minimum(inside, outside), np.maximum(inside, outside)
    there = projected(root, rng.uniform(low, high), low, high, inside, outside)
    assert len(there) > 500 and (there >= low).all() and (there <= high).all()
    assert np.abs(kernel.points(*there.T)).max() < 1e-6


def test_where_the_field_is_smooth_a_point_moves_towards_the_middle() -> None:
    """0.3 voxels beyond a sphere of ten; the middle is inside, or beyond too, where there is no root."""
    points = np.full((2, 3), [1.03, 0, 0])
    middle = np.array([[0.95, 0.04, 0], [1.03, 0.04, 0]])
    there = projected(sphere(), points, points - 0.1, points + 0.1, middle=middle)
    assert np.abs(np.linalg.norm(there, axis=1) - 1).max() < 1e-9
    assert there[0, 1] == pytest.approx((1.03 - there[0, 0]) / 2, abs=1e-9)
    assert np.allclose(there[1], [1, 0, 0], atol=1e-9)


def test_beside_an_edge_a_point_does_not_slide_along_a_face() -> None:
    """A hundredth of a voxel beyond it; the middle lies below one of the faces."""
    points, middle = np.array([[0.501, 0.501, 0.1]]), np.array([[0.4, 0.499, 0.1]])
    there = projected(box(), points, points - 0.1, points + 0.1, middle=middle)
    assert np.abs(there - [0.5, 0.5, 0.1]).max() < 1e-6


def test_what_lies_on_the_surface_stays() -> None:
    corner = np.array([[0.5, 0.5, 0.5]])
    assert (projected(box(), corner, corner - 0.1, corner + 0.1) == corner).all()


def test_surface_error_is_a_distance_also_at_an_edge() -> None:
    points = np.array([[0.51, 0.0, 0.0], [0.5 - 1e-9, 0.5 - 1e-9, 0.1], [0.0, 0.47, 0.0]])
    assert np.allclose(surface_error(box(), points, 0.1), [0.01, 0.0, 0.03], atol=2e-5)


def test_surface_error_is_a_distance_also_where_solids_touch_in_an_edge() -> None:
    """There every axis lies in the surface."""
    halves = [transform(box(), translate=(d, d, 0)) for d in (-0.5, 0.5)]
    points = np.array([[1e-9, -1e-9, 0.1], [0.003, 0.003, -0.2]])
    assert (surface_error(union(*halves), points, 0.1) < [2e-9, 0.004]).all()


def test_trust_regions_are_the_interiors_of_cells_and_faces() -> None:
    """Against NumPy: of vertices in cells, and of some in faces."""
    rng, origin, voxel, margin = np.random.default_rng(4), np.array([0.3, -1.0, 2.0]), 0.1, 0.01
    grid = rng.integers(0, 9, (500, 3)) + rng.uniform(0.1, 0.9, (500, 3))
    face = rng.integers(0, 4, 500)
    grid[face < 3, face[face < 3]] = np.floor(grid[face < 3, face[face < 3]])
    features, cases = origin + voxel * grid, rng.integers(1, 255, 500).astype(np.uint8)
    to_means = rng.normal(0, 0.2, (500, 3)).astype(np.float32)
    which, inside = rng.permutation(500)[:200], rng.random(200) < 0.5
    result = trust_regions(features, cases, to_means, which, inside, tuple(origin.tolist()), voxel, margin)
    flat = np.arange(3) == face[:, None]
    cell = np.floor(np.round(grid, 9))
    expected = origin + voxel * (cell + np.where(flat, 0, margin))
    assert np.allclose(result[0].T, expected[which])
    expected = origin + voxel * (cell + np.where(flat, 0, 1 - margin))
    assert np.allclose(result[1].T, expected[which])
    middle = np.clip((features + voxel * to_means)[which], result[0].T, result[1].T)
    assert np.allclose(result[3].T, middle)
    for k, row in enumerate(which):
        corner = np.round((result[2][:, k] - origin) / voxel - cell[row]).astype(int)
        corners = [c for c in np.ndindex(2, 2, 2) if face[row] == 3 or c[face[row]] == 0]
        signs = {c: bool(cases[row] >> (c[0] + 2 * c[1] + 4 * c[2]) & 1) for c in corners}
        other = [c for c in corners if signs[c] != inside[k]]
        away = [np.abs(np.array(c) - (grid[row] - cell[row] > 0.5)).sum() for c in other]
        assert not other or (tuple(corner) in other and away[other.index(tuple(corner))] == min(away))
