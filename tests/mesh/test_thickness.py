"""`--thickness` in the finished mesh, by rays of an own caster: as thick as asked, or named."""

from __future__ import annotations

import re

import numpy as np
import pytest

from fracslice import MeshJob, make_mesh
from fracslice.formulas import Node, box, cylinder, gyroid, intersection, sphere, transform
from fracslice.jobs.mesh_steps import Checks, Finish
from fracslice.mesh import Mesh
from fracslice.mesh.checks import Tally
from fracslice.mesh.model import build
from fracslice.mesh.tips import Late
from fracslice.printing.walls import MeshSurface, ThinWalls, thickness_note, thin_walls
from fracslice.scene import Print, scene
from tests.mesh import shapes

pytestmark = pytest.mark.once


def first_hits(mesh: Mesh, start: np.ndarray, along: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Lengths of rays, and the triangles that they meet first (Moeller and Trumbore 1997)."""
    a, u, v = mesh.corners[:, 0], *(mesh.corners[:, k] - mesh.corners[:, 0] for k in (1, 2))
    length, triangle = np.full(len(start), np.inf), np.zeros(len(start), int)
    for k, (p, d) in enumerate(zip(start, along, strict=True)):
        pv, way = np.cross(d, v), p - a
        with np.errstate(divide="ignore", invalid="ignore"):
            volume, q = (u * pv).sum(1), np.cross(way, u)
            s, t, far = (way * pv).sum(1) / volume, (q @ d) / volume, (v * q).sum(1) / volume
            meets = (s >= -1e-9) & (t >= -1e-9) & (s + t <= 1 + 1e-9) & (far > 1e-6)
        far = np.where(meets, far, np.inf)
        triangle[k], length[k] = far.argmin(), far.min()
    return length, triangle


def random_walls(mesh: Mesh, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Thickness of walls at random points of the surface, and their middles; beside sharp edges, none."""
    rng, corners = np.random.default_rng(0), mesh.corners
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(normals, axis=1)
    normals /= area[:, None]
    own = rng.choice(len(corners), count, p=area / area.sum())
    s, t = np.sqrt(rng.random((count, 1))), rng.random((count, 1))
    points = corners[own, 0] * (1 - s) + corners[own, 1] * s * (1 - t) + corners[own, 2] * s * t
    length, other = first_hits(mesh, points, -normals[own])
    facing = (normals[own] * normals[other]).sum(1)
    beside = (mesh.triangles[own][:, :, None] == mesh.triangles[other][:, None]).any((1, 2))
    wall = (facing < -0.5) & ~beside
    middle = points - length[:, None] / 2 * normals[own]
    return length[wall], middle[wall]


def walls_of(mesh: Mesh, least: float) -> ThinWalls:
    return thin_walls(
        MeshSurface(mesh.vertices, mesh.triangles, *build(mesh, halved=True)), len(mesh.triangles), least
    )


PLATE = transform(box(size=(10, 7, 0.3)), rotate=(1, 2, 0.5, 37))
ROD = transform(cylinder(radius=0.1, height=8), rotate=(1, 2, 0.5, 37))
SHEET = intersection(gyroid(period=1.5, thickness=0.02), sphere())


@pytest.mark.parametrize(
    ("root", "size", "voxel"),
    [
        pytest.param(PLATE, 7, 0.25, id="plate"),
        pytest.param(PLATE, 7, 0.5, id="coarse plate", marks=pytest.mark.nightly),
        pytest.param(ROD, 6, 0.2, id="rod", marks=pytest.mark.nightly),
        pytest.param(ROD, 6, 0.5, id="coarse rod", marks=pytest.mark.nightly),
        pytest.param(SHEET, 6, 0.4, id="sheet", marks=pytest.mark.nightly),
    ],
)
def test_walls_are_as_thick_as_asked_or_named(root: Node, size: float, voxel: float) -> None:
    """With a voxel of half of the thickness, chords cut 7 to 60 % off round rims and rods."""
    how = Print(thickness=1.0)
    made = make_mesh(scene(root, size=f"{size}mm", printing=how), MeshJob(voxel=voxel))
    width, middle = random_walls(made.mesh, 800)
    assert len(width) > 400 and np.median(width) > 0.9
    named = [note for note in made.report.notes if "thinner than the thickness of 1 mm" in note]
    found = walls_of(made.mesh, 1.0)
    assert bool(named) == bool(len(found.width))
    if not named:
        assert width.min() >= 0.99
        return
    least, *at = map(float, re.findall(r"thinnest, ([\d.]+) mm, at (\S+) (\S+) (\S+) mm", named[0])[0])
    assert least == pytest.approx(found.width.min(), rel=0.05)
    assert np.linalg.norm(found.middle - at, axis=1).min() < 0.02
    assert ("expected a voxel of 0.25 mm" in named[0]) == (voxel > 0.25)
    for place in middle[width < 0.99]:
        assert np.linalg.norm(found.middle - place, axis=1).min() < 0.5


def test_the_walls_of_a_cube_are_its_sides() -> None:
    cube = shapes.cube(10.0)
    walls = walls_of(cube, 12.0)
    assert walls.width == pytest.approx(np.full(12, 10.0)) and walls.area.sum() == pytest.approx(600)
    assert np.abs(walls.middle - 5).max() < 5 and (np.abs(walls.middle - 5).min(1) < 1e-9).all()
    assert len(walls_of(cube, 10.0).width) == 0
    surface = MeshSurface(cube.vertices, cube.triangles, *build(cube))
    assert len(thin_walls(surface, 2, 12.0).width) == 2
    with pytest.raises(ValueError, match="expected at most all triangles"):
        thin_walls(surface, 13, 12.0)


def test_a_sharp_edge_is_no_wall_beside_it() -> None:
    """A wedge of 20 degrees: its sides are neighbours."""
    corners = np.array([(0, 0), (10, 1.76), (10, -1.76)])
    vertices = np.array([(x, y, z) for z in (0.0, 5.0) for x, y in corners])
    sides = [(0, 1, 2), (3, 5, 4), (0, 4, 1), (0, 3, 4), (1, 5, 2), (1, 4, 5), (2, 3, 0), (2, 5, 3)]
    wedge = Mesh(vertices, np.array(sides, np.int32))
    assert wedge.is_watertight and wedge.volume > 0
    assert len(walls_of(wedge, 1.0).width) == 0


def test_walls_go_through_the_files_of_a_cluster() -> None:
    late, found = Late(np.empty((0, 3)), np.empty((0, 3))), thin((0.9, 1, 0), (0.8, 1, 0.9))
    parts = [np.empty(0, np.int64)], [np.empty(0)], [4], [late]
    for walls in ([], [found]):
        read = Finish.unpack(Finish.pack(Checks(Tally(), 0.0, *parts, walls)))
        assert len(read.thin) == len(walls)
        for one in read.thin:
            assert all((value == vars(found)[name]).all() for name, value in vars(one).items())


def thin(*walls: tuple[float, float, float]) -> ThinWalls:
    """Walls of a width and area along x."""
    width, area, x = np.array(walls).T
    return ThinWalls(width, area, np.stack([x, 0 * x, 0 * x + 3], axis=1))


def test_a_note_counts_places_and_spots() -> None:
    """Three walls in a row are one place; one of little area is a spot."""
    row = thin((0.9, 1, 0), (0.8, 1, 0.9), (0.85, 1, 1.7))
    crease = thin((0.7, 1e-3, 5))
    how, at = Print(thickness=1.0), "mm, at"
    assert thickness_note([row], how, 0.2) == (
        f"1 place thinner than the thickness of 1 mm; the thinnest, 0.8 {at} 0.90 0.00 3.00 mm",
    )
    assert thickness_note([row, crease], how, 0.2) == (
        "1 place thinner than the thickness of 1 mm, and 1 spot smaller than 0.2 mm; "
        f"the thinnest, 0.7 {at} 5.00 0.00 3.00 mm",
    )
    (note,) = thickness_note([crease], how, 0.2)
    assert note.startswith(
        "1 spot smaller than 0.2 mm, thinner than the thickness of 1 mm; the thinnest, 0.7"
    )
    assert thickness_note([row, crease], Print(thickness=1.0, raft=3.5), 0.2) == ()
    assert thickness_note([], Print(), 0.2) == ()
