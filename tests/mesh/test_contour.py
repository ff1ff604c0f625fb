"""Exact surfaces: vertices on the zero set, edges and corners where they are, and a manifold whatever it is
given.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from fracslice._native import Cells, Contouring
from fracslice.errors import MeshError
from fracslice.fields.devices import ArrayField, reference
from fracslice.fields.field import Bounds, Device, Kernel, Precision
from fracslice.fields.node import FORMULAS
from fracslice.formulas import (
    Node,
    Number,
    box,
    cos,
    difference,
    intersection,
    julia,
    mandelbulb,
    menger,
    octahedron,
    offset,
    shape,
    sin,
    sphere,
    torus,
    transform,
    union,
)
from fracslice.mesh import Mesh
from fracslice.mesh.checks import check_mesh
from fracslice.mesh.contouring import Piece, contour, contour_pieces, extract
from fracslice.mesh.fit import surface_error
from fracslice.volume import Bricks, plan, sample_scene
from fracslice.work import Work

pytestmark = pytest.mark.once


def made(root: Node, resolution: float) -> Mesh:
    planned = plan(root, resolution)
    return contour(planned.root, sample_scene(planned))


def assert_solid(mesh: Mesh) -> None:
    report = check_mesh(mesh)
    assert report.watertight and report.manifold and report.self_intersections == 0, report


def test_sphere() -> None:
    mesh = made(sphere(), 256)
    assert np.abs(np.linalg.norm(mesh.vertices, axis=1) - 1).max() < 1e-6
    assert abs(mesh.volume / (4 / 3 * np.pi) - 1) < 5e-5


def test_julia_without_a_constant_is_a_sphere() -> None:
    """|w_N| = |p|^(2^N) = R, so its radius is R^(1 / 2^N)."""
    mesh = made(julia(c=(0, 0, 0, 0), iterations=12, bailout=2), 96)
    assert np.abs(np.linalg.norm(mesh.vertices, axis=1) / 2 ** (1 / 4096) - 1).max() < 1e-6


@pytest.mark.parametrize(("level", "resolution"), [(0, 40.3), (1, 47.9), (2, 61.7), (3, 101.3)])
def test_menger(level: int, resolution: float) -> None:
    """Volume 8 (20/27)^n and area 8 (20/9)^n + 16 (8/9)^n, whatever the voxel is to the cells."""
    mesh = made(menger(level=level), resolution)
    assert mesh.volume == pytest.approx(8 * (20 / 27) ** level, rel=1e-7)
    assert mesh.area == pytest.approx(8 * (20 / 9) ** level + 16 * (8 / 9) ** level, rel=1e-7)
    assert_solid(mesh)


@pytest.mark.parametrize(
    ("root", "volume", "area"),
    [
        (box(size=(1, 2, 0.7)), 1.4, 8.2),
        (transform(box(size=(1, 1.3, 0.8)), rotate=(1, 2, 3, 37)), 1.04, 6.28),
        (octahedron(radius=1), 4 / 3, 4 * np.sqrt(3)),
        (torus(radius=1, tube=0.3), 2 * np.pi**2 * 0.09, 4 * np.pi**2 * 0.3),
        (
            difference(box(size=(2, 2, 2)), sphere(radius=0.7)),
            8 - 4 / 3 * np.pi * 0.343,
            24 + 4 * np.pi * 0.49,
        ),
    ],
)
def test_known_volumes_and_areas(root: Node, volume: float, area: float) -> None:
    mesh = made(root, 128)
    assert mesh.volume == pytest.approx(volume, rel=1e-3)
    assert mesh.area == pytest.approx(area, rel=1e-3)
    assert_solid(mesh)


def test_a_slab_cut_by_faces_in_planes_of_grid_points() -> None:
    """An odd number of voxels along a box: its edges with a slanted slab are not seen a voxel away only."""
    slab = transform(box(size=(6, 6, 0.4)), rotate=(1, 2, 0.5, 50))
    mesh = made(intersection(box(size=(2, 2, 2)), slab), 41)
    axis = np.array([1, 2, 0.5]) / np.linalg.norm([1, 2, 0.5])
    normal = Rotation.from_rotvec(np.radians(50) * axis).apply([0, 0, 1])
    normals = mesh.normals / np.linalg.norm(mesh.normals, axis=1)[:, None]
    faces = np.abs(normals @ np.vstack([np.eye(3), normal]).T).max(axis=1)
    area = np.linalg.norm(mesh.normals, axis=1) / 2
    assert area[faces < np.cos(np.radians(5))].sum() < 0.01 * mesh.area
    assert_solid(mesh)


@pytest.mark.parametrize(
    ("root", "resolution", "most"),
    [
        (torus(radius=1, tube=0.06), 64, 0.0045),  # Planes alone: 0.0065; now 0.0030.
        (offset(box(size=(1, 1.3, 0.8)), distance=0.01), 64, 0.024),  # 0.0278; 0.0202.
        (julia(iterations=6), 64, 0.045),  # 0.0482; 0.0415.
    ],
)
def test_round_ridges_have_no_nicks(root: Node, resolution: float, most: float) -> None:
    """Ridges of 0.5 to 2 voxels: where the planes of a cell meet, there is no edge. `most`: of the mesh's
    edges, those where it bends by more than 40 degrees."""
    mesh = made(transform(root, rotate=(1, 2, 3, 37)), resolution)
    sides = mesh.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    order = np.lexsort(np.sort(sides, axis=1).T)
    normals = mesh.normals / np.linalg.norm(mesh.normals, axis=1)[:, None]
    both = normals[order // 3].reshape(-1, 2, 3)
    assert ((both[:, 0] * both[:, 1]).sum(1) < np.cos(np.radians(40))).mean() < most
    assert_solid(mesh)


@shape(period=Number(1.0, "period of the lattice", above=0), thickness=Number(0.1, "of the wall", above=0))
def gyroid_wall(x, y, z, period, thickness):  # type: ignore[no-untyped-def]
    """The wall of a gyroid (Schoen 1970)."""
    k = 6.283185307179586 / period
    u, v, w = k * x, k * y, k * z
    g = sin(u) * cos(v) + sin(v) * cos(w) + sin(w) * cos(u)
    return abs(g) / (1.7320508075688772 * k) - thickness / 2


del FORMULAS["gyroid_wall"]  # other tests look at the formulas of the package


def test_walls_that_meet_a_cutting_box_at_an_acute_angle_have_no_teeth() -> None:
    """Edges of 50 degrees enter cells without crossings. When they were cut off there, 1,850 triangles were a
    fifth of a voxel away from the surface; 247 are now."""
    root = intersection(gyroid_wall(period=1, thickness=0.12), box(size=(2, 2, 1)))
    mesh = made(root, 137)
    off = np.abs(root.distance(mesh.corners.mean(axis=1))) * 137 / 2
    assert (off > 0.2).sum() < 300
    assert (off > 0.1).sum() < 1300
    assert off.max() < 0.34
    assert_solid(mesh)


def test_both_sides_of_a_step_in_one_cell() -> None:
    """What faces across the axes say is the same as when they are turned by so little that each normal is
    looked at, where cells see two parallel ones, too."""
    raised = transform(box(size=(0.9, 3, 0.025)), translate=(0.41, 0, 1))
    root = union(box(size=(2, 2, 2)), raised)
    across, turned = made(root, 32), made(transform(root, rotate=(1, 2, 3, 1e-4)), 32)
    assert across.volume == pytest.approx(turned.volume, abs=1e-7)
    assert across.triangles.shape == turned.triangles.shape
    assert_solid(across)


class Called(Kernel):
    """A kernel that is no machine code."""

    def __init__(self, kernel: Kernel, fails: bool) -> None:
        self.kernel, self.fails, self.dtype = kernel, fails, kernel.dtype

    def points(self, x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
        if self.fails:
            raise MeshError("no field")
        return self.kernel.points(x, y, z)


@dataclass
class InPython(ArrayField):
    """A scene whose field is called in Python."""

    root: Node
    fails: bool = False

    @property
    def bounds(self) -> Bounds:
        return self.root.bounds

    @property
    def key(self) -> str:
        return f"{self.root.key} {self.fails}"

    def kernel(self, device: Device = "cpu", precision: Precision = "float32") -> Called:
        return Called(self.root.kernel(device, precision), self.fails)


def test_a_field_in_python_gives_the_same_surface() -> None:
    planned = plan(difference(box(), sphere(radius=0.6)), 40)
    bricks = sample_scene(planned)
    mesh, same = contour(planned.root, bricks), contour(InPython(planned.root), bricks)
    assert np.abs(mesh.vertices - same.vertices).max() < 1e-6 * bricks.voxel
    assert (mesh.triangles == same.triangles).all()


def test_what_a_field_raises_is_passed_on() -> None:
    planned = plan(box(), 40)
    with pytest.raises(MeshError, match="no field"):
        contour(InPython(planned.root, fails=True), sample_scene(planned), Work(threads=2))


def test_much_nearer_than_marching_cubes() -> None:
    planned = plan(union(box(), transform(box(), translate=(0.45, 0.4, 0.3), rotate=(1, 1, 0, 30))), 64)
    bricks, f = sample_scene(planned), reference(planned.root)
    plain, exact = extract(bricks), contour(planned.root, bricks)

    def error(mesh: Mesh) -> float:
        middles = mesh.vertices[mesh.triangles].mean(1)
        return float(np.abs(f(*middles.T)).mean() / bricks.voxel)

    assert error(exact) < error(plain) / 10


def test_every_vertex_of_a_rough_fractal_lies_on_it() -> None:
    """But for the few that their cells hold off."""
    planned = plan(mandelbulb(iterations=8), 64)
    mesh = contour(planned.root, sample_scene(planned))
    error = surface_error(planned.root, mesh.vertices, planned.voxel) / planned.voxel
    assert error.mean() < 1e-5 and error.max() < 0.01
    assert_solid(mesh)


def noise(seed: int, size: int = 2) -> Bricks:
    """White noise in a box of outside samples: every case of a cell, side by side."""
    rng = np.random.default_rng(seed)
    field = np.ones((8 * size,) * 3, np.float32)
    field[1:-1, 1:-1, 1:-1] = rng.normal(size=(8 * size - 2,) * 3)
    ijk = np.array(list(itertools.product(range(size), repeat=3)), np.int32) * 8
    values = np.stack([field[i : i + 8, j : j + 8, k : k + 8].ravel() for i, j, k in ijk])
    return Bricks((0.0, 0.0, 0.0), 1.0, ijk, values, np.arange(len(ijk), dtype=np.int32).reshape((size,) * 3))


def cells_of(bricks: Bricks) -> Cells:
    return Cells(bricks.ijk, bricks.signs.signs, bricks.index)


def contouring(cells: Cells) -> Contouring:
    return Contouring(cells, -1, 2, (0.0, 0.0, 0.0), 1.0, 1e-3)


@pytest.mark.parametrize("seed", range(12))
def test_a_solid_for_any_crossings_and_normals(seed: int) -> None:
    cells, rng = cells_of(noise(seed)), np.random.default_rng(100 + seed)
    n = cells.crossings_before(2)
    t = rng.choice([rng.uniform(0, 1, n), rng.integers(0, 2, n)])
    normals = rng.normal(size=(3, n))
    normals = (normals / np.linalg.norm(normals, axis=0)).astype(np.float32)
    made = contouring(cells)
    made.advance(3, 0, t, normals)
    vertices, triangles, crossings, cases, to_means, _ = made.finish()
    assert n == crossings and len(cases) > 0 and len(vertices) == crossings + len(cases)
    cells = np.floor(vertices[crossings:])
    means = vertices[crossings:] + to_means
    assert (means >= cells - 1e-6).all() and (means <= cells + 1 + 1e-6).all()
    assert_solid(Mesh(vertices, triangles))


def test_threads_do_not_matter() -> None:
    planned = plan(difference(box(), sphere(radius=0.6)), 64)
    bricks = sample_scene(planned)
    first, other = (contour(planned.root, bricks, Work(threads=n)) for n in (1, 3))
    assert first.vertices.tobytes() == other.vertices.tobytes()
    assert first.triangles.tobytes() == other.triangles.tobytes()


def test_the_wrong_number_of_crossings_is_refused() -> None:
    with pytest.raises(ValueError, match="crossings"):
        contouring(cells_of(noise(0))).advance(3, 0, np.zeros(3), np.zeros((3, 3), np.float32))


def test_a_surface_without_its_last_layer_is_refused() -> None:
    with pytest.raises(ValueError, match="layers"):
        contouring(cells_of(noise(0))).finish()


def test_bricks_out_of_order_are_refused() -> None:
    bricks, index = noise(0), np.arange(8, dtype=np.int32)[::-1].reshape(2, 2, 2)
    with pytest.raises(ValueError, match="order"):
        cells_of(
            replace(
                bricks, ijk=bricks.ijk[::-1].copy(), values=bricks.values[::-1].copy(), index=index.copy()
            )
        )


@pytest.mark.parametrize("root", [difference(box(), sphere(radius=0.6)), mandelbulb(iterations=6)])
@pytest.mark.parametrize("most", [1, 60])
def test_pieces_are_the_whole_bit_by_bit(root: Node, most: int) -> None:
    planned = plan(root, 48)
    bricks = sample_scene(planned)
    whole, pieces = contour(planned.root, bricks), list(contour_pieces(planned.root, bricks, most=most))
    assert len(pieces) > 3
    assert triangle_set(pieces) == triangle_set([Piece(whole, np.inf)])
    for one, other in itertools.pairwise(pieces):
        low, high = one.mesh.vertices[:, 0].max(), other.mesh.vertices[:, 0].min()
        assert low <= one.end + 1e-12 and high >= one.end - 1e-12
        mine, theirs = (
            {tuple(v) for v in mesh.vertices.tolist() if abs(v[0] - one.end) < 1e-9}
            for mesh in (one.mesh, other.mesh)
        )
        assert mine and mine == theirs
    assert np.isinf(pieces[-1].end)


def triangle_set(pieces: list[Piece]) -> list[bytes]:
    return sorted(row.tobytes() for piece in pieces for row in piece.mesh.corners)


def test_open_samples_are_refused() -> None:
    bricks = noise(0)
    index = bricks.index.copy()
    index[0, 0, 0] = -1
    open_bricks = Bricks(
        bricks.origin, 1.0, bricks.ijk[1:], bricks.values[1:], np.where(index > 0, index - 1, index)
    )
    with pytest.raises(MeshError, match="not closed"):
        contour(sphere(), open_bricks)


def test_a_straight_edge_takes_no_vertex_in_its_cells() -> None:
    """Of a box whose faces lie beside the grid's planes: on grid edges, on the box's edges in cells' faces,
    and 8 in cells."""
    mesh = made(box(size=(1, 1.2, 0.8)), 40.3)
    planned = plan(box(size=(1, 1.2, 0.8)), 40.3)
    grid = (mesh.vertices - sample_scene(planned).origin) / planned.voxel
    along = (np.abs(grid - np.round(grid)) < 1e-9).sum(1)
    assert (along == 0).sum() == 8
    ends = np.abs(np.abs(mesh.vertices) - (0.5, 0.6, 0.4)) < 1e-9
    assert (ends[along == 0].all(1)).all() and (ends[along == 1].sum(1) == 2).all()
