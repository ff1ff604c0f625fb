"""Balls and struts as samples, held against the distance to each of them."""

from __future__ import annotations

import numpy as np
import pytest

from fracslice.fields.cpu import compile_scene
from fracslice.formulas import sphere
from fracslice.printing.bridging import capsules
from fracslice.printing.walls import positions
from fracslice.volume import Bricks, Lattice, sample
from tests.examples import stamped

pytestmark = pytest.mark.once

VOXEL = 0.05
LIKE = sample(
    compile_scene(sphere()), sphere().bounds, Lattice.around(sphere().bounds.box.grown(VOXEL), VOXEL)
)


def distance(start: np.ndarray, end: np.ndarray, points: np.ndarray) -> np.ndarray:
    """To the nearest middle line."""
    least = np.full(len(points), np.inf)
    for a, way in zip(start, end - start, strict=True):
        t = np.clip((points - a) @ way / max(way @ way, 1e-30), 0, 1)
        least = np.minimum(least, np.linalg.norm(points - a - t[:, None] * way, axis=1))
    return least


def on_sphere(radius: float, count: int) -> np.ndarray:
    directions = np.random.default_rng(0).normal(size=(count, 3))
    return np.asarray(radius * directions / np.linalg.norm(directions, axis=1)[:, None])


@pytest.mark.parametrize(
    ("start", "end"),
    [
        (on_sphere(0.5, 4000), on_sphere(0.5, 4000)),
        (on_sphere(0.4, 3000), on_sphere(0.5, 3000)),
        (on_sphere(0.9, 12), -np.roll(on_sphere(0.9, 12), 5, 0)),
        (np.zeros((1, 3)), np.zeros((1, 3))),
    ],
    ids=["ball", "short", "long", "one"],
)
@pytest.mark.parametrize("radius", stamped([0.7, 3.0], [0.7]))
def test_every_sample_knows_the_nearest_stroke(start: np.ndarray, end: np.ndarray, radius: float) -> None:
    """Within a thousandth of a voxel on average and a tenth anywhere, beside the surface."""
    made = capsules(start, end, radius * VOXEL, LIKE).bricks
    rows, offsets = np.nonzero(np.abs(made.values) < 0.99 * VOXEL)
    points = np.array(made.origin) + VOXEL * positions(made, rows, offsets)
    error = (made.values[rows, offsets] - distance(start, end, points)) / VOXEL + radius
    assert len(error) > 10
    assert np.abs(error).mean() < 1e-3 and error.min() > -1e-4 and error.max() < 0.1
    assert surrounded(made)


@pytest.mark.parametrize("radius", stamped([1.3, 3.0], [1.3]))
def test_no_stroke_is_thinner_between_samples(radius: float) -> None:
    """Interpolated distances made it thinner by up to a tenth of a voxel."""
    start = on_sphere(0.5, 300)
    points = (start + radius * VOXEL * on_sphere(1.0, 300))[:, :, None] + 0.3 * VOXEL * on_sphere(1.0, 300).T
    points = points.transpose(0, 2, 1).reshape(-1, 3)
    sampled = capsules(start, start, radius * VOXEL, LIKE).points(*points.T)
    error = (sampled - distance(start, start, points)) / VOXEL + radius
    assert error.max() < 1e-3 and np.median(error) > -0.05


def surrounded(made: Bricks) -> bool:
    """No sample at the rim of what is sampled is inside."""
    whole = np.pad(made.index, 1, constant_values=-1)
    x, y, z = (made.ijk >> 3).T + 1
    values = made.values.reshape(-1, 8, 8, 8)
    return all(
        (np.take(values, face, axis + 1)[whole[beside] < 0] > 0).all()
        for axis in range(3)
        for face, step in ((0, -1), (7, 1))
        for beside in [tuple(c + step * (k == axis) for k, c in enumerate((x, y, z)))]
    )
