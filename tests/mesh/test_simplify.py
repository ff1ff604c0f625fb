"""Fewer triangles within a tolerance: against exact truth, and the proof against what it must refuse."""

from __future__ import annotations

import threading
from itertools import product

import numpy as np
import pytest

from fracslice import make_mesh
from fracslice.errors import Cancelled, MeshError, SceneError
from fracslice.formulas import box, cylinder, difference, mandelbulb, menger, transform, union
from fracslice.mesh import Mesh
from fracslice.mesh.checks import check_mesh
from fracslice.mesh.cleaning import quantise_mesh
from fracslice.mesh.contouring import contour
from fracslice.mesh.model import Nearest, edge_topology, self_intersecting_triangles
from fracslice.mesh.simplify import Collapse, simplify, simplify_to
from fracslice.volume import plan, sample_scene
from fracslice.work import Work
from tests.examples import stamped

from . import shapes

pytestmark = pytest.mark.once


def fine(root, resolution: float) -> Mesh:
    planned = plan(root, resolution)
    return quantise_mesh(contour(planned.root, sample_scene(planned)).scaled(10))


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
    assert check_mesh(few).printable
    assert 0 < done.bound_mm <= 0.2
    assert np.abs(np.linalg.norm(few.vertices, axis=1) - 10).max() < 1e-5, "the original's own vertices"
    middles = np.linalg.norm(few.corners.mean(axis=1), axis=1)
    assert (10 - middles).max() < 0.2 + sagitta


def test_a_cube_is_left_with_twelve_triangles():
    few, done = simplify(divided(shapes.cube(), 4), 0.01)
    assert len(few.triangles) == 12
    assert few.volume == pytest.approx(1000, rel=1e-12)
    assert done.back_mm < 1e-12


@pytest.mark.parametrize("tolerance", [1e-2, 1e-5])
def test_flat_faces_come_to_few_triangles_however_small_the_tolerance(tolerance):
    """A bracket: an angle with a round hole, whose rim alone has a vertex wherever the mesh has one."""
    foot, back = box(size=(2, 1.2, 0.3)), transform(box(size=(0.3, 1.2, 1.2)), translate=(-0.85, 0, 0.5))
    hole = transform(cylinder(radius=0.25, height=2), translate=(0.3, 0, 0))
    bracket = fine(difference(union(foot, back), hole), 48)
    few, done = simplify(bracket, tolerance)
    assert len(bracket.triangles) > 10000 and len(few.triangles) < 700
    assert max(done.bound_mm, done.back_mm) <= tolerance
    assert check_mesh(few).printable


def test_a_menger_sponge_keeps_its_edges_and_its_closed_forms():
    sponge = fine(menger(level=2), 41.3)
    few, _ = simplify(sponge, 0.02)
    scale = float(sponge.size.max()) / 2
    cells = few.vertices / scale * 9
    assert (np.abs(cells - np.round(cells)) < 1e-5).all(axis=1).mean() > 0.95, "corners of its cells are left"
    assert few.volume == pytest.approx((2 * scale) ** 3 * (20 / 27) ** 2, rel=1e-6)
    assert few.area == pytest.approx(scale**2 * (8 * (20 / 9) ** 2 + 16 * (8 / 9) ** 2), rel=1e-6)
    assert len(few.triangles) < len(sponge.triangles) / 20
    assert check_mesh(few).printable and check_mesh(few).genus == check_mesh(sponge).genus


@pytest.mark.nightly
def test_a_rough_fractal_stays_a_solid_without_crossings():
    bulb = fine(mandelbulb(iterations=5), 48)
    few, done = simplify(bulb, 0.1)
    assert len(few.triangles) < 0.8 * len(bulb.triangles)
    before, after = check_mesh(bulb), check_mesh(few)
    assert (after.problems, after.genus, after.components) == ((), before.genus, before.components)
    assert Nearest(few).bounds(bulb, 0.1, Work())[0].max() <= 0.1, "proved once more, from nothing"
    edge = np.median(np.linalg.norm(bulb.corners[:, 0] - bulb.corners[:, 1], axis=1))
    back = Nearest(bulb).samples(few, edge / 2, Work())
    assert back.max() <= done.back_mm <= 0.1
    assert Nearest(bulb).samples(few, 0.05, Work()).max() < 0.15, "between samples: near it, not promised"


