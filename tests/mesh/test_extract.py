"""Marching cubes: closed, manifold and without crossings whatever the samples, right where it is known."""

from __future__ import annotations

import dataclasses
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from fracslice._native import Cells, marching_cubes, open_edges
from fracslice.errors import MeshError
from fracslice.mesh import Mesh
from fracslice.mesh.contouring import extract, minimum_edge_parameter
from fracslice.mesh.model import self_intersecting_triangles
from fracslice.volume.bricks import INSIDE, OUTSIDE, Bricks
from tests.examples import stamped
from tests.fields import blobs, bricks_of, grid_points, noise

pytestmark = pytest.mark.once

NATIVE = Path(__file__).parents[2] / "fracslice" / "native" / "mesh"


def assert_closed_manifold(mesh: Mesh) -> None:
    """Every directed edge once, with its opposite; one ring at each vertex; every vertex used."""
    a, b, c = mesh.triangles.T.astype(np.int64)
    n = len(mesh.vertices)
    here = np.concatenate([a * n + b, b * n + c, c * n + a])
    there = np.concatenate([b * n + a, c * n + b, a * n + c])
    assert (np.concatenate([a - b, b - c, c - a]) != 0).all()
    assert len(np.unique(here)) == len(here)
    assert np.array_equal(np.sort(here), np.sort(there))
    assert rings(mesh) == n


def rings(mesh: Mesh) -> int:
    """How many rings of triangles there are around vertices: the cycles of 'the next edge at its start'."""
    import scipy.sparse
    import scipy.sparse.csgraph

    t = mesh.triangles.astype(np.int64)
    n, m = len(mesh.vertices), len(t)
    starts, ends = t.ravel(), np.roll(t, -1, axis=1).ravel()
    order = np.argsort(starts * n + ends)
    # The half-edge before (p -> q) in its triangle runs (r -> p); its twin (p -> r) is the next edge at p.
    before = np.roll(np.arange(3 * m).reshape(m, 3), 1, axis=1).ravel()
    twin = order[np.searchsorted((starts * n + ends)[order], ends[before] * n + starts[before])]
    around = scipy.sparse.coo_array((np.ones(3 * m), (np.arange(3 * m), twin)), shape=(3 * m, 3 * m))
    return int(scipy.sparse.csgraph.connected_components(around, directed=False)[0])


def accepted(mesh: Mesh) -> bool:
    import manifold3d

    solid = manifold3d.Manifold(
        manifold3d.Mesh(mesh.vertices.astype(np.float32), mesh.triangles.astype(np.uint32))
    )
    return solid.status() == manifold3d.Error.NoError


@pytest.mark.parametrize("side", stamped([8, 16, 24], [16]))
def test_noise_gives_a_closed_manifold(side: int) -> None:
    for seed in range(600 if side == 8 else 40 if side == 16 else 20):
        mesh = extract(bricks_of(noise(seed, side, spread=seed % 7)))
        assert_closed_manifold(mesh)
        assert accepted(mesh)


@pytest.mark.parametrize("seed", range(12))
def test_noise_does_not_cross_itself_even_in_float32(seed: int) -> None:
    mesh = extract(bricks_of(noise(seed, 16, spread=seed), origin=(3, -5, 7), voxel=0.01))
    quantised = dataclasses.replace(mesh, vertices=mesh.vertices.astype(np.float32).astype(float))
    assert not self_intersecting_triangles(mesh).any()
    assert not self_intersecting_triangles(quantised).any()
    assert len(np.unique(quantised.vertices, axis=0)) == len(mesh.vertices)


@pytest.mark.parametrize("seed", [*range(18), 19])
def test_few_bricks_give_the_mesh_of_all_bricks(seed: int) -> None:
    field = blobs(seed)
    few, everything = bricks_of(field), bricks_of(field, dense=True)
    assert len(few) < len(everything)
    mesh, whole = extract(few), extract(everything)
    assert_closed_manifold(mesh)
    assert np.array_equal(sorted_corners(mesh), sorted_corners(whole))


def sorted_corners(mesh: Mesh) -> np.ndarray:
    """The triangles' positions in an order that does not hang on numbering."""
    corners = mesh.vertices[mesh.triangles]
    first = np.lexsort(corners.transpose(2, 0, 1)[::-1], axis=1)[:, 0]
    turned = corners[np.arange(len(corners))[:, None], (first[:, None] + np.arange(3)) % 3].reshape(-1, 9)
    return turned[np.lexsort(turned.T[::-1])]


def test_a_cell_in_a_brick_without_samples_takes_part() -> None:
    # The brick at the origin has no samples; the one across its upper edge is inside right there.
    field = np.ones((16, 16, 16))
    field[8, 8, 1:15] = -1
    bricks = bricks_of(field)
    assert bricks.index[0, 0, 0] == OUTSIDE
    mesh = extract(bricks)
    assert_closed_manifold(mesh)
    assert mesh.vertices[:, :2].min() < 8


