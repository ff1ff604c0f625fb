"""Meshes as solids: manifold3d's word, the place on the bed, rounding and cleaning."""

from __future__ import annotations

import numpy as np
import pytest

from fracslice.errors import MeshError
from fracslice.mesh import Mesh
from fracslice.mesh.checks import check_mesh
from fracslice.mesh.cleaning import clean, quantise_mesh
from fracslice.mesh.model import to_manifold

from .shapes import GOOD, cube, sphere, with_flipped, without

pytestmark = pytest.mark.once


@pytest.mark.parametrize("name", GOOD)
def test_manifold3d_takes_good_meshes_as_they_are(name: str) -> None:
    mesh = GOOD[name]()
    solid = to_manifold(mesh)
    assert solid.num_tri() == len(mesh.triangles)


@pytest.mark.parametrize("spoil", [without, with_flipped])
def test_manifold3d_refuses_in_plain_words(spoil) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(MeshError, match="not closed"):
        to_manifold(spoil(sphere(), 7))


def test_rounding_is_done_once() -> None:
    mesh = sphere(level=4)
    once = quantise_mesh(mesh.translated((0.1, 0.2, 0.3)))
    twice = quantise_mesh(once)
    assert np.array_equal(once.vertices, once.vertices.astype(np.float32))
    assert np.array_equal(once.vertices, twice.vertices)
    assert np.array_equal(once.triangles, twice.triangles)


def slivered(mesh: Mesh, seed: int) -> Mesh:
    """The mesh with vertices put almost on vertices, and almost on edges, by splitting triangles."""
    rng = np.random.default_rng(seed)
    vertices, triangles = list(mesh.vertices), [tuple(t) for t in mesh.triangles.tolist()]
    for _ in range(60):
        a, b, c = triangles.pop(int(rng.integers(len(triangles))))
        toward = rng.choice([1e-9, 0.4])
        near = vertices[a] + toward * (vertices[b] - vertices[a]) + 1e-10 * (vertices[c] - vertices[a])
        vertices.append(near)
        n = len(vertices) - 1
        triangles += [(a, b, n), (b, c, n), (c, a, n)]
    return Mesh(np.array(vertices), np.array(triangles, np.int32))


def cleaned(mesh: Mesh) -> Mesh:
    return clean(mesh, np.ones(len(mesh.vertices), bool)).mesh


@pytest.mark.parametrize("seed", range(8))
def test_cleaning_takes_out_what_rounding_flattens(seed: int) -> None:
    mesh = slivered(sphere(20, at=(50, 50, 50)), seed)
    assert check_mesh(mesh).degenerate_triangles > 20
    report = check_mesh(cleaned(mesh))
    assert report.problems == ()
    assert report.volume_mm3 == pytest.approx(mesh.volume, rel=1e-3)
    assert report.vertices >= 600


def test_cleaning_leaves_good_meshes_alone() -> None:
    mesh = quantise_mesh(cube())
    assert np.array_equal(cleaned(mesh).corners, mesh.corners)
