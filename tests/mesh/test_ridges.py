"""Sharp edges that samples cut off: a mesh reaches them, and stays sound."""

from __future__ import annotations

from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from scipy.spatial import HalfspaceIntersection

from fracslice.formulas import (
    Node,
    difference,
    heightmap,
    intersection,
    mandelbulb,
    menger,
    plane,
    sphere,
    transform,
)
from fracslice.mesh import Mesh
from fracslice.mesh.checks import check_mesh
from fracslice.mesh.cleaning import quantise_mesh
from fracslice.mesh.contouring import contour_whole
from fracslice.mesh.fit import Fit
from fracslice.mesh.model import Nearest
from fracslice.mesh.refine import on_creases
from fracslice.mesh.ridges import with_ridges
from fracslice.mesh.shells import Pieces, rows
from fracslice.mesh.tips import pointed_in, with_tips
from fracslice.volume import plan, sample_scene
from fracslice.work import Work

pytestmark = pytest.mark.once

THIRD = 3**-0.5
TETRAHEDRON = -THIRD * np.array([(1, 1, 1, -0.5), (1, -1, -1, -0.5), (-1, 1, -1, -0.5), (-1, -1, 1, -0.5)])
"""Half spaces: normals, and distances from the origin."""
BOX = np.array(
    [(*(sign * row), size) for row, size in zip(np.eye(3), (0.5, 0.35, 0.4), strict=True) for sign in (1, -1)]
)
PRISM = np.array(
    [
        (0.5, 0.75**0.5, 0, 0.25),
        (0.5, -(0.75**0.5), 0, 0.25),
        (-1, 0, 0, 0.4),
        (0, 0, 1, 0.5),
        (0, 0, -1, 0.5),
    ]
)
STRAIGHT, TURN = (0, 0, 1, 0), (0.3, 0.5, 0.7, 52.2)


def solid(sides: np.ndarray, turn: tuple[float, float, float, float]) -> tuple[Node, np.ndarray]:
    """Of half spaces, turned; and points on its edges, [n, 3]."""
    node: Node = sphere(radius=2)
    for x, y, z, d in sides.tolist():
        node = intersection(node, plane(normal=(x, y, z), offset=d))
    corners = HalfspaceIntersection(sides * [1, 1, 1, -1], np.zeros(3)).intersections
    on = np.abs(corners @ sides[:, :3].T - sides[:, 3]) < 1e-9
    along = []
    for one, other in combinations(range(len(sides)), 2):
        ends = corners[on[:, one] & on[:, other]]
        if len(ends) and np.ptp(ends, axis=0).max() > 1e-6:
            far = ends[np.linalg.norm(ends - ends[0], axis=1).argmax()]
            along.append(np.linspace(ends[0], far, 100))
    return transform(node, rotate=turn), turned(np.concatenate(along), turn)


def turned(points: np.ndarray, turn: tuple[float, float, float, float]) -> np.ndarray:
    from scipy.spatial.transform import Rotation

    axis, degrees = np.array(turn[:3]), turn[3]
    return Rotation.from_rotvec(np.radians(degrees) * axis / np.linalg.norm(axis)).apply(points)


def made(root: Node, resolution: float, threads: int = 2) -> tuple[Mesh, Mesh, float]:
    """With tips only, with sharp edges too; the voxel."""
    planned, work = plan(root, resolution), Work(threads=threads)
    piece = contour_whole(planned.root, sample_scene(planned, work), work)
    pieces, pointed = Pieces(), pointed_in(piece.mesh, -np.inf, np.inf, planned.voxel)
    pieces.add(piece)
    tipped, tips = with_tips(planned, pieces, pointed.points, work)
    sharp, _ = with_ridges(planned, tipped, piece.blunt, tips, work)
    return tipped.mesh(0), sharp.mesh(0), planned.voxel


def off(mesh: Mesh, points: np.ndarray, voxel: float) -> np.ndarray:
    """Distances of points from a mesh, voxels."""
    return Nearest(mesh, closed=True).points(np.ascontiguousarray(points)) / voxel


@pytest.mark.parametrize(
    ("sides", "turn"),
    [
        pytest.param(TETRAHEDRON, STRAIGHT, id="tetrahedron", marks=pytest.mark.nightly),
        pytest.param(PRISM, STRAIGHT, id="prism", marks=pytest.mark.nightly),
        pytest.param(BOX, STRAIGHT, id="box"),
        pytest.param(TETRAHEDRON, TURN, id="turned tetrahedron", marks=pytest.mark.nightly),
        pytest.param(PRISM, TURN, id="turned prism"),
        pytest.param(BOX, TURN, id="turned box", marks=pytest.mark.nightly),
    ],
)
def test_edges_of_solids(sides: np.ndarray, turn: tuple[float, float, float, float]) -> None:
    """They were cut off by up to 0.6 voxels, and tips fell off."""
    root, edges = solid(sides, turn)
    _, sharp, voxel = made(root, 64)
    away = off(sharp, edges, voxel)
    assert np.quantile(away, 0.99) < 0.05
    assert away.max() < 0.1
    report = check_mesh(quantise_mesh(sharp))
    assert report.printable and report.components == 1


@pytest.mark.parametrize("resolution", [48, 128])
def test_corners_that_samples_hit_stay(resolution: int) -> None:
    """A fan beside one took it away, 0.4 voxels deep; at 48, one was not found."""
    root, edges = solid(PRISM, TURN)
    _, sharp, voxel = made(root, resolution)
    assert off(sharp, edges, voxel).max() < 0.03
    assert check_mesh(quantise_mesh(sharp)).printable


