"""Edges split where the surface bends: nearer to it, closed, and nothing where it is flat or rough."""

from __future__ import annotations

import numpy as np
import pytest

from fracslice import MeshJob, make_mesh
from fracslice.formulas import Node, mandelbulb, menger, sphere, torus
from fracslice.mesh import Mesh
from fracslice.mesh.check import check
from fracslice.mesh.extract import contour
from fracslice.mesh.refine import refine
from fracslice.scene import scene
from fracslice.volume import Plan, plan, sample_scene


def made(root: Node, resolution: float) -> tuple[Plan, Mesh]:
    planned = plan(root, resolution)
    return planned, contour(planned.root, sample_scene(planned))


@pytest.mark.parametrize(
    ("root", "volume"), [(sphere(), 4 / 3 * np.pi), (torus(radius=1, tube=0.4), 2 * np.pi**2 * 0.16)]
)
def test_a_smooth_surface_is_as_near_as_asked(root: Node, volume: float) -> None:
    planned, coarse = made(root, 48)
    fine = refine(planned.root, coarse, 1e-3 * planned.voxel, planned.voxel)
    assert check(fine).printable
    assert abs(fine.volume - volume) < abs(coarse.volume - volume) / 8
    middles = (fine.corners + np.roll(fine.corners, 1, axis=1)).reshape(-1, 3) / 2
    f = np.linalg.norm(middles, axis=1) - 1 if root.formula.name == "sphere" else _torus(middles)
    assert np.abs(f).max() < 1.001e-3 * planned.voxel
    assert np.isin(_rows(coarse.vertices), _rows(fine.vertices)).all(), "no vertex moves"


def _torus(p: np.ndarray) -> np.ndarray:
    return np.hypot(np.hypot(p[:, 0], p[:, 1]) - 1, p[:, 2]) - 0.4


def _rows(points: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(points).view("V24").ravel()


def test_flat_faces_and_sharp_edges_are_left_alone() -> None:
    planned, mesh = made(menger(level=2), 40)
    fine = refine(planned.root, mesh, 1e-4 * planned.voxel, planned.voxel)
    assert len(fine.triangles) == len(mesh.triangles)


def test_a_rough_surface_stays_a_solid() -> None:
    planned, mesh = made(mandelbulb(iterations=6), 64)
    fine = refine(planned.root, mesh, 0.02 * planned.voxel, planned.voxel)
    assert len(fine.triangles) > len(mesh.triangles)
    assert check(fine).printable


def test_the_job_takes_it_in_mm() -> None:
    ball = scene(sphere(), size="20mm", name="ball")
    plain = make_mesh(ball, MeshJob(resolution=32)).report.mesh
    fine = make_mesh(ball, MeshJob(resolution=32, chord_mm=0.001)).report.mesh
    truth = 4000 / 3 * np.pi
    assert fine.printable
    assert abs(fine.volume_mm3 / truth - 1) < abs(plain.volume_mm3 / truth - 1) / 5