@pytest.mark.parametrize("side", [64, 192])
def test_volumes_of_known_solids(side: int) -> None:
    x, y, z, origin, voxel = grid_points(side, 1.3)
    ring = np.sqrt((np.sqrt(x**2 + y**2) - 0.8) ** 2 + z**2) - 0.35
    solids = {
        "ball": (np.sqrt(x**2 + y**2 + z**2) - 1, 4 / 3 * np.pi, 2),
        "torus": (ring, 2 * np.pi**2 * 0.8 * 0.35**2, 0),
        "ellipsoid": (np.sqrt(x**2 + (y / 0.7) ** 2 + (z / 0.5) ** 2) - 1, 4 / 3 * np.pi * 0.35, 2),
    }
    for name, (field, volume, euler) in solids.items():
        mesh = extract(bricks_of(field, origin, voxel))
        assert mesh.volume == pytest.approx(volume, rel=0.002 * (192 / side) ** 2), name
        assert len(mesh.vertices) - len(mesh.triangles) // 2 == euler, name


def test_vertices_lie_on_the_crossed_edges_in_their_order() -> None:
    bricks = bricks_of(noise(5, 16, spread=4))
    vertices, _ = marching_cubes(bricks.ijk, bricks.values, bricks.index, (0, 0, 0), 1.0, 1e-4)
    cells = Cells(bricks.ijk, bricks.signs.signs, bricks.index)
    count = cells.crossings_before(len(bricks.index))
    edges = cells.edges(0, count)
    lower, axis = edges[:, :3], edges[:, 3]
    along = vertices - lower
    rows = np.arange(len(axis))
    t = along[rows, axis].copy()
    along[rows, axis] = 0
    assert not along.any()
    assert t.min() >= 1e-4
    assert t.max() <= 1 - 1e-4
    inside = noise(5, 16, spread=4) < 0
    upper = lower + np.eye(3, dtype=np.int32)[axis]
    assert (inside[tuple(lower.T)] != inside[tuple(upper.T)]).all()
    assert len(np.unique(np.column_stack([lower, axis]), axis=0)) == len(axis)
    assert (cells.edges(7, 20) == edges[7:20]).all()
    with pytest.raises(ValueError, match="no such"):
        cells.edges(0, count + 1)


def test_threads_do_not_change_a_byte() -> None:
    bricks = bricks_of(blobs(3, side=96, blur=3))
    one = extract(bricks, threads=1)
    for threads in (2, 3, 7, 0):
        other = extract(bricks, threads=threads)
        assert one.vertices.tobytes() == other.vertices.tobytes()
        assert one.triangles.tobytes() == other.triangles.tobytes()


def test_no_samples_no_mesh() -> None:
    mesh = extract(bricks_of(np.ones((16, 8, 8))))
    assert mesh.vertices.shape == (0, 3)
    assert mesh.triangles.shape == (0, 3)


def flipped_neighbour() -> Bricks:
    bricks = bricks_of(blobs(1))
    index = bricks.index.copy()
    index[tuple(np.argwhere(index == INSIDE)[0])] = OUTSIDE
    return dataclasses.replace(bricks, index=index)


def test_a_sign_change_that_leaves_the_samples_is_counted_and_refused() -> None:
    good, bad = bricks_of(blobs(1)), flipped_neighbour()
    assert open_edges(good.ijk, good.values, good.index) == 0
    assert open_edges(bad.ijk, bad.values, bad.index) == 6 * 64
    with pytest.raises(MeshError, match="384 sign changes leave the samples"):
        extract(bad)
    border = bricks_of(-np.ones((8, 8, 8)), dense=True)
    assert open_edges(border.ijk, border.values, border.index) == 6 * 64


def test_arrays_that_contradict_each_other_are_refused() -> None:
    good = bricks_of(blobs(1))
    shifted = dataclasses.replace(good, ijk=good.ijk + np.int32(8))
    fewer = dataclasses.replace(good, ijk=good.ijk[1:], values=good.values[1:])
    beyond = dataclasses.replace(good, index=np.where(good.index == 0, 10**6, good.index).astype(np.int32))
    for bad in (shifted, fewer, beyond):
        with pytest.raises(MeshError):
            extract(bad)


def test_clamp_follows_the_spacing_of_float32() -> None:
    field = blobs(1)
    assert minimum_edge_parameter(bricks_of(field)) == 1e-4
    far = bricks_of(field, origin=(4000, 0, 0), voxel=0.25)
    assert minimum_edge_parameter(far) == pytest.approx(4 * 2**-12 / 0.25)
    assert len(np.unique(extract(far).vertices.astype(np.float32), axis=0)) == len(extract(far).vertices)
    with pytest.raises(MeshError, match="too fine for float32"):
        extract(bricks_of(field, origin=(1e6, 0, 0), voxel=0.1))


def test_the_committed_table_is_what_its_script_writes() -> None:
    made = subprocess.run(
        [sys.executable, NATIVE / "make_cases.py"], capture_output=True, text=True, check=True
    )
    assert made.stdout == (NATIVE / "cases.h").read_text()