def test_the_bound_is_no_less_than_the_truth_and_refuses_what_is_too_far():
    cube, ball = shapes.cube(2, (-1, -1, -1)), shapes.sphere(1, level=4)
    corner = np.sqrt(3) - 1
    bounds, _ = Nearest(ball).bounds(cube, 0.75, Work())
    assert corner - 1e-9 <= bounds.max() <= 0.75
    assert np.isinf(Nearest(ball).bounds(cube, 0.73, Work())[0]).any()
    assert Nearest(ball).samples(cube, 0.1, Work()).max() == pytest.approx(corner, abs=0.01)


def test_the_bound_sees_what_lies_between_the_vertices():
    flat = Mesh(np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], float), np.array([[0, 1, 2]], np.int32))
    bent = Mesh(
        np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0.3, 0.3, 0.2]], float),
        np.array([[0, 1, 3], [1, 2, 3], [2, 0, 3]], np.int32),
    )
    bounds, _ = Nearest(bent).bounds(flat, 0.05, Work())
    assert np.isinf(bounds).all(), "its corners are all on the other"
    hints = np.zeros((1, 3), np.int32)
    assert np.isinf(Nearest(bent).bounds(flat, 0.05, Work(), hints)[0]).all(), "nor does a hint deceive it"


def naive_distance(p, a, b, c):
    """Of a point from a triangle: from its plane if it is above it, else from its edges."""
    sides = [(a, b), (b, c), (c, a)]
    normal = np.cross(b - a, c - a)
    if all(np.dot(np.cross(normal, end - begin), p - begin) >= 0 for begin, end in sides):
        return abs(np.dot(p - a, normal)) / np.linalg.norm(normal)
    shares = [np.clip(np.dot(p - q, r - q) / np.dot(r - q, r - q), 0, 1) for q, r in sides]
    return min(np.linalg.norm(p - q - t * (r - q)) for t, (q, r) in zip(shares, sides, strict=True))


def test_samples_are_as_far_as_each_triangle_says():
    rng = np.random.default_rng(1)
    other = shapes.torus().selected(np.arange(len(shapes.torus().triangles)) % 20 == 0)
    places = rng.uniform(-14, 14, (60, 3))
    specks = Mesh(
        np.repeat(places, 3, axis=0) + 1e-9 * rng.uniform(size=(180, 3)),
        np.arange(180, dtype=np.int32).reshape(-1, 3),
    )
    result = Nearest(other).samples(specks, 1.0, Work())
    naive = [min(naive_distance(p, *corners) for corners in other.corners) for p in places]
    assert result == pytest.approx(naive, abs=1e-8)
    assert Nearest(shapes.torus(), closed=True).samples(specks, 1.0, Work()) == pytest.approx(
        Nearest(shapes.torus()).samples(specks, 1.0, Work()), abs=1e-12
    )


def test_what_is_taken_out_can_be_put_back_in_any_order():
    ball = shapes.torus()
    collapse = Collapse(ball, 0.5)
    collapse.run(Work())
    result, rng, rounds = collapse.state(), np.random.default_rng(2), 0
    assert result.gone.mean() > 0.5
    while result.changed.any():
        collapse.undo(result.changed & (rng.uniform(size=len(result.gone)) < 0.1))
        result, rounds = collapse.state(), rounds + 1
        left = result.triangles[~result.gone]
        _, *defects = edge_topology(left, len(ball.vertices))
        assert not any(defects) and len(np.unique(left)) == len(left) // 2, "a torus"
    assert rounds > 3, "not all at once"
    assert np.array_equal(result.triangles, ball.triangles)
    distances = [
        naive_distance(v, *ball.corners[t]) for v, t in zip(ball.vertices, result.owner, strict=True)
    ]
    assert max(distances) < 1e-12, "each vertex is near one of its own triangles again"


def test_crossings_can_be_asked_for_among_some():
    cubes = [shapes.cube(10, (x, 0, 0)) for x in (0, 5, 30, 35)]
    vertices = np.concatenate([cube.vertices for cube in cubes])
    mesh = Mesh(
        vertices, np.concatenate([cube.triangles + 8 * i for i, cube in enumerate(cubes)]).astype(np.int32)
    )
    of = np.arange(len(mesh.triangles)) // 12
    whole = self_intersecting_triangles(mesh)
    assert np.array_equal(self_intersecting_triangles(mesh, among=of == 0), whole & (of < 2))
    assert not self_intersecting_triangles(mesh, among=of < 0).any()


