"""Edges split where the surface bends: nearer to it, closed, and nothing where it is flat or rough."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fracslice import MeshJob, make_mesh
from fracslice.fields.devices import reference
from fracslice.formulas import (
    Node,
    box,
    intersection,
    mandelbulb,
    menger,
    plane,
    sphere,
    torus,
    transform,
    twist,
)
from fracslice.mesh import Mesh
from fracslice.mesh.checks import check_mesh
from fracslice.mesh.contouring import contour
from fracslice.mesh.refine import contracted, edges_of, refine
from fracslice.scene import scene
from fracslice.volume import Plan, plan, sample_scene

pytestmark = pytest.mark.once


def made(root: Node, resolution: float) -> tuple[Plan, Mesh]:
    planned = plan(root, resolution)
    return planned, contour(planned.root, sample_scene(planned))


@pytest.mark.parametrize(
    ("root", "volume"), [(sphere(), 4 / 3 * np.pi), (torus(radius=1, tube=0.4), 2 * np.pi**2 * 0.16)]
)
def test_a_smooth_surface_is_as_near_as_asked(root: Node, volume: float) -> None:
    planned, coarse = made(root, 16)
    fine, done = refine(planned.root, coarse, 1e-3 * planned.voxel, planned.voxel)
    assert check_mesh(fine).printable and done.left == 0 and done.from_triangles == len(coarse.triangles)
    assert abs(fine.volume - volume) < abs(coarse.volume - volume) / 8
    middles = (fine.corners + np.roll(fine.corners, 1, axis=1)).reshape(-1, 3) / 2
    f = np.linalg.norm(middles, axis=1) - 1 if root.formula.name == "sphere" else _torus(middles)
    assert np.abs(f).max() < 1.001e-3 * planned.voxel
    assert np.isin(_rows(coarse.vertices), _rows(fine.vertices)).all(), "no vertex moves"


def _torus(p: np.ndarray) -> np.ndarray:
    return np.hypot(np.hypot(p[:, 0], p[:, 1]) - 1, p[:, 2]) - 0.4


def _rows(points: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(points).view("V24").ravel()


def off(mesh: Mesh, distance: Callable[[np.ndarray], np.ndarray], connected_components: int = 8) -> float:
    """How far points all over the triangles are from the surface, at most."""
    shares = [
        (i, j, connected_components - i - j)
        for i in range(connected_components + 1)
        for j in range(connected_components + 1 - i)
    ]
    points = np.array(shares) / connected_components @ mesh.corners
    return float(np.abs(distance(points.reshape(-1, 3))).max())


def turned_away(root: Node, mesh: Mesh, voxel: float) -> int:
    """How many triangles' normals are more than 30 degrees off the field's."""
    f, p, h = reference(root), mesh.corners.mean(axis=1), 1e-5 * voxel
    slopes = [f(*(p + h * e).T) - f(*(p - h * e).T) for e in np.eye(3)]
    n, g = mesh.normals, np.stack(slopes, axis=1)
    cosine = (n * g).sum(axis=1) / np.linalg.norm(n, axis=1) / np.linalg.norm(g, axis=1)
    return int((cosine < np.cos(np.radians(30))).sum())


@pytest.mark.nightly
def test_a_thin_torus_is_near_everywhere() -> None:
    """Of 3.5 voxels' radius, as a ring of 22 mm at 128 voxels has that is 1.2 mm thick, within 0.002 mm."""
    root = transform(torus(radius=1, tube=0.06), rotate=(1, 2, 3, 37))
    planned, coarse = made(root, 120)
    chord = 2e-3 / 22 * float(coarse.size.max())
    fine, done = refine(planned.root, coarse, chord, planned.voxel)
    axis = np.array([1, 2, 3]) / np.sqrt(14)
    turn = Rotation.from_rotvec(-np.radians(37) * axis).as_matrix()

    def distance(p: np.ndarray) -> np.ndarray:
        x, y, z = turn @ p.T
        return np.hypot(np.hypot(x, y) - 1, z) - 0.06

    assert off(coarse, distance) > 5 * chord
    assert off(fine, distance) < chord and done.left == 0
    assert turned_away(planned.root, fine, planned.voxel) <= turned_away(planned.root, coarse, planned.voxel)
    assert check_mesh(fine).printable


def test_no_triangle_turns_away_at_round_edges() -> None:
    planned, coarse = made(twist(box(size=(1, 1, 2), round=0.1), degrees=60, axis="z"), 64)
    chord = 2e-4 * float(coarse.size.max())
    fine, done = refine(planned.root, coarse, chord, planned.voxel)
    assert done.left == 0 and done.off_mm <= chord
    assert turned_away(planned.root, fine, planned.voxel) <= turned_away(planned.root, coarse, planned.voxel)
    assert check_mesh(fine).printable


