"""What native code finds of a mesh in blocks, against NumPy and SciPy; the same for any number of threads."""

from __future__ import annotations

import subprocess
import sys
from typing import Any

import numpy as np
import pytest
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components as components_of_a_graph

from fracslice._native import (
    connected_components,
    corners_by_vertex,
    near,
    pointed,
    selected,
    stl,
    surroundings,
    touching,
)
from fracslice.common.arrays import concatenate
from fracslice.mesh import Mesh
from fracslice.mesh.cleaning import place_and_round, quantise
from fracslice.mesh.model import component_sizes, self_intersecting_triangles
from fracslice.mesh.shells import nesting

from .shapes import cube, inverted

pytestmark = pytest.mark.once

THREADS = 1, 2, 5
RNG = np.random.default_rng(11)
N, M = 200_000, 50_000
"""Vertices and triangles: more than two blocks of each."""
LOOSE = Mesh(RNG.normal(size=(N, 3)), RNG.integers(0, N, (M, 3)).astype(np.int32))
"""Triangles of which many hang together and many do not, in no order."""
SOME = RNG.random(M) < 0.4


MORE_THREADS = """
import numpy, os
from fracslice._native import bounds
bounds(numpy.zeros((1 << 20, 3)), 4 * os.cpu_count())
"""


def test_more_threads_than_cores_print_no_warning() -> None:
    run = subprocess.run([sys.executable, "-c", MORE_THREADS], capture_output=True, text=True, check=True)
    assert run.stderr == ""


@pytest.mark.parametrize("threads", THREADS)
def test_connected_components(threads: int) -> None:
    labels, count = connected_components(LOOSE.triangles, N, threads)
    edges = np.concatenate([LOOSE.triangles[:, :2], LOOSE.triangles[:, 1:]])
    _, expected = components_of_a_graph(coo_array((np.ones(2 * M), edges.T), shape=(N, N)))
    used = np.unique(LOOSE.triangles)
    _, first, which = np.unique(expected[used], return_index=True, return_inverse=True)
    assert 1000 < count == len(first)
    assert (labels[used] == np.argsort(np.argsort(first))[which]).all()
    assert (np.delete(labels, used) == -1).all()


def test_sizes_of_components() -> None:
    labels, count = connected_components(LOOSE.triangles, N)
    result = [component_sizes(LOOSE.vertices, LOOSE.triangles, labels, count, k) for k in THREADS]
    of = labels[LOOSE.triangles[:, 0]]
    a, b, c = (LOOSE.vertices[LOOSE.triangles[:, k]] for k in range(3))
    origin = LOOSE.vertices[result[0].outermost[of, 0]]
    expected = np.bincount(of, (np.cross(a - origin, b - origin) * (c - origin)).sum(1)) / 6
    for side in range(6):
        heights = (1 if side < 3 else -1) * LOOSE.vertices[:, side % 3]
        order = np.lexsort([heights, labels])
        assert (result[0].outermost[:, side] == order[np.searchsorted(labels[order], np.arange(count))]).all()
    for volumes, areas, vectors, _, flat in result:
        assert np.allclose(volumes, expected, rtol=1e-9, atol=1e-9)
        assert np.allclose(areas, np.bincount(of, np.linalg.norm(LOOSE.normals, axis=1)) / 2)
        assert np.allclose(vectors[:, 2], np.bincount(of, LOOSE.normals[:, 2]) / 2)
        assert flat.sum() == (LOOSE.normals == 0).all(axis=1).sum()
    assert len({b"".join(array.tobytes() for array in sizes) for sizes in result}) == 1


@pytest.mark.parametrize("threads", THREADS)
def test_corners_by_vertex(threads: int) -> None:
    start, corner = corners_by_vertex(LOOSE.triangles, N, threads)
    assert (corner == np.argsort(LOOSE.triangles.ravel(), kind="stable")).all()
    assert (np.diff(start) == np.bincount(LOOSE.triangles.ravel(), minlength=N)).all()


