"""Tips beyond the last samples: a mesh reaches them, and stays sound."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fracslice import MeshJob, make_mesh
from fracslice.formulas import Node, box, cone, menger, octahedron, sphere, transform, union
from fracslice.mesh import Mesh
from fracslice.mesh.checks import check_mesh
from fracslice.mesh.cleaning import quantise_mesh
from fracslice.mesh.contouring import Piece, contour
from fracslice.mesh.shells import Pieces
from fracslice.mesh.tips import pointed_in, with_tips
from fracslice.scene import scene
from fracslice.volume import plan, sample_scene
from fracslice.work import Work

pytestmark = pytest.mark.once


def made(root: Node, resolution: float, threads: int = 2) -> tuple[Mesh, Mesh, float]:
    """Without and with tips; the voxel."""
    planned, work = plan(root, resolution), Work(threads=threads)
    mesh = contour(planned.root, sample_scene(planned, work), work)
    pieces, pointed = Pieces(), pointed_in(mesh, -np.inf, np.inf, planned.voxel)
    pieces.add(Piece(mesh, np.inf))
    tipped, _ = with_tips(planned, pieces, pointed.points, work)
    return mesh, tipped.mesh(0), planned.voxel


def nearest(mesh: Mesh, points: np.ndarray) -> np.ndarray:
    return np.linalg.norm(mesh.vertices[:, None] - points, axis=2).min(axis=0)


TURNS = [(1, 0, 0, 0), (1, 2, 3, 37), (2, 5, -1, 20), (0, 0, 1, 10), (7, 1, 3, 140)]


@pytest.mark.parametrize("turn", TURNS)
def test_all_tips_of_an_octahedron(turn: tuple[float, float, float, float]) -> None:
    x, y, z, degrees = turn
    mesh, tipped, voxel = made(transform(octahedron(radius=1.0), rotate=turn), 64)
    axis = np.array([x, y, z]) / np.linalg.norm([x, y, z])
    matrix = Rotation.from_rotvec(np.radians(degrees) * axis).as_matrix()
    tips = np.concatenate([matrix.T, -matrix.T])
    assert nearest(tipped, tips).max() < 2e-6
    if turn != TURNS[-1]:  # that one has them all
        assert nearest(mesh, tips).max() > 0.2 * voxel
    assert abs(tipped.volume / (4 / 3) - 1) <= abs(mesh.volume / (4 / 3) - 1)
    assert check_mesh(quantise_mesh(tipped)).printable


@pytest.mark.parametrize(("radius", "height"), [(0.5, 2.0), (0.1, 2.0)])
def test_a_cone_is_as_high_as_it_is(radius: float, height: float) -> None:
    result = make_mesh(scene(cone(radius=radius, height=height), size=100), MeshJob(resolution=64))
    assert result.mesh.size[2] == pytest.approx(100, abs=1e-3)
    assert result.report.mesh.printable
    assert result.report.surface_to_mesh_mm.max < 0.5


def test_a_thin_spike_on_a_ball() -> None:
    root = union(sphere(radius=0.5), transform(cone(radius=0.06, height=1.6), translate=(0, 0, 1.2)))
    result = make_mesh(scene(root, size=100), MeshJob(resolution=64))
    assert result.mesh.size[2] == pytest.approx(100, abs=0.1)
    assert result.report.mesh.printable


def test_the_same_for_any_number_of_threads() -> None:
    root = transform(octahedron(radius=1.0), rotate=(1, 2, 3, 37))
    (_, one, _), (_, many, _) = made(root, 48, 1), made(root, 48, 3)
    assert (one.vertices == many.vertices).all()
    assert (one.triangles == many.triangles).all()


@pytest.mark.parametrize(
    "root", [sphere(), box(size=(1, 1, 1)), menger(level=2)], ids=["ball", "box", "menger"]
)
def test_nothing_where_no_tip_is_missing(root: Node) -> None:
    mesh, tipped, _ = made(root, 50)
    assert np.shares_memory(tipped.vertices, mesh.vertices)
    assert np.array_equal(tipped.triangles, mesh.triangles)
