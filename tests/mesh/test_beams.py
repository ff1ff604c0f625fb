"""Beams between points: distances against balls along them, files, scaffolds against SciPy, and refusals."""

from __future__ import annotations

import json
import time
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import Delaunay, cKDTree

from fracslice.errors import SceneError
from fracslice.expr.intervals import ARRAYS, Interval
from fracslice.fields.devices import enclosure, reference
from fracslice.formulas import beams, box, capsule, mandelbulb, plane, scaffold, sphere, torus
from fracslice.mesh import scaffolds as made
from fracslice.scene import read, reads, scene, to_xml

pytestmark = pytest.mark.once

RNG = np.random.default_rng(11)


def random_balls(count: int) -> np.ndarray:
    """Ends of beams and radii: long and short ones, a ball, and one whose ball holds the other."""
    ends = RNG.uniform(-2, 2, (count, 2, 3))
    ends[::3, 1] = ends[::3, 0] + RNG.normal(0, 0.2, ends[::3, 0].shape)
    balls = np.concatenate([ends, RNG.uniform(0.02, 0.4, (count, 2, 1))], -1)
    balls[0, 1] = balls[0, 0]
    balls[1] = [[0, 0, 0, 0.5], [0.1, 0, 0, 0.2]]
    return balls


def distances(balls: np.ndarray, points: np.ndarray, seam: float = 0.0, parts: int = 1) -> np.ndarray:
    return made.Beams.of(balls, seam, parts).native.distances(points)


def test_a_beam_is_all_balls_between_its_ends() -> None:
    points, share = RNG.uniform(-3, 3, (200, 3)), np.linspace(0, 1, 4001)[:, None]
    for one, other in random_balls(12):
        balls = one + (other - one) * share
        away = np.linalg.norm(points[:, None] - balls[:, :3], axis=-1) - balls[:, 3]
        found = distances(np.array([[one, other]]), points)
        assert found == pytest.approx(away.min(1), abs=2e-5) and (found <= away.min(1) + 1e-12).all()


def test_the_tree_finds_the_least_distance_wherever_it_begins() -> None:
    balls, points = random_balls(400), RNG.uniform(-3, 3, (500, 3))
    each = np.array([distances(ball[None], points) for ball in balls])
    assert (distances(balls, points) == each.min(0)).all()
    assert (distances(balls, points[::-1]) == each.min(0)[::-1]).all()
    assert made.Beams.of(balls, 0.0).box.hi == pytest.approx((balls[..., :3] + balls[..., 3:]).max((0, 1)))


def test_seams_are_the_root_of_their_equation_and_keep_the_slope() -> None:
    balls, points, seam = random_balls(60), RNG.uniform(-3, 3, (2000, 3)), 0.5
    each = np.array([distances(ball[None], points) for ball in balls])
    found = distances(balls, points, seam)
    parts = np.maximum(0, found + seam - each)
    assert (parts * parts).sum(0) == pytest.approx(seam**2, rel=1e-9)
    alone = np.sort(each, 0)[1] > each.min(0) + seam
    assert alone.any() and (found[alone] == each.min(0)[alone]).all()
    beside = points + RNG.normal(0, 0.01, points.shape)
    steps = abs(distances(balls, beside, seam) - found) / np.linalg.norm(beside - points, axis=1)
    assert 0.9 < steps.max() <= 1 + 1e-9
    low, high = made.Beams.of(balls, seam).box.lo, made.Beams.of(balls, seam).box.hi
    inside = points[found < 0]
    assert (inside > low).all() and (inside < high).all()


def test_parts_of_a_beam_have_no_seam() -> None:
    balls, points = random_balls(20), RNG.uniform(-3, 3, (1000, 3))
    share = np.linspace(0, 1, 8)[:, None, None]
    along = (1 - share) * balls[:, 0] + share * balls[:, 1]
    parts = np.stack([along[:-1], along[1:]], 2).reshape(-1, 2, 4)
    assert distances(parts, points, 0.5, 7) == pytest.approx(distances(balls, points, 0.5), abs=1e-9)


POINTS, PAIRS = [(0, 0, 0), (4, 0, 0), (4, 3, 0), (0, 0, 2)], [(0, 1), (1, 2), (0, 3)]
FILES = {
    "a.csv": "x,y,z,x,y,z,r,r\n0,0,0,4,0,0,0.2\n4,0,0,4,3,0,0.2,0.4\n\n0,0,0,0,0,2\n",
    "a.json": json.dumps({"points": POINTS, "beams": [[0, 1, 0.2], [1, 2, 0.2, 0.4], [0, 3]]}),
    "b.json": json.dumps({"points": [[*p, 0.2] for p in POINTS], "beams": PAIRS}),
    "a.obj": "v 0 0 0\nv 4 0 0\nv 4 3 0 1 1 1\nv 0 0 2\nl 1 2 3\nl 1 -1\nf 1 2 3\n",
    "a.ply": "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
    "element edge 3\nproperty int vertex1\nproperty int vertex2\nend_header\n"
    "0 0 0\n4 0 0\n4 3 0\n0 0 2\n0 1\n1 2\n0 3\n",
}  # fmt: skip
RADII = {
    "a.csv": [[0.2, 0.2], [0.2, 0.4], [0.1, 0.1]],
    "a.json": [[0.2, 0.2], [0.2, 0.4], [0.1, 0.1]],
    "b.json": [[0.2, 0.2]] * 3,
}


