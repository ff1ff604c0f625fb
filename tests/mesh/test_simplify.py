"""Fewer triangles within a tolerance: against exact truth, and the proof against what it must refuse."""

from __future__ import annotations

import threading

import numpy as np
import pytest

from fracslice.errors import Cancelled, MeshError
from fracslice.formulas import mandelbulb, menger
from fracslice.mesh import Mesh
from fracslice.mesh.check import check
from fracslice.mesh.extract import contour
from fracslice.mesh.nearest import distance_bounds, sampled_distances
from fracslice.mesh.rounding import rounded
from fracslice.mesh.simplify import simplify
from fracslice.volume import plan, sample_scene
from fracslice.work import Work

from . import shapes


def fine(root, resolution: float) -> Mesh:
    planned = plan(root, resolution)
    return rounded(contour(planned.root, sample_scene(planned)).scaled(10))


def divided(mesh: Mesh, times: int) -> Mesh:
    import trimesh

    vertices, faces = mesh.vertices, mesh.triangles
    for _ in range(times):
        vertices, faces = trimesh.remesh.subdivide(vertices, faces)
    return Mesh(np.array(vertices), np.array(faces, np.int32))


def test_a_sphere_keeps_its_tolerance_to_the_sphere():
    ball = shapes.sphere(level=4)
    sagitta = 10 - np.linalg.norm(ball.corners.mean(axis=1), axis=1).min()
    few, done = simplify(ball, 0.2)
    assert len(few.triangles) < len(ball.triangles) / 10
    assert check(few).printable
    assert 0 < done.bound_mm <= 0.2
    assert np.abs(np.linalg.norm(few.vertices, axis=1) - 10).max() < 1e-5, "the original's own vertices"
    middles = np.linalg.norm(few.corners.mean(axis=1), axis=1)
    assert (10 - middles).max() < 0.2 + sagitta


def test_a_cube_is_left_with_twelve_triangles():
    few, done = simplify(divided(shapes.cube(), 4), 0.01)
    assert len(few.triangles) == 12
    assert few.volume == pytest.approx(1000, rel=1e-12)
    assert done.back_mm < 1e-12


def test_a_menger_sponge_keeps_its_edges_and_its_closed_forms():
    sponge = fine(menger(level=2), 41.3)
    few, _ = simplify(sponge, 0.02)
    scale = float(sponge.size.max()) / 2
    cells = few.vertices / scale * 9
    assert (np.abs(cells - np.round(cells)) < 1e-5).all(axis=1).mean() > 0.95, "corners of its cells are left"
    assert few.volume == pytest.approx((2 * scale) ** 3 * (20 / 27) ** 2, rel=1e-6)
    assert few.area == pytest.approx(scale**2 * (8 * (20 / 9) ** 2 + 16 * (8 / 9) ** 2), rel=1e-6)
    assert len(few.triangles) < len(sponge.triangles) / 20
    assert check(few).printable and check(few).genus == check(sponge).genus


def test_a_rough_fractal_stays_a_solid_without_crossings():
    bulb = fine(mandelbulb(iterations=5), 48)
    few, done = simplify(bulb, 0.1)
    assert len(few.triangles) < 0.8 * len(bulb.triangles)
    before, after = check(bulb), check(few)
    assert (after.problems, after.genus, after.components) == ((), before.genus, before.components)
    assert distance_bounds(bulb, few, 0.1, Work()).max() == pytest.approx(done.bound_mm, rel=1e-3)
    assert sampled_distances(few, bulb, 0.05, Work()).max() < 0.15, "the other way: near it, not promised"


def test_the_bound_is_no_less_than_the_truth_and_refuses_what_is_too_far():
    cube, ball = shapes.cube(2, (-1, -1, -1)), shapes.sphere(1, level=4)
    corner = np.sqrt(3) - 1
    bounds = distance_bounds(cube, ball, 0.75, Work())
    assert corner - 1e-9 <= bounds.max() <= 0.75
    assert np.isinf(distance_bounds(cube, ball, 0.73, Work())).any()
    assert sampled_distances(cube, ball, 0.1, Work()).max() == pytest.approx(corner, abs=0.01)


def test_the_bound_sees_what_lies_between_the_vertices():
    flat = Mesh(np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], float), np.array([[0, 1, 2]], np.int32))
    bent = Mesh(
        np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0.3, 0.3, 0.2]], float),
        np.array([[0, 1, 3], [1, 2, 3], [2, 0, 3]], np.int32),
    )
    assert np.isinf(distance_bounds(flat, bent, 0.05, Work())).all(), "its corners are all on the other"


def test_the_result_is_the_same_for_any_number_of_threads():
    one, two = (simplify(shapes.torus(), 0.1, Work(threads=n))[0] for n in (1, 2))
    assert np.array_equal(one.vertices, two.vertices) and np.array_equal(one.triangles, two.triangles)


@pytest.mark.parametrize("tolerance", [0, -1, float("nan"), float("inf")])
def test_a_tolerance_that_cannot_be(tolerance):
    with pytest.raises(MeshError, match="expected a finite number above zero"):
        simplify(shapes.cube(), tolerance)


def test_a_mesh_with_a_hole_is_refused_and_work_can_be_cancelled():
    with pytest.raises(MeshError, match="closed, oriented manifold"):
        simplify(shapes.without(shapes.sphere(), 3), 0.1)
    stop = threading.Event()
    stop.set()
    with pytest.raises(Cancelled):
        simplify(shapes.sphere(), 0.1, Work(cancel=stop))
