"""Vertices brought to the surface, and the measure of how near they are."""

from __future__ import annotations

import numpy as np

from fracslice.formulas import box, sphere
from fracslice.volume.accuracy import surface_error
from fracslice.volume.settling import settle


def test_points_reach_the_surface_and_stay_in_their_boxes() -> None:
    rng = np.random.default_rng(0)
    points = rng.normal(size=(500, 3))
    points *= 1.02 / np.linalg.norm(points, axis=1, keepdims=True)
    low, high = points - 0.05, points + 0.05
    settled = settle(sphere(), points, lambda _: (low, high), 0.1)
    assert np.abs(np.linalg.norm(settled, axis=1) - 1).max() < 1e-9
    assert (settled >= low).all() and (settled <= high).all()


def test_a_flat_box_holds_its_coordinate_and_a_narrow_one_its_point() -> None:
    points = np.array([[0.9, 0.3, 0.2], [0.9, 0.0, 0.0]])
    room = np.array([0, 0.3, 0.3])
    low, high = points - room, points + room
    high[1] = points[1] + np.array([0.01, 0, 0])
    settled = settle(sphere(), points, lambda _: (low, high), 0.1)
    assert settled[0, 0] == 0.9 and abs(np.linalg.norm(settled[0]) - 1) < 1e-6
    assert np.allclose(settled[1], [0.91, 0, 0])


def test_what_lies_on_the_surface_stays() -> None:
    corner = np.array([[0.5, 0.5, 0.5]])
    assert (settle(box(), corner, lambda p: (p - 0.1, p + 0.1), 0.1) == corner).all()


def test_surface_error_is_a_distance_also_at_an_edge() -> None:
    points = np.array([[0.51, 0.0, 0.0], [0.5 - 1e-9, 0.5 - 1e-9, 0.1], [0.0, 0.47, 0.0]])
    assert np.allclose(surface_error(box(), points, 0.1), [0.01, 0.0, 0.03], atol=2e-5)
