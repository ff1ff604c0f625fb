"""Triangle models as solids: distances and sides against brute force, identity of files, and refusals."""

from __future__ import annotations

import gc
import pickle
import shutil
import warnings
import weakref
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import trimesh

from fracslice import from_trimesh, make_mesh
from fracslice.common.arrays import concatenate
from fracslice.errors import FracsliceWarning, MeshError, SceneError
from fracslice.expr.intervals import ARRAYS, Interval
from fracslice.fields import cpu
from fracslice.fields.devices import enclosure, for_field, reference
from fracslice.fields.linker import link
from fracslice.formulas import Node, box, model, shell, sphere, transform, twist, union
from fracslice.mesh import Mesh, models
from fracslice.mesh.model import Nearest
from fracslice.scene import read, reads, to_xml
from tests.examples import BRACKET, stamped

from . import shapes

pytestmark = pytest.mark.once

RNG = np.random.default_rng(5)


def solid_angles(mesh: Mesh, points: np.ndarray) -> np.ndarray:
    """Winding numbers, by the formula of van Oosterom and Strackee 1983."""
    total = np.zeros(len(points))
    for corners in mesh.corners:
        a, b, c = (corner - points for corner in corners)
        la, lb, lc = (np.linalg.norm(v, axis=1) for v in (a, b, c))
        dots = (a * b).sum(1) * lc + (b * c).sum(1) * la + (c * a).sum(1) * lb
        total += 2 * np.arctan2((a * np.cross(b, c)).sum(1), la * lb * lc + dots)
    return total / (4 * np.pi)


def distances(mesh: Mesh, points: np.ndarray) -> np.ndarray:
    """Distances to all triangles, the smallest."""
    from trimesh.triangles import closest_point

    best = np.full(len(points), np.inf)
    for corners in mesh.corners:
        nearest = closest_point(np.broadcast_to(corners, (len(points), 3, 3)), points)
        best = np.minimum(best, np.linalg.norm(nearest - points, axis=1))
    return best


def bracket() -> Mesh:
    from fracslice.mesh.models import read_mesh

    return read_mesh(BRACKET)


def crater() -> Mesh:
    """A ball with sharp bumps and dents."""
    ball = shapes.sphere(level=2)
    return Mesh(ball.vertices * (1 + 0.3 * RNG.uniform(-1, 1, (len(ball.vertices), 1))), ball.triangles)


def two_tips() -> Mesh:
    """Two cubes that share a corner."""
    return concatenate([shapes.cube(), shapes.cube(at=(10, 10, 10))])


def nested() -> Mesh:
    """A cube with a cavity, and a cube in that."""
    hole = shapes.inverted(shapes.cube(6, (2, 2, 2)))
    return concatenate([shapes.cube(), hole, shapes.cube(2, (4, 4, 4))])


def needles() -> Mesh:
    """A thin tube of long triangles, and a triangle between two corners at one place."""
    tube = shapes.torus(10, 0.01)
    a, b, _ = tube.triangles[0].tolist()
    vertices = np.vstack([tube.vertices, tube.vertices[[a]]])
    # The triangle across a -> b has the copy of a, so that two more close the gap, which is none.
    rows = np.array([(a, b, len(tube.vertices)), (b, a, len(tube.vertices))], np.int32)
    return Mesh(vertices, np.vstack([tube.triangles, rows]))


MODELS: dict[str, Callable[[], Mesh]] = {
    "bracket": bracket, "crater": crater, "torus": shapes.torus, "two tips": two_tips, "nested": nested,
    "needles": needles,
}  # fmt: skip


def saved(mesh: Mesh, path: Path) -> str:
    mesh.export(path)
    return str(path)


@pytest.fixture(params=MODELS)
def solid(request: pytest.FixtureRequest, tmp_path: Path) -> tuple[Node, Mesh]:
    """A model, and its mesh as a file has it."""
    from fracslice.mesh.cleaning import quantise_mesh

    mesh = quantise_mesh(MODELS[request.param]())
    return model(saved(mesh, tmp_path / "model.stl")), mesh


