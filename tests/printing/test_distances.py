"""Distances from samples: as right as sweeping all samples, on both sides, for fewer of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fracslice.formulas import Node, mandelbulb, sphere
from fracslice.printing.distances import distances
from fracslice.printing.samples import Samples, lengths
from fracslice.printing.walls import walls
from fracslice.volume import Bricks, plan, sample_scene
from fracslice.volume.grid import from_grid, to_grid
from fracslice.work import Work


def sampled(root: Node, resolution: float) -> Bricks:
    return sample_scene(plan(root, resolution))


def test_distances_of_a_sphere() -> None:
    """Of values that are none, but for their sign and for where they are zero."""
    bricks = sampled(sphere(), 48)
    bent = replace(bricks, values=bricks.values * (2 + np.sign(bricks.values)))
    found, h = distances(bent, 4 * bricks.voxel, 2 * bricks.voxel).values, bricks.voxel
    assert (np.sign(found) == np.sign(bricks.values)).all()
    assert (found.min(), found.max()) == (pytest.approx(-4 * h), pytest.approx(2 * h))
    within = np.clip(bricks.values, -4 * h, 2 * h)
    assert np.abs(found - within).max() < 0.6 * h


def test_walls_of_a_fractal_are_as_swept() -> None:
    bricks, root = sampled(mandelbulb(iterations=5), 64), mandelbulb(iterations=5)
    limit = 6 * bricks.voxel
    swept = Samples(from_grid(to_grid(bricks).redistance()))
    near = lengths(bricks, root.bounds, limit)
    found = near.bricks.values
    reach = np.abs(found).max()
    assert reach == pytest.approx(limit / 2 + bricks.voxel)
    close = np.abs(swept.bricks.values) < reach - bricks.voxel / 2
    assert np.abs(found - swept.bricks.values)[close].max() < 0.05 * bricks.voxel
    widths = [walls(one, limit, Work()).width for one in (near, swept)]
    assert len(widths[0]) == pytest.approx(len(widths[1]), rel=5e-3)
    assert np.quantile(widths[0], (0.1, 0.5, 0.9)) == pytest.approx(
        np.quantile(widths[1], (0.1, 0.5, 0.9)), abs=0.02 * bricks.voxel
    )