def test_the_result_is_the_same_for_any_number_of_threads():
    one, two = (simplify(shapes.torus(), 0.1, Work(threads=n))[0] for n in (1, 2))
    assert np.array_equal(one.vertices, two.vertices) and np.array_equal(one.triangles, two.triangles)


def test_the_result_is_the_same_at_every_scale_and_progress_goes_on():
    reported = []
    bulb = fine(mandelbulb(iterations=4), 24)
    few, done = simplify(bulb, 0.2, Work(progress=lambda stage, share: reported.append(share)))
    assert reported == sorted(reported) and 0 <= reported[0] < reported[-1] <= 1
    tiny, reported = simplify(bulb.scaled(2.0**-20), 0.2 * 2.0**-20)
    assert np.array_equal(few.triangles, tiny.triangles)
    assert (reported.bound_mm, reported.back_mm) == (done.bound_mm * 2.0**-20, done.back_mm * 2.0**-20)


@pytest.mark.parametrize("tolerance", [0, -1, float("nan"), float("inf")])
def test_a_tolerance_that_cannot_be(tolerance):
    with pytest.raises(MeshError, match=r"tolerance=.*: expected a number > 0"):
        simplify(shapes.cube(), tolerance)


def test_a_mesh_with_a_hole_is_refused_and_work_can_be_cancelled():
    with pytest.raises(MeshError, match="closed, oriented manifold"):
        simplify(shapes.without(shapes.sphere(), 3), 0.1)
    stop = threading.Event()
    stop.set()
    with pytest.raises(Cancelled):
        simplify(shapes.sphere(), 0.1, Work(cancel=stop))


@pytest.mark.parametrize(
    ("shape", "count"),
    stamped(
        product(("ball", "holes", "fractal"), (4000, 1000, 500)),
        [("ball", 500), ("holes", 1000), ("fractal", 4000)],
    ),
)
def test_a_count_is_reached_within_the_least_tolerance(shape: str, count: int) -> None:
    plate = box(size=(2, 2, 0.5)) - (cylinder(0.2, 2) + (0.5, 0, 0)) - (cylinder(0.3, 2) + (-0.4, 0, 0))
    ball = transform(box(round=0.3), rotate=(1, 2, 3, 40))
    mesh = fine({"ball": ball, "holes": plate, "fractal": mandelbulb(iterations=3)}[shape], 48)
    few, done = simplify_to(mesh, count)
    report = check_mesh(few)
    assert count - 2 <= len(few.triangles) <= count and report.watertight and report.manifold
    assert not (report.self_intersections or report.misoriented_edges)
    assert 0 < max(done.bound_mm, done.back_mm) <= done.tolerance_mm
    assert done.from_triangles == len(mesh.triangles)
    if shape != "holes":  # whose plates lose most of theirs at once
        by_tolerance, _ = simplify(mesh, done.tolerance_mm / 2)
        assert len(by_tolerance.triangles) > count, "half the tolerance would not do"
    assert few.volume == pytest.approx(mesh.volume, rel=4 * done.tolerance_mm / mesh.size.min())


def test_what_has_few_triangles_stays_and_what_cannot_be_is_said() -> None:
    cube = shapes.cube()
    assert simplify_to(cube, 12)[0] is cube and len(cube.simplify(faces=100).triangles) == 12
    with pytest.raises(MeshError, match="to 6 triangles without crossing itself; 20 are left"):
        shapes.torus(10, 3).simplify(faces=6)
    for wrong in ({}, {"faces": 10, "tolerance": 1}, {"faces": 3}, {"faces": 10.5}, {"tolerance": -1}):
        with pytest.raises((MeshError, SceneError), match="expected") as error:
            cube.simplify(**wrong)
        assert "\n" not in str(error.value)


def test_a_job_has_a_count_of_triangles(tmp_path) -> None:
    made = make_mesh(mandelbulb(iterations=3), size=20, resolution=48, faces=1000, path=tmp_path / "a.stl")
    assert len(made.faces) == 1000 and not made.report.problems
    assert made.report.simplified.from_triangles > 10_000
    assert (tmp_path / "a.stl").stat().st_size == 84 + 50 * 1000
    with pytest.raises(SceneError, match="simplify and faces: expected one of them"):
        make_mesh(box(), faces=100, simplify=0.1)