def around(mesh: Mesh, count: int) -> np.ndarray:
    """Random points around a mesh, half of them near its vertices and triangles."""
    low, high = mesh.bounds
    anywhere = RNG.uniform(low - 0.3 * (high - low), high + 0.3 * (high - low), (count, 3))
    weights = RNG.dirichlet((1, 1, 1), count)
    weights[::3] = np.eye(3)[RNG.integers(0, 3, len(weights[::3]))]
    on = (mesh.corners[RNG.integers(0, len(mesh.triangles), count)] * weights[:, :, None]).sum(1)
    return np.concatenate([anywhere, on + RNG.normal(size=on.shape) * 0.02 * (high - low).max()])


def test_distances_and_sides_are_those_of_all_triangles(solid: tuple[Node, Mesh]) -> None:
    root, mesh = solid
    points = around(mesh, 800)
    found, known = root.distance(points), distances(mesh, points)
    assert np.allclose(abs(found), known, rtol=0, atol=1e-12 * abs(mesh.bounds).max())
    clear = known > 1e-9
    assert ((found < 0) == (solid_angles(mesh, points) > 0.5))[clear].all()


def test_kernels_agree_with_the_reference(solid: tuple[Node, Mesh]) -> None:
    root, mesh = solid
    made = twist(shell(union(root, sphere(3), smooth=0.5), thickness=0.2), degrees=3)
    points = around(mesh, 500).T
    exact = reference(made)(*points)
    assert np.allclose(made.kernel("cpu", "float64").points(*points), exact, rtol=0, atol=1e-12)
    assert np.allclose(made.kernel().points(*points), exact, rtol=0, atol=1e-5)


def test_the_lipschitz_constant_is_one(solid: tuple[Node, Mesh]) -> None:
    root, mesh = solid
    a, b = around(mesh, 3000), around(mesh, 3000)
    b = a + (b - a) * RNG.uniform(0, 1, (len(a), 1)) ** 4
    change = abs(root.distance(a) - root.distance(b))
    assert (change <= np.linalg.norm(a - b, axis=1) * (1 + 1e-12) + 1e-12).all()


def test_enclosures_hold_all_values(solid: tuple[Node, Mesh]) -> None:
    root, mesh = solid
    centres, half = around(mesh, 100).T, 0.07
    within = centres[:, :, None] + RNG.uniform(-half, half, (3, centres.shape[1], 50))
    values = root.distance(np.moveaxis(within, 0, -1))
    known = enclosure(root)(*(Interval(c - half, c + half, ARRAYS) for c in centres))
    for precision in ("float32", "float64"):
        proofs = root.cells(precision)
        low, high = proofs.bounds(centres, half)
        assert (low[:, None] <= values).all() and (values <= high[:, None]).all()
        assert np.allclose(low, known.lo, atol=1e-4) and np.allclose(high, known.hi, atol=1e-4)
        assert (high - low < 2.01 * np.sqrt(3) * half).all()


def test_points_that_are_no_numbers_have_no_distance() -> None:
    points = np.array([(np.nan, 0, 0), (0, np.inf, 0), (1e30, 0, 0), (0, 0, 0)])
    found = model(BRACKET).distance(points)
    assert np.isnan(found[:2]).all() and found[2] == pytest.approx(1e30) and np.isfinite(found[3])
    assert np.array_equal(np.isnan(model(BRACKET).distance(points.astype(np.float32))), np.isnan(found))


def test_a_cube_is_the_same_cube_once_more(tmp_path: Path) -> None:
    root = model(saved(shapes.cube(), tmp_path / "cube.stl"))
    made = make_mesh(root, resolution=33)
    assert made.volume == pytest.approx(1000, rel=1e-12)
    low, high = made.bounds
    assert (high - low == 10).all()
    edges = made.vertices[(np.isclose(made.vertices, low) | np.isclose(made.vertices, high)).sum(1) > 1]
    away = np.minimum(abs(edges - low), abs(edges - high))
    assert np.sort(away, axis=1)[:, 1].max() < 1e-6


