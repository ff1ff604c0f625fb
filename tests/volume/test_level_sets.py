"""Grids of OpenVDB as solids: distances, L, kinds of numbers, transforms, files, and refusals."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from cli.main import run
from fracslice import from_grid, from_vdb, make_mesh, read, sphere, write_vdb
from fracslice._vdb import Grid
from fracslice.errors import ExportError, FracsliceError, MeshError, SceneError, VolumeError
from fracslice.expr.intervals import ARRAYS, Interval
from fracslice.fields.devices import enclosure, reference
from fracslice.formulas import Node, box, cylinder, difference, gyroid, shell, twist, union
from fracslice.mesh import Mesh
from fracslice.mesh.models import read_mesh
from fracslice.volume.level_sets import save

from ..mesh import shapes
from .vdb_reader import joined, read_vdb, turned

pytestmark = pytest.mark.once

RNG = np.random.default_rng(3)
SIDE = 48
STEP = 2.6 / SIDE
AXIS = np.arange(SIDE) * STEP - 1.3
POINTS = np.stack(np.meshgrid(AXIS, AXIS, AXIS, indexing="ij"), -1)
CORNER = (-1.3, -1.3, -1.3)

Distance = Callable[[np.ndarray], np.ndarray]


def ball(p: np.ndarray) -> np.ndarray:
    return np.asarray(np.linalg.norm(p, axis=-1) - 1)


def cube(p: np.ndarray) -> np.ndarray:
    q = abs(p) - 0.8
    return np.asarray(np.linalg.norm(np.maximum(q, 0), axis=-1) + np.minimum(q.max(-1), 0))


def hollow(p: np.ndarray) -> np.ndarray:
    return np.asarray(abs(ball(p) + 0.15) - 0.15)


def array(values: np.ndarray, **options: object) -> Node:
    return from_grid(values, STEP, origin=CORNER, **options)  # type: ignore[arg-type]


GRIDS: dict[str, tuple[Callable[[], Node], Distance, float]] = {
    "ball": (lambda: array(ball(POINTS)), ball, 0.2),
    "hollow ball": (lambda: array(hollow(POINTS)), hollow, 0.2),
    "cube": (lambda: array(cube(POINTS)), cube, 1.0),
    "no distances": (lambda: array(7 * ball(POINTS)), ball, 0.2),
    "fog": (lambda: array(np.clip(0.5 - ball(POINTS) / 0.3, 0, 1)), ball, 0.2),
    "smoke": (lambda: array(np.exp(-2 * (POINTS**2).sum(-1)), iso=np.exp(-2.0)), ball, 0.2),
    "mask": (lambda: array(ball(POINTS) < 0), ball, 0.9),
    "cut cube": (lambda: from_grid(cube(POINTS)[:, :, 10:], STEP, origin=(-1.3, -1.3, -1.3 + 10 * STEP),
                                   kind="surface"),
                 lambda p: np.maximum(cube(p), -1.3 + 9.5 * STEP - p[..., 2]), 1.2),
}  # fmt: skip
"""Solids of arrays, their distances, and how far those of a grid may be off, in voxels."""


@pytest.fixture(params=GRIDS)
def solid(request: pytest.FixtureRequest) -> tuple[Node, Distance, float]:
    make, distance, tolerance = GRIDS[request.param]
    return make(), distance, tolerance


def test_distances_are_those_of_the_solid_near_and_far(solid: tuple[Node, Distance, float]) -> None:
    root, distance, tolerance = solid
    points = RNG.uniform(-2.5, 2.5, (20_000, 3))
    found, known = root.distance(points), distance(points)
    assert abs(found - known).max() < tolerance * STEP
    clear = abs(known) > tolerance * STEP
    assert ((found < 0) == (known < 0))[clear].all()


def test_the_stated_lipschitz_constant_holds(solid: tuple[Node, Distance, float]) -> None:
    root, *_ = solid
    a = RNG.uniform(-1.6, 1.6, (40_000, 3))
    b = a + RNG.normal(size=a.shape) * STEP * RNG.uniform(0, 3, (len(a), 1))
    steepest = (abs(root.distance(a) - root.distance(b)) / np.linalg.norm(a - b, axis=1)).max()
    assert 0.5 < steepest <= root.bounds.lipschitz <= 6


@pytest.mark.parametrize(
    "placed",
    [
        pytest.param(lambda root: root, id="alone", marks=pytest.mark.nightly),
        pytest.param(
            lambda root: (
                root.rotate(90, "z").scale((2, 1, -1)).translate((3, 0, 0)) | root.material(colour=(1, 0, 0))
            ),
            id="placed twice",
        ),
    ],
)
def test_outermost_points_are_those_of_the_grid(placed: Callable[[Node], Node]) -> None:
    """The field is zero there, and nothing is inside beyond."""
    root = placed(array(ball(POINTS) + 0.1 * np.sin(9 * POINTS).prod(-1)))
    tips = root.tips
    assert tips is not None and abs(root.distance(tips.T)).max() < 1e-12
    ends = np.stack([tips[[0, 1, 2], [0, 1, 2]], tips[[0, 1, 2], [3, 4, 5]]])
    points = RNG.uniform(ends[0] - STEP, ends[1] + STEP, (200_000, 3))
    for axis in range(3):
        for side, sign in ((0, -1), (1, 1)):
            beyond = points.copy()
            beyond[:, axis] = ends[side, axis] + sign * RNG.uniform(1e-9, STEP, len(points))
            assert (root.distance(beyond) > 0).all()
    assert root.rotate(10, "z").tips is None and (root - root.translate((1, 0, 0))).tips is None


def test_the_box_holds_the_solid_and_touches_it(solid: tuple[Node, Distance, float]) -> None:
    root, *_ = solid
    points = RNG.uniform(-1.4, 1.4, (200_000, 3))
    inside = points[root.distance(points) < 0]
    found = root.bounds.box
    assert (inside > found.lo).all() and (inside < found.hi).all()
    assert (inside.min(0) - found.lo < 0.1).all() and (found.hi - inside.max(0) < 0.1).all()


def test_kernels_and_enclosures_agree_with_the_reference(solid: tuple[Node, Distance, float]) -> None:
    root, *_ = solid
    made = twist(shell(union(root, sphere(0.9), smooth=0.1), thickness=0.1), degrees=3)
    points = RNG.uniform(-1.5, 1.5, (3, 1000))
    exact = reference(made)(*points)
    assert np.allclose(made.kernel("cpu", "float64").points(*points), exact, rtol=0, atol=1e-12)
    assert np.allclose(made.kernel().points(*points), exact, rtol=0, atol=1e-5)
    half = 0.06
    bounds = enclosure(root)(*(Interval(c - half, c + half, ARRAYS) for c in points))
    for _ in range(20):
        values = reference(root)(*(points + RNG.uniform(-half, half, points.shape)))
        assert (bounds.lo <= values + 1e-12).all() and (values <= bounds.hi + 1e-12).all()


def test_far_offsets_and_walls_are_as_exact_as_near_ones() -> None:
    """A narrow band alone ends three voxels from the surface."""
    root = array(ball(POINTS))
    for distance in (-0.6, 0.9):
        mesh = make_mesh(root.offset(distance), resolution=40)
        assert mesh.volume == pytest.approx(4 / 3 * np.pi * (1 + distance) ** 3, rel=0.01)
        assert not mesh.report.problems
    wall = make_mesh(root.shell(0.5), resolution=40)
    assert wall.volume == pytest.approx(4 / 3 * np.pi * (1 - 0.125), rel=0.01)


def test_spacing_may_differ_along_axes() -> None:
    steps = np.array([0.05, 0.1, 0.08])
    points = np.stack(np.meshgrid(*(np.arange(-1.2, 1.2, s) for s in steps), indexing="ij"), -1)
    root = from_grid(ball(points), steps, origin=(-1.2, -1.2, -1.2))
    at = RNG.uniform(-1.5, 1.5, (5000, 3))
    assert abs(root.distance(at) - ball(at)).max() < 0.02


def test_a_turned_grid_is_where_its_transform_says(tmp_path: Path) -> None:
    path = Path(grids_file(tmp_path / "a.vdb", surface=cube(POINTS)))
    angle = np.radians(30)
    turn = np.array([[np.cos(angle), np.sin(angle), 0], [-np.sin(angle), np.cos(angle), 0], [0, 0, -1]])
    matrix = np.eye(4)
    matrix[:3, :3], matrix[3, :3] = 10 * STEP * turn, (1, 2, 3)
    path.write_bytes(turned(path.read_bytes(), matrix))
    root = from_vdb(path)
    points = RNG.uniform(-30, 40, (20_000, 3))
    known = 10 * cube(((points - (1, 2, 3)) @ turn.T) / 10 + np.array(CORNER))
    assert abs(root.distance(points) - known).max() < 10 * STEP
    inside = points[known < 0]
    assert (inside >= root.bounds.box.lo).all() and (inside <= root.bounds.box.hi).all()
    (tmp_path / "b.vdb").write_bytes(sheared(grids_file(tmp_path / "c.vdb", surface=cube(POINTS))))
    with pytest.raises(SceneError, match="has axes that are not at right angles"):
        from_vdb(tmp_path / "b.vdb")


def sheared(path: str) -> bytes:
    matrix = np.diag([STEP, STEP, STEP, 1])
    matrix[0, 1] = 0.3 * STEP
    return turned(Path(path).read_bytes(), matrix)


def written(tmp_path: Path, shape: Node, **options: object) -> Path:
    return write_vdb(shape, tmp_path / "made.vdb", **options)  # type: ignore[arg-type]


PLATE = difference(box((10, 8, 6)), cylinder(2, 10))


@pytest.mark.parametrize(
    ("kind", "half"),
    [
        ("surface", True),
        pytest.param("density", False, marks=pytest.mark.nightly),
        pytest.param("surface", False, marks=pytest.mark.nightly),
        pytest.param("density", True, marks=pytest.mark.nightly),
    ],
)
def test_what_is_written_comes_back(kind: str, half: bool, tmp_path: Path) -> None:
    path = written(tmp_path, PLATE, kind=kind, half=half, resolution=64)
    again, voxel = from_vdb(path), 10 / 64
    points = RNG.uniform(-6, 6, (20_000, 3))
    known = PLATE.distance(points)  # a bound beside edges
    off = abs(again.distance(points) - known)[abs(known) < 0.4]
    assert off.max() < 2 * voxel and off.mean() < 0.1 * voxel
    assert again.bounds.box.size == pytest.approx((10, 8, 6), abs=0.01)
    assert make_mesh(again, resolution=64).volume == pytest.approx(480 - 24 * np.pi, rel=0.01)
    first = path.read_bytes()
    assert written(tmp_path, PLATE, kind=kind, half=half, resolution=64).read_bytes() == first


@pytest.mark.skipif(not shutil.which("vdb_print"), reason="vdb_print is not installed")
@pytest.mark.parametrize(("kind", "class_"), [("surface", "level set"), ("density", "fog volume")])
def test_vdb_print_reads_what_other_programs_expect(kind: str, class_: str, tmp_path: Path) -> None:
    path = written(tmp_path, PLATE, kind=kind, half=True, resolution=64, metadata={"author": "a test"})
    shown = subprocess.run(["vdb_print", "-l", path], capture_output=True, text=True).stdout
    for line in (f"Name: {kind}", f"class: {class_}", "is_saved_as_half_float: true", "author: a test"):
        assert line in shown
    assert "creator: fracslice" in shown and "voxel size: 0.156" in shown
    background = 3 * 10 / 64 if kind == "surface" else 0
    assert f"Background value: {background:.6g}" in shown


@pytest.mark.parametrize("half", [False, True])
@pytest.mark.parametrize("kind", ["surface", "density"])
def test_an_independent_reader_finds_the_same_numbers(kind: str, half: bool, tmp_path: Path) -> None:
    """The reader is ours, of Python alone, after the description of the format; it knows no tile."""
    path = written(tmp_path, PLATE, kind=kind, half=half, resolution=48)
    found = read_vdb(path)
    assert (found.name, found.metadata["is_saved_as_half_float"]) == (kind, half)
    at = found.at @ found.matrix[:3, :3] + found.matrix[3, :3]
    near = abs(PLATE.distance(at)) < 0.2
    assert near.sum() > 5000
    exact = PLATE.distance(at[near])
    values = found.values[near] if kind == "surface" else (0.5 - found.values[near]) * 6 * 10 / 48
    assert abs(values - exact).max() < 10 / 48 and abs(values - exact).mean() < 0.1 * 10 / 48


def test_a_mesh_is_exported_as_a_grid(tmp_path: Path) -> None:
    path = shapes.cube().export(tmp_path / "cube.vdb", {"Title": "a cube"})
    again = from_vdb(path)
    assert again.bounds.box.lo == pytest.approx((0, 0, 0), abs=0.01)
    assert again.bounds.box.hi == pytest.approx((10, 10, 10), abs=0.01)
    with pytest.raises(MeshError, match="open edges"):
        shapes.cube().selected(np.arange(12) > 0).export(tmp_path / "open.vdb")
    assert not (tmp_path / "open.vdb").exists()


def grids_file(path: Path, **grids: np.ndarray) -> str:
    """A file with one grid, of a name."""
    ((name, values),) = grids.items()
    grid = Grid.from_array(values.astype(np.float32), CORNER, (STEP,) * 3, 0.2)
    grid.name = name
    save(grid, path)
    return str(path)


def test_kind_and_iso_say_what_numbers_mean(tmp_path: Path) -> None:
    path = grids_file(tmp_path / "a.vdb", heat=np.exp(-2 * (POINTS**2).sum(-1)))
    root = from_vdb(path, kind="density", iso=float(np.exp(-2 * 0.7**2)))
    assert root.bounds.box.size == pytest.approx((1.4,) * 3, abs=0.01)
    path = grids_file(tmp_path / "b.vdb", heat=ball(POINTS))
    assert from_vdb(path, iso=0.1).bounds.box.size == pytest.approx((2.2,) * 3, abs=0.01)
    assert from_vdb(path, "heat", size=10, place="bed").bounds.box.lo == pytest.approx((-5, -5, 0))
    assert from_vdb(path, units="in").bounds.box.size == pytest.approx((50.8,) * 3, rel=0.01)


def test_grids_of_a_file_are_chosen_by_name(tmp_path: Path) -> None:
    one = Path(grids_file(tmp_path / "a.vdb", density=np.clip(0.5 - ball(POINTS) / 0.3, 0, 1)))
    other = Path(grids_file(tmp_path / "b.vdb", heat=cube(POINTS)))
    (tmp_path / "two.vdb").write_bytes(joined(one.read_bytes(), other.read_bytes()))
    by_name = from_vdb(tmp_path / "two.vdb"), from_vdb(tmp_path / "two.vdb", "heat")
    assert [round(root.bounds.box.size[0], 2) for root in by_name] == [2.0, 1.6]
    with pytest.raises(SceneError, match="no grid 'cold'; its grids are density, heat"):
        from_vdb(tmp_path / "two.vdb", "cold")
    (tmp_path / "two.vdb").write_bytes(
        joined(other.read_bytes(), other.read_bytes().replace(b"heat", b"cold"))
    )
    with pytest.raises(SceneError, match=r"expected the name of one of its grids; they are (cold|heat), "):
        from_vdb(tmp_path / "two.vdb")


def test_a_scene_and_commands_take_a_grid(tmp_path: Path) -> None:
    path = grids_file(tmp_path / "a.vdb", surface=ball(POINTS))
    (tmp_path / "a.xml").write_text(
        "<scene version='1'><solid size='20mm'><volume file='a.vdb'/></solid></scene>"
    )
    for source in (path, tmp_path / "a.xml"):
        assert run(["mesh", str(source), "-o", str(tmp_path / "a.stl"), "--resolution", "32", "-q"]) == 0
    assert read_mesh(tmp_path / "a.stl").volume == pytest.approx(4 / 3 * np.pi * 1000, rel=0.02)
    assert make_mesh(path, resolution=32).volume == pytest.approx(4 / 3 * np.pi, rel=0.02)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ("file='none.vdb'", "no such file"),
        ("file='a.xml'", "not an OpenVDB file that can be read; known are .vdb"),
        ("file='a.vdb' grid='heat'", "no grid 'heat'; its grids are surface"),
        ("file='a.vdb' iso='9'", "its grid 'surface' has its inside everywhere beyond its samples"),
        ("file='a.vdb' iso='-3'", "its grid 'surface' holds no surface"),
        ("file='a.vdb' kind='fog'", 'kind="fog": expected as stated, surface or density'),
        ("file='a.vdb' size='0'", 'size="0": expected a number > 0'),
        ("file='far.vdb'", "its grid 'surface' holds samples that are not finite numbers"),
        ("file='text.vdb'", "not a whole OpenVDB file"),
        ("file='half.vdb'", "not a whole OpenVDB file: it is cut short, or of another kind"),
        ("file='empty.vdb'", "not a whole OpenVDB file"),
        ("", 'needs the attribute file="..."'),
    ],
)
def test_bad_input_is_one_line(values: str, message: str, tmp_path: Path) -> None:
    grids_file(tmp_path / "a.vdb", surface=ball(POINTS))
    numbers = ball(POINTS)
    numbers[5, 6, 7] = np.inf
    grids_file(tmp_path / "far.vdb", surface=numbers)
    (tmp_path / "text.vdb").write_text("not a grid")
    (tmp_path / "empty.vdb").touch()
    data = (tmp_path / "a.vdb").read_bytes()
    (tmp_path / "half.vdb").write_bytes(data[: len(data) // 2])
    (tmp_path / "a.xml").write_text(
        f"<scene version='1'><solid size='1mm'><volume {values}/></solid></scene>"
    )
    with pytest.raises(SceneError) as error:
        read(tmp_path / "a.xml").root.bounds  # noqa: B018
    assert str(error.value).startswith(f"{tmp_path}/a.xml:1: <volume> ") and message in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: from_grid(np.zeros((4, 4))), "numbers \\[nx, ny, nz\\], found float64 of shape \\[4, 4\\]"),
        (lambda: from_grid(np.full((4, 4, 4), "a")), "expected an array of at most 134,217,728 numbers"),
        (lambda: from_grid(np.full((4, 4, 4), np.nan)), "not finite"),
        (lambda: from_grid(np.ones((4, 4, 4))), "iso=1: expected a value between 1 and 1"),
        (lambda: from_grid(np.arange(64).reshape(4, 4, 4), -1), "spacing=-1: expected 1 or 3 numbers > 0"),
        (lambda: from_grid(np.arange(64).reshape(4, 4, 4), iso=80), "between 0 and 63"),
        (lambda: from_grid(np.arange(64).reshape(4, 4, 4), kind="fog"), "expected surface or density"),
        (lambda: write_vdb(sphere(), "a.stl"), "expected the extension .vdb"),
        (lambda: write_vdb(sphere(), "a.vdb", kind="fog"), "expected surface or density"),
        (lambda: write_vdb(gyroid(), "a.vdb"), "gyroid"),
    ],
)
def test_wrong_arrays_and_options_are_one_line(make: Callable[[], object], message: str) -> None:
    with pytest.raises(FracsliceError, match=message) as error:
        make()
    assert isinstance(error.value, VolumeError | ExportError | SceneError) and "\n" not in str(error.value)


@pytest.mark.nightly
def test_meshes_of_grids_have_no_faults() -> None:
    made = make_mesh(array(hollow(POINTS)) | (array(cube(POINTS)) & gyroid(period=0.5)), resolution=32)
    assert not made.report.problems and isinstance(made, Mesh)