@pytest.mark.parametrize("threads", THREADS)
def test_selected(threads: int) -> None:
    result = selected(LOOSE.vertices, LOOSE.triangles, SOME, threads)
    assert result is not None
    used = np.unique(LOOSE.triangles[SOME])
    assert (result[0] == LOOSE.vertices[used]).all()
    assert (result[1] == np.searchsorted(used, LOOSE.triangles[SOME])).all()
    assert LOOSE.selected(SOME, threads).selected(np.ones(SOME.sum(), bool)).triangles is not None
    whole = cube()
    assert whole.selected(np.ones(12, bool)) is whole


@pytest.mark.parametrize("threads", THREADS)
def test_touching(threads: int) -> None:
    marked = RNG.random(N) < 0.01
    result = touching(LOOSE.triangles, marked, threads)
    assert (result == np.flatnonzero(marked[LOOSE.triangles].any(axis=1))).all()


@pytest.mark.parametrize("threads", THREADS)
def test_all_triangles_near_points_are_found_and_few_others(threads: int) -> None:
    points = np.random.default_rng(12).normal(size=(20, 3))
    result = near(LOOSE.vertices, LOOSE.triangles, points, 0.1, threads)
    off = np.abs(LOOSE.vertices[:, None] - points).max(axis=2).min(axis=1)
    assert set(np.flatnonzero((off < 0.1)[LOOSE.triangles].any(axis=1))) <= set(result)
    assert (off[LOOSE.triangles[result]].min(axis=1) < 0.21).all()


def test_pointed_vertices_are_all_found_unless_there_are_too_many() -> None:
    """Pyramids without a base: each has one."""
    count = 70_000
    corners = np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0]], float)
    vertices = np.concatenate([corners + [3 * k, 0, 0] for k in range(count)])
    sides = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 1]], np.int32)
    triangles = (sides + 5 * np.arange(count, dtype=np.int32)[:, None, None]).reshape(-1, 3)
    assert (pointed(vertices, triangles[:4000], 0.1, 1000) == 5 * np.arange(1000)).all()
    assert 1000 < len(pointed(vertices, triangles, 0.1, 1000)) < count
    assert (pointed(vertices, triangles, 0.1, count) == 5 * np.arange(count)).all()


def test_the_surroundings_of_triangles_hold_all_that_they_meet() -> None:
    """Small triangles by the ten thousand, of which some meet."""
    corners = RNG.random((4000, 1, 3)) + RNG.normal(0, 0.01, (4000, 3, 3))
    mesh = Mesh(corners.reshape(-1, 3), np.arange(12_000, dtype=np.int32).reshape(-1, 3))
    whole, among = self_intersecting_triangles(mesh), np.zeros(4000, bool)
    among[RNG.integers(4000, size=37)] = among[np.flatnonzero(whole)[:3]] = True
    near = surroundings(mesh.vertices, mesh.triangles, among)
    assert among[near].sum() == among.sum() and len(near) < 1000
    result = self_intersecting_triangles(mesh, among=among)
    assert 0 < (result & among).sum() == (whole & among).sum()
    assert not self_intersecting_triangles(mesh, among=~among & among).any()


@pytest.mark.parametrize("threads", THREADS)
def test_quantised_coordinates_and_what_is_displaced(threads: int) -> None:
    planes = np.linspace(-8, 8, 2**20 + 1)[:, None] + np.zeros(3)  # 2 to 32 steps of float32 apart
    points = LOOSE.vertices.copy()
    points[:1000, 0] = planes[RNG.integers(len(planes), size=1000), 0]
    points[1000:2000] = -0.0
    mesh, keep = Mesh(points, LOOSE.triangles), np.ones(N, bool)
    quantised, displaced, _ = quantise(mesh, keep, planes=planes, threads=threads)
    result = quantised.vertices
    assert (result == points.astype(np.float32)).all() and not np.signbit(result[1000:2000]).any()
    low = planes[np.searchsorted(planes[:, 0], points, "right") - 1, 0].astype(np.float32)
    high = planes[np.searchsorted(planes[:, 0], points, "left"), 0].astype(np.float32)
    kept = np.where(low == high, result == low, (low < result) & (result < high)).all(axis=1)
    assert 0 < displaced.sum() < N / 2 and (displaced == ~kept).all()
    assert quantise(mesh, keep, threads=threads).displaced.all()
    far = quantise(mesh, keep, planes=planes, frame=(10, (0, 0, 0), -np.inf), threads=threads)
    assert far.displaced[np.abs(points).max(axis=1) > 0.8].all()