def test_one_code_serves_all_models_and_keeps_theirs_alive(tmp_path: Path) -> None:
    other = model(saved(shapes.cube(), tmp_path / "cube.stl"))
    assert link(other).program == link(model(BRACKET)).program and link(other) != link(model(BRACKET))
    assert other.key != model(BRACKET).key
    assert link(other.changed(size=2, place="bed")).held[0][1] is link(other).held[0][1]
    made = cpu.CpuKernel(link(other))
    alive = weakref.ref(models.solid(other["file"], other["sha256"]))
    models.solid.cache_clear()
    gc.collect()
    assert alive() is not None
    assert made.points(np.array([5.0]), np.array([5.0]), np.array([5.0]))[0] == -5
    made.__dict__.clear()
    del other
    gc.collect()
    assert alive() is None


@pytest.mark.parametrize(
    ("values", "low", "high"),
    [
        ({}, (1, 2, 3), (3, 6, 9)),
        ({"units": "cm"}, (10, 20, 30), (30, 60, 90)),
        ({"place": "centre"}, (-1, -2, -3), (1, 2, 3)),
        ({"place": "bed", "size": 1}, (-1 / 6, -1 / 3, 0), (1 / 6, 1 / 3, 1)),
    ],
)
def test_size_and_place(values: dict[str, object], low: tuple, high: tuple, tmp_path: Path) -> None:
    block = Mesh(shapes.cube(1).vertices * (2, 4, 6) + (1, 2, 3), shapes.cube().triangles)
    root = model(saved(block, tmp_path / "block.ply"), **values)
    assert root.bounds.box.lo == pytest.approx(low) and root.bounds.box.hi == pytest.approx(high)