@pytest.mark.parametrize("name", FILES)
def test_files_of_beams_are_read(name: str, tmp_path: Path) -> None:
    (tmp_path / name).write_text(FILES[name])
    root = beams(str(tmp_path / name), thickness=0.2)
    radii = np.array(RADII.get(name, [[0.1, 0.1]] * 3))
    balls = np.concatenate([np.array(POINTS, float)[np.array(PAIRS)], radii[..., None]], -1)
    points = RNG.uniform(-1, 5, (300, 3))
    assert reference(root)(*points.T) == pytest.approx(distances(balls, points), abs=1e-6)
    assert reads(to_xml(scene(root, unit=1.0)), files_outside=True).root == root
    half = reference(root.changed(size=2, thickness=0.1))(*points.T / 2)
    assert 2 * half == pytest.approx(distances(balls, points), abs=1e-6)
    assert root.changed(place="bed").bounds.box.lo[2] == pytest.approx(0)
    assert root.changed(place="centre", units="cm").bounds.box.centre[0] == pytest.approx(0, abs=4.1)


def lattice_3mf(path: Path, radius: float = 0.2) -> str:
    """A lattice of lib3mf's in cm, twice in the build, once turned and half as large."""
    lib3mf = pytest.importorskip("lib3mf")
    lib = lib3mf.get_wrapper()
    model = lib.CreateModel()
    model.SetUnit(lib3mf.ModelUnit.CentiMeter)
    mesh = model.AddMeshObject()
    for point in POINTS:
        vertex = lib3mf.Position()
        vertex.Coordinates[:] = point
        mesh.AddVertex(vertex)
    lattice = mesh.BeamLattice()
    lattice.SetMinLength(1e-4)
    for k, pair in enumerate(PAIRS):
        made_of = lib3mf.Beam()
        made_of.Indices[:], made_of.Radii[:] = pair, (radius, radius * (1 + k))
        lattice.AddBeam(made_of)
    turned = lib3mf.Transform()
    for row, values in enumerate([(0, 0.5, 0), (-0.5, 0, 0), (0, 0, 0.5), (9, 0, 0)]):
        turned.Fields[row][:] = values
    model.AddBuildItem(mesh, lib.GetIdentityTransform())
    model.AddBuildItem(mesh, turned)
    model.QueryWriter("3mf").WriteToFile(str(path))
    return str(path)


def test_beam_lattices_of_3mf_files_are_read(tmp_path: Path) -> None:
    root = beams(lattice_3mf(tmp_path / "a.3mf"))
    radii = np.array([[0.2, 0.2], [0.2, 0.4], [0.2, 0.6]])
    balls = 10 * np.concatenate([np.array(POINTS, float)[np.array(PAIRS)], radii[..., None]], -1)
    other = balls / 2
    other[..., :2] = other[..., 1::-1] * (-1, 1) + (90, 0)
    points = RNG.uniform(-10, 90, (500, 3))
    known = distances(np.concatenate([balls, other]), points)
    assert reference(root)(*points.T) == pytest.approx(known, abs=1e-4)
    with pytest.raises(SceneError, match=r"units=.cm.: expected none, as the file states its own"):
        beams(str(tmp_path / "a.3mf"), units="cm")