@pytest.mark.parametrize("threads", THREADS)
def test_quantised_are_the_triangles_that_stay_with_their_edits(threads: int) -> None:
    labels, _ = connected_components(LOOSE.triangles, N)
    keep = (labels % 2 == 0) & (labels >= 0)
    of = labels[LOOSE.triangles[:, 0]]
    rows = np.sort(np.random.default_rng(3).choice(M, 1000, replace=False))
    corners = LOOSE.triangles[rows][:, [1, 2, 0]].copy()
    corners[::3] = -1
    result = quantise(LOOSE, keep, edits=(rows, corners), frame=(2, (1, 2, 3), 0.5), threads=threads)
    edited = LOOSE.triangles.copy()
    edited[rows] = corners
    stay = np.flatnonzero((edited[:, 0] >= 0) & (of % 2 == 0))
    number = np.cumsum(keep) - 1
    assert (result.mesh.triangles == number[edited[stay]]).all()
    assert (result.mesh.vertices == place_and_round(LOOSE.vertices[keep], (2, (1, 2, 3), 0.5))).all()
    there = np.flatnonzero(np.isin(rows, stay))
    assert (stay[result.places[there]] == rows[there]).all() and (np.delete(result.places, there) == -1).all()


def test_shells_in_shells() -> None:
    """Cubes of cubes, each in the cavity of the one around it, or beside it in the way of its rays."""
    depth, parts = 6, list[Any]()
    for number in range(60):
        x, y, _ = 30.0 * RNG.permutation(3)
        for k in range(depth):
            size = 2.0 * (depth - k)
            solid = cube(size, at=(x - size / 2 + number / 100, y - size / 2, 20 * number - size / 2))
            parts.append(inverted(solid) if k % 2 else solid)
    order = RNG.permutation(len(parts))
    mesh = concatenate([parts[k] for k in order])
    labels, count = connected_components(mesh.triangles, len(mesh.vertices))
    volumes = component_sizes(mesh.vertices, mesh.triangles, labels, count).volumes
    at = np.empty(count, int)
    at[order] = np.arange(count)
    outside = np.where(order % depth == 0, -1, at[order - 1])
    for threads in THREADS:
        winding, parent = nesting(mesh, labels, volumes, threads=threads)
        assert (parent == outside).all()
        assert (winding == order % depth % 2).all()


def test_stl_records() -> None:
    kind = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    flat = Mesh(LOOSE.vertices, np.concatenate([LOOSE.triangles, [[5, 5, 7]]]).astype(np.int32))
    result = [stl(flat.vertices, flat.triangles, threads) for threads in THREADS]
    assert all((other == result[0]).all() for other in result)
    records = result[0].view(kind)[:, 0]
    corners = flat.vertices.astype(np.float32)[flat.triangles]
    assert (records["corners"] == corners).all() and not records["attribute"].any()
    lengths = np.linalg.norm(records["normal"].astype(float), axis=1)
    assert lengths[-1] == 0 and np.allclose(lengths[flat.normals.any(axis=1)], 1)
    u, v = (corners[:, k].astype(float) - corners[:, 0] for k in (1, 2))
    assert np.allclose(
        records["normal"] * np.linalg.norm(np.cross(u, v), axis=1)[:, None], np.cross(u, v), atol=1e-6
    )
