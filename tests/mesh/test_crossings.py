"""Where the surface crosses grid edges, and its normals there."""

from __future__ import annotations

import numpy as np
import pytest

from fracslice._native import Cells
from fracslice.fields.devices import reference
from fracslice.formulas import box, difference, mandelbulb, sphere, torus, transform, union
from fracslice.mesh.contouring import Refiner
from fracslice.volume import Bricks, plan, sample_scene

pytestmark = pytest.mark.once


def cells_of(bricks: Bricks) -> Cells:
    signs = bricks.signs
    return Cells(signs.ijk, signs.signs, signs.index)


def segments_of(cells: Cells, bricks: Bricks) -> np.ndarray:
    """Starts of the crossed grid edges and vectors to their ends, [6, n]."""
    edges = cells.edges(0, cells.crossings_before(len(bricks.index)))
    starts = np.array(bricks.origin) + bricks.voxel * edges[:, :3]
    return np.hstack([starts, bricks.voxel * np.eye(3)[edges[:, 3]]]).T


def test_crossings_lie_on_the_surface_and_normals_point_outward() -> None:
    planned = plan(torus(radius=1, tube=0.3), 64)
    bricks = sample_scene(planned)
    cells, placement = cells_of(bricks), (bricks.origin, bricks.voxel)
    numbers = 0, cells.crossings_before(len(bricks.index))
    exact = Refiner(planned.root, cells, *placement).between(0, numbers[1])
    edges = segments_of(cells, bricks)
    points = (edges[:3] + exact.t * edges[3:]).T
    assert np.abs(reference(planned.root)(*points.T)).max() < 1e-7 * bricks.voxel
    ring = points * [1, 1, 0]
    truth = (points - ring / np.linalg.norm(ring, axis=1, keepdims=True)) / 0.3
    assert np.abs(exact.normals.T - truth).max() < 3e-5


def test_crossings_of_a_rough_surface_are_sign_changes() -> None:
    """Where float32 does not resolve the field, and float64 finds many of the roots."""
    planned = plan(mandelbulb(iterations=10), 128)
    bricks = sample_scene(planned)
    cells, placement = cells_of(bricks), (bricks.origin, bricks.voxel)
    t = Refiner(planned.root, cells, *placement).between(0, cells.crossings_before(len(bricks.index))).t
    edges = segments_of(cells, bricks)
    assert (t >= 0).all() and (t <= 1).all()
    below, above = (reference(planned.root)(*(edges[:3] + s * edges[3:])) for s in (t - 1e-4, t + 1e-4))
    assert np.mean(below * above < 0) > 0.972


def test_crossings_layer_by_layer_are_those_of_all_at_once() -> None:
    planned = plan(difference(box(), sphere(radius=0.6)), 64)
    bricks = sample_scene(planned)
    cells = cells_of(bricks)
    ends = [cells.crossings_before(k) for k in range(len(bricks.index) + 1)]
    whole, parts = (Refiner(planned.root, cells, bricks.origin, bricks.voxel) for _ in range(2))
    all_of_them = whole.between(0, ends[-1])
    for k in range(len(bricks.index)):
        for end in ends[k + 1 : k + 3][::-1]:  # as a piece ends, and the next one begins
            part = parts.between(ends[k], end)
            own = slice(part.first, part.first + len(part.t))
            assert own.start == ends[k] and own.stop >= end
            assert (part.t == all_of_them.t[own]).all()
            assert (part.normals == all_of_them.normals[:, own]).all()


@pytest.mark.parametrize("step", [1e-9, 1e-6, 1e-3])
def test_planes_almost_in_one_are_distinguished(step: float) -> None:
    """A brick's faces lie in planes less than a voxel apart and look both ways."""
    high = transform(box(size=(2, 1, 1)), translate=(0.5, 0, step))
    root = union(high, transform(box(size=(2, 1, 1)), translate=(-0.5, 0.2, 1 + step / 2)))
    planned = plan(root, 64)
    bricks = sample_scene(planned)
    cells, placement = cells_of(bricks), (bricks.origin, bricks.voxel)
    numbers = 0, cells.crossings_before(len(bricks.index))
    exact = Refiner(planned.root, cells, *placement).between(0, numbers[1])
    edges = segments_of(cells, bricks)
    field = reference(planned.root)
    assert np.abs(field(*(edges[:3] + exact.t * edges[3:]))).max() < 1e-9 * bricks.voxel
    outward = np.where(field(*edges[:3]) < 0, 1, -1)
    assert ((exact.normals * edges[3:]).sum(0) * outward > 0).all()