def test_a_capsule_is_one_beam(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("0 ,0,0,1,2,3,0.25,0.25")
    points = RNG.uniform(-1, 3, (3, 500))
    known = capsule(**{"from": (0, 0, 0), "to": (1, 2, 3), "radius": 0.25})
    root = beams(str(tmp_path / "a.csv"))
    assert reference(root)(*points) == pytest.approx(reference(known)(*points), abs=1e-12)
    sides = [Interval(a - 0.1, a + 0.1, ARRAYS) for a in points]
    found = enclosure(root)(*sides)
    at = np.clip(points + RNG.uniform(-0.1, 0.1, points.shape), points - 0.1, points + 0.1)
    assert (found.lo <= reference(root)(*at)).all() and (reference(root)(*at) <= found.hi).all()


def test_cells_inside_are_those_of_even_points() -> None:
    """Beams are as far from their three nearest points, and end at the surface."""
    child = box(size=(2, 1.5, 1))
    field = made._Field(child)
    points = made._spread(field, False, 80, 3)
    assert len(points) == 80 and (field(points) < 0).all()
    near = cKDTree(points).query(points, 2)[0][:, 1]
    assert near.min() > 0.45 * (3 / 80) ** (1 / 3)
    ends = made._cells_inside(field, points, 0.02)
    middles = ends.mean(1)
    found = cKDTree(points).query(middles[field(middles) < 0], 3)[0]
    assert np.ptp(found, axis=1).max() < 1e-9
    root = scaffold(child, count=80, seed=3, thickness=0.04)
    assert root.bounds.box.size == pytest.approx((2, 1.5, 1), abs=0.1) and root.bounds.lipschitz == 1
    at = RNG.uniform(-1, 1, (3, 4000))
    balls = np.concatenate([ends, np.full((len(ends), 2, 1), 0.02)], -1)
    known = np.maximum(distances(balls, at.T.copy()), field(at.T))
    assert reference(root)(*at) == pytest.approx(known, abs=1e-12)


def test_lines_inside_are_edges_of_tetrahedra() -> None:
    root = scaffold(sphere(1.0), of="delaunay", count=40, thickness=0.04)
    points = made._spread(made._Field(sphere(1.0)), False, 40, 0)
    corners = points[Delaunay(points).simplices]
    middles = (corners[:, 0] + corners[:, 1]) / 2
    assert reference(root)(*middles.T) == pytest.approx(-0.02, abs=1e-9)


@pytest.mark.parametrize("of", ["voronoi", "delaunay"])
def test_scaffolds_follow_the_surface(of: str) -> None:
    child = torus(radius=1.0, tube=0.4)
    field = made._Field(child)
    points = made._spread(field, True, 150, 0)
    assert abs(field(points)).max() < 1e-9
    ends = made._on_surface(field, points, 0.0, of == "delaunay")
    assert abs(field(ends)).max() < 1e-8
    if of == "voronoi":  # three cells meet at each end of a border
        found = cKDTree(points).query(ends.reshape(made.PARTS, -1, 2, 3)[0, :, 0], 3)[0]
        assert np.ptp(found, axis=1).max() < 1e-8
    count = len(ends) // made.PARTS
    assert count == pytest.approx(3 * len(points), abs=12)  # Euler: of a torus all cells have six sides
    root = scaffold(child, of=of, where="surface", count=150)
    assert root.bounds.box.size[2] == pytest.approx(0.9, abs=0.02) and root.bounds.lipschitz == 1


def test_ten_thousand_beams_are_quick(tmp_path: Path) -> None:
    starts = RNG.uniform(-1, 1, (10_000, 3))
    rows = np.hstack([starts, starts + RNG.normal(0, 0.03, starts.shape)])
    (tmp_path / "a.csv").write_text("\n".join(",".join(map(repr, row)) for row in rows.tolist()))
    began = time.perf_counter()
    root = beams(str(tmp_path / "a.csv"), thickness=0.01)
    values = reference(root)(*RNG.uniform(-1, 1, (3, 20_000)))
    assert time.perf_counter() - began < 5 and np.isfinite(values).all()


BAD = {
    "a.csv": {
        "": "expected 1 to 1,048,576 beams, found 0",
        "0,0,0,1,0": "row 1: expected x y z of both ends and at most two radii, found 5 numbers",
        "0,0,0,1,0,x": "not a whole file of beams",
        "0,0,0,1,0,nan": "not a finite number",
        "0,0,0,1,0,0,-1": "expected radii above 0",
        "0,0,0,1,0,0,inf": "not a finite number",
    },
    "a.json": {
        "{": "not a whole file of beams",
        "[1]": "not a whole file of beams",
        '{"points": [[0, 0]], "beams": [[0, 0]]}': "not a whole file of beams",
        '{"points": [[0, 0, 0]], "beams": [[0, 1]]}': "a beam names a point that does not exist",
        "[" * 100_000: "not a whole file of beams",
    },
    "a.obj": {
        "v 0 0 0\nl 1 2": "a beam names a point that does not exist",
        "l 1 a": "not a whole file of beams",
    },
    "a.ply": {"ply\nformat": "not a whole file of beams", FILES["a.ply"][:-20]: "not a whole file of beams"},
    "a.3mf": {"PK": "not a whole 3MF file"},
    "a.stl": {"solid": "not a file of beams that can be read; known are .3mf, .csv, .json, .obj, .ply"},
}  # fmt: skip


@pytest.mark.parametrize(("name", "text"), [(name, text) for name, texts in BAD.items() for text in texts])
def test_bad_files_are_one_line(name: str, text: str, tmp_path: Path) -> None:
    (tmp_path / name).write_text(text)
    inside = f"<solid size='9mm'>\n<beams file='{name}'/></solid>"
    (tmp_path / "a.xml").write_text(f"<scene version='1'>{inside}</scene>")
    began = time.perf_counter()
    with pytest.raises(SceneError) as error:
        read(tmp_path / "a.xml").root.distance((0, 0, 0))
    assert time.perf_counter() - began < 5
    message = str(error.value)
    assert BAD[name][text] in message and "\n" not in message
    assert message.startswith(f"{tmp_path}/a.xml:2: <beams> file=")


def test_solids_that_have_no_scaffold_are_refused() -> None:
    with pytest.raises(SceneError, match="<mandelbulb>: expected no fractal inside"):
        scaffold(mandelbulb())
    with pytest.raises(SceneError, match="expected a solid that is bounded"):
        scaffold(plane()).bounds  # noqa: B018
    thin = box(size=(1, 1, 1e-7)) | sphere(0.01).translate((0, 0, 50))
    with pytest.raises(SceneError, match="finds too few points in the element"):
        scaffold(thin, count=5000).bounds  # noqa: B018