FAULTS: dict[str, tuple[Callable[[], Mesh], str]] = {
    "open": (lambda: shapes.without(shapes.cube(), 3), "3 open edges (a hole in the surface)"),
    "inside out": (lambda: shapes.inverted(shapes.cube()), "1 shell inside out or inside another body"),
    "flipped": (lambda: shapes.with_flipped(shapes.cube(), 2), "of opposite orientation"),
    "crossing": (
        lambda: concatenate([shapes.cube(), shapes.cube(at=(5, 5, 5))]),
        "triangles that cut or touch others",
    ),
    "inside another": (
        lambda: concatenate([shapes.cube(), shapes.cube(2, (4, 4, 4))]),
        "1 shell inside out or inside another body",
    ),
    "fin": (lambda: shapes.with_fin(shapes.cube()), "open edges"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_what_is_no_solid_is_refused_with_its_fault_and_a_remedy(fault: str, tmp_path: Path) -> None:
    make, message = FAULTS[fault]
    saved(make(), tmp_path / "fault.stl")
    (tmp_path / "a.xml").write_text(f"<scene version='1'>\n<solid size='1mm'>\n{TAG.format('fault.stl')}")
    with pytest.raises(SceneError) as error:
        read(tmp_path / "a.xml")
    text = str(error.value)
    assert text.startswith(f'{tmp_path}/a.xml:3: <model> file="{tmp_path}/fault.stl": ')
    assert message in text and "`fracslice repair fault.stl -o OUT`" in text and "\n" not in text


TAG = "<model file='{}'/></solid></scene>"
OPENING = "<scene version='1'><solid size='1mm'>"


def test_a_scene_knows_its_model_by_the_hash(tmp_path: Path) -> None:
    for folder in ("one", "two"):
        (tmp_path / folder).mkdir()
        shutil.copy(BRACKET, tmp_path / folder / "x.stl")
        (tmp_path / folder / "a.xml").write_text(OPENING + TAG.format("x.stl"))
    one, two = (read(tmp_path / folder / "a.xml") for folder in ("one", "two"))
    assert one.hash == two.hash and one.root.key == two.root.key and one != two
    assert reads(to_xml(one), files_outside=True) == one and pickle.loads(pickle.dumps(one)) == one
    saved(shapes.cube(), tmp_path / "one" / "x.stl")
    other = read(tmp_path / "one" / "a.xml")
    assert other.hash != one.hash and other.root.key != one.root.key
    models._SEEN.clear()  # as in another process
    with pytest.raises(
        SceneError, match=f"the file is another now: expected one with the hash {one.root['sha256']}"
    ):
        reads(to_xml(one), files_outside=True)
    assert one.root.changed(size=2).values["sha256"] == other.root["sha256"]


def test_a_model_lies_in_the_folder_of_its_scene(tmp_path: Path) -> None:
    folder = tmp_path / "scenes"
    (folder / "parts").mkdir(parents=True)
    shutil.copy(BRACKET, tmp_path / "x.stl")
    shutil.copy(BRACKET, folder / "parts" / "x.stl")
    (folder / "link.stl").symlink_to(tmp_path / "x.stl")
    for name in ("../x.stl", str(tmp_path / "x.stl"), "link.stl"):
        (folder / "a.xml").write_text(OPENING + TAG.format(name))
        with pytest.raises(SceneError, match="expected a file in the folder of the scene, or --allow-files"):
            read(folder / "a.xml")
        assert read(folder / "a.xml", files_outside=True).root.bounds.box.finite
    for name in ("parts/x.stl", "../scenes/parts/x.stl"):
        (folder / "a.xml").write_text(OPENING + TAG.format(name))
        assert read(folder / "a.xml").root.bounds.box.finite


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ("file='none.stl'", "no such file"),
        ("file='a.xml'", "not a model file that can be read; known are .3mf, .glb, .obj, .ply, .stl"),
        ("file='cube.3mf' units='in'", 'units="in": expected none, as the file states its own'),
        ("file='cube.3mf' units='furlong'", 'units="furlong": expected um'),
        ("file='cube.3mf' place='moon'", 'place="moon": expected as is, centre or bed'),
        ("file='cube.3mf' size='0'", 'size="0": expected a number > 0'),
        ("file='cube.3mf' sha256='12'", "expected the SHA-256 of the file, 64 hexadecimal digits"),
        ("file='nan.stl'", "a coordinate that is not a finite number"),
        ("file='empty.stl'", "the file is empty"),
        ("file='flat.stl'", "has only triangles without area"),
        ("", 'needs the attribute file="..."'),
    ],
)
def test_bad_input_is_one_line(values: str, message: str, tmp_path: Path) -> None:
    saved(shapes.cube(), tmp_path / "cube.3mf")
    data = bytearray(Path(BRACKET).read_bytes())
    data[96:100] = np.float32(np.nan).tobytes()
    (tmp_path / "nan.stl").write_bytes(data)
    (tmp_path / "empty.stl").touch()
    (tmp_path / "flat.stl").write_bytes(data[:84] + bytes(len(data) - 84))
    (tmp_path / "a.xml").write_text(f"{OPENING}<model {values}/></solid></scene>")
    with pytest.raises(SceneError) as error:
        read(tmp_path / "a.xml")
    assert str(error.value).startswith(f"{tmp_path}/a.xml:1: <model> ") and message in str(error.value)
    assert "\n" not in str(error.value)


def test_too_large_a_file_is_refused_before_it_is_read(tmp_path: Path) -> None:
    with (tmp_path / "large.ply").open("wb") as file:
        file.truncate((1 << 26) + 1)
    with pytest.raises(SceneError, match="a file of 67 MB: expected at most 67 MB, of fewer triangles or"):
        model(str(tmp_path / "large.ply"))


def test_a_model_is_computed_on_the_cpu_and_that_is_said() -> None:
    root = transform(model(BRACKET), scale=2)
    from fracslice.common import cache

    cache.warn.cache_clear()
    with pytest.warns(FracsliceWarning, match="computed on the CPU"):
        assert for_field(root, "cuda") == "cpu"
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert for_field(box(), "cuda") == "cuda" and for_field(root, "cpu") == "cpu"
    assert not root.loops((), "float32", "cuda").on_gpu