def test_curved_sharp_edges_are_followed() -> None:
    """A ball cut in half, beside the grid's planes: what is left is where the mesh had cut the rim off."""
    planned, coarse = made(intersection(sphere(), plane(normal=(1, 2, 3), offset=0.1)), 40)
    chord = 1e-2 * planned.voxel
    fine, done = refine(planned.root, coarse, chord, planned.voxel)
    rough = refine(planned.root, coarse, 1e3 * planned.voxel, planned.voxel)[1]
    assert done.left < len(fine.triangles) / 100 and done.off_mm <= rough.off_mm
    assert (
        turned_away(planned.root, fine, planned.voxel) < turned_away(planned.root, coarse, planned.voxel) / 2
    )
    assert check_mesh(fine).printable


def test_what_is_left_is_reported() -> None:
    bulb = scene(mandelbulb(iterations=4), size="20mm", name="bulb")
    report = make_mesh(bulb, MeshJob(resolution=24, chord=0.02)).report
    assert report.refined is not None and report.refined.left > 0 and report.refined.off_mm > 0.02
    assert any("farther off than the chord" in note for note in report.notes)


def test_flat_faces_and_sharp_edges_are_left_alone() -> None:
    planned, mesh = made(menger(level=2), 40)
    fine, _ = refine(planned.root, mesh, 1e-4 * planned.voxel, planned.voxel)
    assert len(fine.triangles) == len(mesh.triangles)


@pytest.mark.parametrize("voxels", [2.5, 40])
def test_a_chord_wider_than_walls_and_holes_changes_nothing(voxels: float) -> None:
    planned, mesh = made(menger(level=3), 32)
    fine, done = refine(planned.root, mesh, voxels * planned.voxel, planned.voxel)
    assert len(fine.triangles) == len(mesh.triangles) and not done.notes


def test_what_is_left_is_farther_off_than_the_chord() -> None:
    planned, mesh = made(menger(level=3), 32)
    done = refine(planned.root, mesh, planned.voxel / 2, planned.voxel)[1]
    assert done.left and done.off_mm > done.chord_mm


@pytest.mark.nightly
def test_a_rough_surface_stays_a_solid() -> None:
    planned, mesh = made(mandelbulb(iterations=6), 40)
    fine, _ = refine(planned.root, mesh, 0.02 * planned.voxel, planned.voxel)
    assert len(fine.triangles) > len(mesh.triangles)
    assert check_mesh(fine).printable


def test_the_job_takes_it_in_mm() -> None:
    ball = scene(sphere(), size="20mm", name="ball")
    plain = make_mesh(ball, MeshJob(resolution=32)).report.mesh
    fine = make_mesh(ball, MeshJob(resolution=32, chord=0.001)).report.mesh
    truth = 4000 / 3 * np.pi
    assert fine.printable
    assert abs(fine.volume_mm3 / truth - 1) < abs(plain.volume_mm3 / truth - 1) / 5


def test_edges_are_known_by_both_ends() -> None:
    triangles = np.random.default_rng(0).integers(0, 30, (40, 3), np.int32)
    edges = edges_of(triangles)
    pairs = {frozenset(pair) for t in triangles.tolist() for pair in zip(t, t[1:] + t[:1], strict=True)}
    every = np.arange(32)
    found = edges.has(every[:, None], every)
    assert {frozenset(pair) for pair in np.argwhere(found).tolist()} == pairs
    assert not edges_of(triangles[:0]).has(every, every).any()


def test_short_edges_vanish_wherever_they_are_among_others() -> None:
    """Only the triangles at them are looked at; the rest of the mesh may be large."""
    x, y = np.meshgrid(np.arange(9.0), np.arange(9.0), indexing="ij")
    x[4, 4] = 3.01
    vertices = np.stack([x.ravel(), y.ravel(), np.zeros(81)], axis=1)
    a = (9 * np.arange(8)[:, None] + np.arange(8)).ravel()
    triangles = np.concatenate([np.stack([a, a + 9, a + 10], 1), np.stack([a, a + 10, a + 1], 1)]).astype(
        np.int32
    )
    left, found = contracted(Mesh(vertices, triangles), np.array([[31, 40], [0, 1]]), np.zeros(81, bool), 0.1)
    assert len(found) == len(triangles) - 2 and 40 not in found
    assert sorted(set(range(len(triangles))) - set(left.tolist())) == sorted(
        i for i, t in enumerate(triangles.tolist()) if {31, 40} <= set(t)
    )