ASKEW = (0.9, 0.8, -0.3, 151.7)


@pytest.mark.parametrize(
    ("sides", "turn", "resolution"),
    [
        pytest.param(BOX, ASKEW, 128, id="a straddling triangle"),
        pytest.param(PRISM, ASKEW, 64, id="a notch beside a corner"),
        pytest.param(BOX, ASKEW, 144, id="corner between triangles", marks=pytest.mark.nightly),
        pytest.param(TETRAHEDRON, ASKEW, 128, id="corner of a tetrahedron", marks=pytest.mark.nightly),
        pytest.param(TETRAHEDRON, (0.2, -0.9, 0.4, 101.3), 200, id="tetrahedron", marks=pytest.mark.nightly),
        pytest.param(PRISM, TURN, 112, id="a notch", marks=pytest.mark.nightly),
        pytest.param(PRISM, TURN, 200, id="seven bodies", marks=pytest.mark.nightly),
        pytest.param(PRISM, (-0.6, 0.1, 0.8, 33.3), 128, id="prism", marks=pytest.mark.nightly),
        pytest.param(PRISM, ASKEW, 128, id="askew prism", marks=pytest.mark.nightly),
    ],
)
def test_edges_of_turned_solids(
    sides: np.ndarray, turn: tuple[float, float, float, float], resolution: int
) -> None:
    """They were off by 0.11 to 0.7 voxels: nine of 90 solids, turns and resolutions."""
    root, edges = solid(sides, turn)
    _, sharp, voxel = made(root, resolution)
    away = off(sharp, edges, voxel)
    assert np.quantile(away, 0.99) < 0.02
    assert away.max() < 0.05
    report = check_mesh(quantise_mesh(sharp))
    assert report.printable and report.components == 1


@pytest.mark.parametrize("length", [0.3, 0.1])
def test_points_of_sharp_edges_across_short_edges(length: float) -> None:
    """Planes were taken nearer to the sharp edge than differences of the field resolve: 24 and 0 of 200."""
    root, _ = solid(PRISM, (0, 0, 1, 0))
    planned = plan(root, 32)
    fit = Fit(planned.root, 0.01, planned.voxel, Work())
    size, down = length * planned.voxel, np.array([(-(0.75**0.5), 0.5, 0), (-(0.75**0.5), -0.5, 0)])
    ends = [0.5, 0, 0.1] + size * np.random.default_rng(1).uniform(0.2, 0.8, (200, 2, 1)) * down
    points, found = on_creases(fit, ends, np.array([[0.98, 0.02], [0.02, 0.98]]) @ ends)
    assert found.all()
    assert np.abs(points[:, :2] - [0.5, 0]).max() < 1e-3 * size


def test_a_valley_of_60_degrees() -> None:
    wedge, edges = solid(PRISM, (0, 0, 1, 0))
    root = transform(difference(solid(BOX * [1, 1, 1, 2.5], (0, 0, 1, 0))[0], wedge), rotate=TURN)
    inner = turned(edges[(edges[:, 0] > 0.49) & (np.abs(edges[:, 2]) < 0.4)], TURN)
    before, sharp, voxel = made(root, 48)
    assert off(before, inner, voxel).max() > 0.2
    assert off(sharp, inner, voxel).max() < 0.05
    assert check_mesh(quantise_mesh(sharp)).printable


def test_the_rim_of_a_lens() -> None:
    balls = (transform(sphere(radius=1), translate=(0, 0, z)) for z in (0.6, -0.6))
    angle = np.linspace(0, 2 * np.pi, 500)
    rim = 0.8 * np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    before, sharp, voxel = made(transform(intersection(*balls), rotate=TURN), 48)
    assert off(before, turned(rim, TURN), voxel).max() > 0.3
    assert off(sharp, turned(rim, TURN), voxel).max() < 0.03
    assert check_mesh(quantise_mesh(sharp)).printable


def test_where_some_edges_fail_the_others_are_sharp(tmp_path: Path) -> None:
    """All of them were left blunt, after the last attempt, for a few triangles."""
    rough = np.random.default_rng(1).integers(0, 256, (10, 10), dtype=np.uint8)
    Image.fromarray(rough).save(tmp_path / "rough.png")
    blunt, sharp, _ = made(heightmap(str(tmp_path / "rough.png"), size=1, height=0.4, base=0.1), 32)
    assert len(np.setdiff1d(rows(sharp.vertices), rows(blunt.vertices))) > 500
    assert check_mesh(quantise_mesh(sharp)).printable


def test_sharp_edges_are_the_same_for_any_number_of_threads() -> None:
    root, _ = solid(TETRAHEDRON, TURN)
    (_, one, _), (_, many, _) = made(root, 32, 1), made(root, 32, 3)
    assert (one.vertices == many.vertices).all()
    assert (one.triangles == many.triangles).all()


@pytest.mark.parametrize(
    "root", [sphere(), menger(level=2), mandelbulb(iterations=5)], ids=["ball", "menger", "bulb"]
)
def test_nothing_where_no_sharp_edge_is_missing(root: Node) -> None:
    before, sharp, _ = made(root, 48)
    assert np.shares_memory(before.vertices, sharp.vertices)
    assert np.array_equal(before.triangles, sharp.triangles)