def test_meshes_of_python_are_shapes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("FRACSLICE_CACHE", str(tmp_path))
    block = trimesh.creation.box((2, 4, 6))
    cut = block & sphere(1.5)
    assert cut == from_trimesh(block) & sphere(1.5) == shapes_mesh(block) & sphere(1.5)
    assert float(cut.distance([0, 0, 0])) == -1 and float((block - sphere(0.5)).distance([0, 0, 0])) == 0.5
    assert (sphere() | block) == union(sphere(), from_trimesh(block))
    assert (sphere() - block).children == (sphere(), from_trimesh(block))
    assert make_mesh(block, resolution=12).volume == pytest.approx(48)
    assert make_mesh(BRACKET, resolution=24).volume == pytest.approx(0.576, rel=1e-3)
    assert from_trimesh(block, place="bed", size=3).bounds.box.hi == (0.5, 1, 3)
    with pytest.raises(MeshError, match="3 open edges"):
        from_trimesh(shapes.without(shapes.cube(), 3))
    with pytest.raises(TypeError):
        np.ones(3) & sphere()


def shapes_mesh(mesh: trimesh.Trimesh) -> Mesh:
    return Mesh(np.array(mesh.vertices), np.array(mesh.faces, np.int32))


def test_far_away_a_model_is_a_point() -> None:
    """Rays that have ended wait for others: a search from where they are would visit all triangles."""
    solid = models.Solid.of(MODELS["torus"]())
    for far in (1e3, 1e6, 1e9, 1e13, 1e22, 1e31):
        values = solid.native.distances(np.full((4, 3), far))
        np.testing.assert_allclose(values, 3**0.5 * far, rtol=0.01 if far < 1e6 else 1e-5)


@pytest.mark.parametrize("seed", [1, 3])
def test_a_turned_cube_is_the_same_cube(seed: int) -> None:
    """Edges were off by 9e-3 mm, as vertices within 0.04 voxels of them stayed where they were."""
    turn = trimesh.transformations.random_rotation_matrix(np.random.default_rng(seed).random(3))
    cube = trimesh.creation.box((10, 10, 10)).apply_transform(turn)
    made = make_mesh(from_trimesh(cube), resolution=30)
    mesh = Mesh(made.vertices - made.vertices.min(0) + cube.vertices.min(0), made.triangles)
    own = mesh.vertices @ turn[:3, :3]
    off = abs(abs(own).max(1) - 5)
    assert off.max() < 1e-4 and (off > 2e-6).sum() <= 4  # float32, but for corners of samples in a side
    ends = cube.vertices[cube.edges_unique[cube.edges_unique_length < 10.1]]
    on = np.linspace(ends[:, 0], ends[:, 1], 300).reshape(-1, 3)
    assert len(ends) == 12 and Nearest(mesh).points(on).max() < 2e-6
    assert made.report.problems == () and made.volume == pytest.approx(1000, rel=1e-6)


@pytest.mark.parametrize("make", stamped([bracket, crater, nested], [nested]))
@pytest.mark.parametrize("scale", [(1, 1, 1), (1.5, -0.5, 2)])
def test_a_model_alone_keeps_its_triangles(make: Callable[[], Mesh], scale: tuple[float, ...]) -> None:
    solid = make()
    made = make_mesh(transform(from_trimesh(solid), rotate=(1, 2, 3, 40), scale=scale), threads=1)
    assert len(made.triangles) == len(solid.triangles)
    assert made.volume == pytest.approx(abs(np.prod(scale)) * solid.volume, rel=1e-6)
    assert made.report.problems == ()
    assert made.report.surface_error_mm.max < 1e-5 and made.report.surface_to_mesh_mm.max < 1e-3


def test_a_model_with_a_resolution_is_meshed_anew() -> None:
    assert len(make_mesh(from_trimesh(shapes.cube()), resolution=32, threads=1).triangles) > 1000


def test_a_model_whose_bodies_share_a_vertex_is_meshed_anew() -> None:
    assert len(make_mesh(from_trimesh(two_tips()), threads=1).triangles) > 100
