"""The verdict on meshes whose state is known, and the numbers in the report."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from fractions import Fraction
from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fracslice._native import connected_components, side_of_line, side_of_plane
from fracslice.common.arrays import concatenate
from fracslice.errors import MeshError
from fracslice.mesh import Mesh
from fracslice.mesh.checks import check_mesh
from fracslice.mesh.model import build, component_sizes, edge_topology, self_intersecting_triangles
from fracslice.mesh.shells import nesting
from tests.examples import stamped

from .shapes import BAD, GOOD, cube, inverted, sphere, torus, with_moved

pytestmark = pytest.mark.once


@pytest.mark.parametrize("name", GOOD)
def test_good_meshes_are_accepted(name: str) -> None:
    report = check_mesh(GOOD[name]())
    assert report.problems == ()
    assert report.printable
    assert report.watertight
    assert report.manifold
    assert report.oriented


@pytest.mark.parametrize("name", BAD)
def test_bad_meshes_are_refused_for_the_right_reason(name: str) -> None:
    make, reason = BAD[name]
    report = check_mesh(make())
    assert not report.printable
    assert any(reason in problem for problem in report.problems), report.problems


def test_one_of_a_kind_is_singular() -> None:
    """A lone triangle."""
    report = check_mesh(Mesh(np.eye(3), np.array([[0, 1, 2]])))
    assert report.problems == ("3 open edges (a hole in the surface)",)
    report = check_mesh(Mesh(np.eye(3), np.array([[0, 1, 2], [0, 1, 2]])))
    assert "1 triangle that repeats another" in report.problems


def test_numbers_of_a_cube() -> None:
    report = check_mesh(cube(10, at=(1, 2, 3)))
    assert (report.triangles, report.vertices, report.components, report.cavities, report.genus) == (
        12,
        8,
        1,
        0,
        0,
    )
    assert report.volume_mm3 == pytest.approx(1000, rel=1e-12)
    assert report.area_mm2 == pytest.approx(600, rel=1e-12)
    assert report.bbox_mm == ((1, 2, 3), (11, 12, 13))


def test_bodies_cavities_and_handles_are_counted() -> None:
    report = check_mesh(
        concatenate([sphere(), inverted(sphere(8)), sphere(3), torus(at=(40, 0, 0)), torus(at=(80, 0, 0))])
    )
    assert (report.components, report.cavities, report.genus) == (4, 1, 2)


def test_report_is_json_with_the_verdict() -> None:
    text = json.loads(json.dumps(check_mesh(cube()).as_dict()))
    assert text["printable"] is True
    assert text["problems"] == []
    assert text["bbox_mm"] == [[0, 0, 0], [10, 10, 10]]


def test_unwelded_copies_are_seen_as_a_slicer_sees_them() -> None:
    soup = cube().corners.reshape(-1, 3)
    report = check_mesh(Mesh(soup, np.arange(len(soup), dtype=np.int32).reshape(-1, 3)))
    assert report.printable
    assert report.vertices == 8


def test_thread_count_does_not_matter() -> None:
    crossed = concatenate([sphere(level=5), sphere(at=(8, 0, 0), level=5)])
    assert check_mesh(crossed, threads=1) == check_mesh(crossed, threads=4)


@pytest.mark.parametrize("value", [math.nan, math.inf, 1e300])
def test_coordinates_that_no_file_can_hold(value: float) -> None:
    with pytest.raises(MeshError, match="not a finite number"):
        check_mesh(with_moved(cube(), 0, (value, 0, 0)))


def test_empty_and_nonsense_meshes() -> None:
    with pytest.raises(MeshError, match="no triangles"):
        check_mesh(Mesh(np.zeros((0, 3)), np.zeros((0, 3), np.int32)))
    with pytest.raises(MeshError, match="does not exist"):
        check_mesh(Mesh(cube().vertices, np.array([[0, 1, 8]], np.int32)))
    with pytest.raises(MeshError, match="without area"):
        check_mesh(Mesh(cube().vertices, np.array([[0, 1, 1]], np.int32)))


def test_arrays_that_contradict_each_other_are_refused() -> None:
    """Nothing reads beyond an array, whoever calls."""
    mesh, beyond = cube(), np.array([[0, 1, 8]], np.int32)
    tree, labels = build(mesh), np.zeros(8, np.int32)
    calls: list[Callable[[], object]] = [
        lambda: edge_topology(beyond, 8),
        lambda: edge_topology(np.array([[0, 1, -(2**31)]], np.int32), 8),
        lambda: connected_components(-beyond, 9),
        lambda: component_sizes(mesh.vertices, mesh.triangles, labels + 1, 1),
        lambda: build(Mesh(mesh.vertices, beyond)),
        lambda: self_intersecting_triangles(mesh, tree._replace(order=tree.order + 1)),
        lambda: self_intersecting_triangles(sphere(), tree),
        lambda: component_sizes(mesh.vertices, mesh.triangles, labels - 1, 1),
        lambda: nesting(mesh, labels[1:], np.ones(2), np.array([-1, 0])),
        lambda: nesting(mesh, labels, np.ones(2), np.array([-2, 0])),
    ]
    for call in calls:
        with pytest.raises(ValueError, match=r"does not exist|differ in length|not of this mesh|no label"):
            call()


def separated(p: np.ndarray, q: np.ndarray) -> bool:
    """Whether two segments or triangles of integer points miss each other: some axis separates them."""
    edges = np.array([a - b for points in (p, q) for a, b in combinations(points, 2)])
    normals = np.cross(edges[:, None], edges).reshape(-1, 3)
    axes = np.concatenate([edges, normals, np.cross(normals[:, None], edges).reshape(-1, 3)]).T
    p, q = p @ axes, q @ axes
    return bool(((p.max(axis=0) < q.min(axis=0)) | (q.max(axis=0) < p.min(axis=0))).any())


def meet(points: np.ndarray, shared: int) -> bool:
    """Whether the triangles of the first three and the last three points meet beyond what they share."""
    s, t = points[:3], points[3 - shared :]
    if shared == 0:
        return not separated(s, t)
    if shared == 1:  # what they share beyond the corner ends on a side opposite to it
        return not (separated(s[:2], t) and separated(s, t[1:]))
    m, n = np.cross(s[2] - s[1], s[0] - s[1]), np.cross(s[2] - s[1], t[2] - s[1])
    return not np.cross(m, n).any() and m @ n > 0


@pytest.mark.parametrize("count", stamped([300, 1000], [300]))
@pytest.mark.parametrize("shared", stamped([0, 1, 2], [1, 2]))
def test_pairs_of_triangles_meet_as_integers_say(shared: int, count: int) -> None:
    """On a small grid, where most pairs touch, lie in one plane or miss each other narrowly."""
    random, result = np.random.default_rng(shared), []
    for _ in range(count):
        points = random.integers(-2, 3, (6 - shared, 3))
        triangles = np.array([[0, 1, 2], random.permutation(np.arange(3 - shared, 6 - shared))], np.int32)
        mesh = Mesh(points * 0.5, triangles)
        if len(np.unique(points, axis=0)) == len(points) and np.linalg.norm(mesh.normals, axis=1).all():
            result.append(meet(points, shared))
            assert self_intersecting_triangles(mesh).tolist() == [result[-1]] * 2, points.tolist()
    assert count / 100 < sum(result) < len(result) - count / 100


def test_self_intersections_agree_with_meshlab() -> None:
    """On surfaces in general position, where MeshLab's test is not blind."""
    pymeshlab = pytest.importorskip("pymeshlab", reason="it is GPL, and nobody needs it")

    rough = sphere(level=4)
    noise = np.random.default_rng(3).normal(0, 0.25, rough.vertices.shape)
    mesh = Mesh((rough.vertices + noise).astype(np.float32).astype(np.float64), rough.triangles)
    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.add_mesh(pymeshlab.Mesh(mesh.vertices, mesh.triangles))
    meshes.compute_selection_by_self_intersections_per_face()
    expected = meshes.current_mesh().selected_face_number()
    assert expected > 100
    assert check_mesh(mesh).self_intersections == expected


GRID = st.integers(-3, 3).map(
    lambda n: 0.1 * n
)  # rounded steps: many points almost, and some exactly, in a plane
POINT = st.tuples(GRID, GRID, GRID)


@settings(deadline=None, max_examples=300)
@given(POINT, POINT, POINT, POINT)
def test_predicates_have_the_exact_sign(a, b, c, d) -> None:  # type: ignore[no-untyped-def]
    rows = [[Fraction(x) - Fraction(y) for x, y in zip(p, d, strict=True)] for p in (a, b, c)]
    (p, q, r), (s, t, u), (v, w, x) = rows
    volume = p * (t * x - u * w) - q * (s * x - u * v) + r * (s * w - t * v)
    assert side_of_plane(a, b, c, d) == (volume > 0) - (volume < 0)
    area = p * t - q * s
    assert side_of_line(a[0], a[1], b[0], b[1], d[0], d[1]) == (area > 0) - (area < 0)
