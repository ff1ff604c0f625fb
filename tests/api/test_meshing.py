"""`make_mesh` by keywords, and what a mesh is to users of trimesh and pyvista."""

from __future__ import annotations

import copy
import inspect
import pickle
import threading
from dataclasses import FrozenInstanceError, fields
from pathlib import Path

import numpy as np
import pytest
import trimesh

from fracslice import Mesh, MeshJob, Result, Work, box, make_mesh, read, sphere, to_xml, torus
from fracslice.api.options import MeshKeywords, PrintKeywords, WorkKeywords
from fracslice.errors import Cancelled, ExportError, SceneError
from fracslice.jobs.mesh import make_mesh as make_mesh_job
from fracslice.mesh.models import read_mesh
from fracslice.scene import Print, scene

SHAPE = box((2, 2, 1)) - sphere(0.6)


@pytest.fixture(scope="module")
def made() -> Result:
    return make_mesh(SHAPE, size="20mm", resolution=24)


def test_keywords_and_records_make_the_same(made: Result) -> None:
    job, work = MeshJob(resolution=24), Work(threads=1)
    by_records = make_mesh(scene(SHAPE, size="20mm"), job, work)
    inner = make_mesh_job(scene(SHAPE, size="20mm"), job, work)
    for other in (by_records, by_records.mesh, inner.mesh, make_mesh(SHAPE, job, work, size=20.0)):
        assert np.array_equal(made.vertices, other.vertices)
        assert np.array_equal(made.triangles, other.triangles)
    assert by_records.report.scene_hash == inner.report.scene_hash


def test_keywords_count_more_than_records() -> None:
    assert (
        make_mesh(scene(SHAPE, size="20mm"), MeshJob(resolution=64), size="1cm", resolution=8).size[0] == 10
    )
    on_raft = scene(SHAPE, size="20mm", printing=Print(raft=2))
    assert make_mesh(on_raft, resolution=16).size.tolist() == [24, 24, 11]
    assert make_mesh(on_raft, resolution=16, base="1mm").size.tolist() == [24, 24, 10]


def test_a_shape_without_a_size_is_in_millimetres() -> None:
    assert make_mesh(box((1, 2, 3)), resolution=12).size.tolist() == [1, 2, 3]
    assert make_mesh(box() | box() + (6, 0, 0), resolution=28).size.tolist() == [7, 1, 1]


def test_a_body_that_stays_alone_keeps_the_unit_of_the_shape() -> None:
    two = box() | box((0.5, 0.5, 0.5)) + (3, 0, 0)
    assert make_mesh(two, keep="largest", resolution=16).size[0] == pytest.approx(1, rel=1e-6)
    assert make_mesh(two, keep="largest", resolution=16, size=5).size[0] == pytest.approx(5, rel=1e-6)


def test_names_and_files_are_shapes_too(tmp_path: Path) -> None:
    file = tmp_path / "ring.xml"
    file.write_text(to_xml(scene(torus(), size="30mm")))
    for source in (file, str(file), scene(torus(), size="30mm"), read(file)):
        assert make_mesh(source, resolution=12).size[0] == pytest.approx(30, rel=1e-4)
    assert make_mesh("octahedron", resolution=12, size=4).size[0] == pytest.approx(4, rel=1e-4)
    assert make_mesh("menger-sponge", resolution=9).report.scene == "menger-sponge"


@pytest.mark.parametrize(
    ("source", "message"),
    [
        ("mandelblub", r"mandelblub: no such scene, formula or file; did you mean mandelbulb\?"),
        ("none.xml", "none.xml: No such file"),
        (sphere, r"sphere: expected a shape, sphere\(...\), found the formula itself"),
        (7, "7: expected a shape such as sphere"),
        ({1: 2}, r"\{1: 2\}: expected a shape .*, a file or a name"),
        ("union", "union: no such scene"),
    ],
)
def test_what_is_no_shape_is_named(source: object, message: str) -> None:
    with pytest.raises(SceneError, match=message):
        make_mesh(source)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("options", "error", "message"),
    [
        (
            {"resoluton": 8},
            TypeError,
            r"make_mesh\(\) has no argument 'resoluton'; did you mean resolution\?",
        ),
        ({"thicknes": 1}, TypeError, r"did you mean thickness\?"),
        ({"res": 8}, TypeError, r"did you mean resolution\?"),
        ({"size": "8 bananas"}, SceneError, "size='8 bananas': expected a length"),
        ({"voxel": -1}, SceneError, "voxel=-1: expected a length above zero"),
        ({"voxel": 1, "resolution": 64}, SceneError, "voxel and resolution: expected one of them"),
        ({"thickness": "thick"}, SceneError, "thickness='thick': expected 0, or a length"),
        ({"threads": 0}, SceneError, "threads=0: expected"),
        ({"progress": True}, TypeError, "progress=True: expected a callable"),
        ({"cancel": 0}, TypeError, "cancel=0: expected a threading.Event"),
        ({"cancel": 3}, TypeError, "cancel=3: expected a threading.Event"),
    ],
)
def test_keywords_that_cannot_be_are_named(options: dict, error: type, message: str) -> None:
    with pytest.raises(error, match=message):
        make_mesh(SHAPE, **options)


def test_the_signature_lists_every_keyword() -> None:
    names = set(inspect.signature(make_mesh).parameters)
    assert set(Print.kinds()) == set(PrintKeywords.__annotations__) <= names
    assert {*MeshJob.kinds(), *Print.kinds(), *WorkKeywords.__annotations__} == {
        *MeshKeywords.__annotations__
    }
    assert set(MeshKeywords.__annotations__) <= names and "triangles are removed" in str(make_mesh.__doc__)
    assert set(WorkKeywords.__annotations__) <= {f.name for f in fields(Work)} & names


def test_progress_is_reported_and_work_is_cancelled() -> None:
    reported: list[tuple[str, float]] = []
    make_mesh(SHAPE, resolution=12, progress=lambda stage, share: reported.append((stage, share)))
    assert {"planning", "sampling", "meshing", "checking"} <= {stage for stage, _ in reported}
    assert all(0 <= share <= 1 for _, share in reported)
    stop = threading.Event()
    stop.set()
    with pytest.raises(Cancelled):
        make_mesh(SHAPE, resolution=12, cancel=stop)


def test_a_mesh_speaks_trimesh(made: Result) -> None:
    other = made.to_trimesh()
    assert np.array_equal(other.vertices, made.vertices) and np.array_equal(other.faces, made.faces)
    assert made.is_watertight and other.is_watertight
    assert made.volume == pytest.approx(other.volume, rel=1e-9)
    assert made.area == pytest.approx(other.area, rel=1e-9)
    assert np.array_equal(made.bounds, other.bounds)
    back = Mesh(other.vertices, other.faces)
    assert np.array_equal(back.vertices, made.vertices) and np.array_equal(back.triangles, made.triangles)
    other.vertices += 1  # a copy: the mesh stays as it is
    assert made.bounds[0, 2] == 0


@pytest.mark.parametrize("shape", ["box", "annulus", "icosphere"])
def test_watertight_is_what_it_is_to_trimesh(shape: str) -> None:
    solid = {
        "box": trimesh.creation.box,
        "annulus": lambda: trimesh.creation.annulus(1, 2, 1),
        "icosphere": trimesh.creation.icosphere,
    }[shape]()
    mesh = Mesh(solid.vertices, solid.faces)
    assert mesh.is_watertight
    assert not Mesh(solid.vertices, solid.faces[1:]).is_watertight
    assert not Mesh(solid.vertices, np.vstack([solid.faces, solid.faces[:1]])).is_watertight
    assert not Mesh(np.empty((0, 3)), np.empty((0, 3))).is_watertight


def test_a_mesh_speaks_pyvista(made: Result) -> None:
    pytest.importorskip("pyvista")
    surface = made.to_pyvista()
    assert np.array_equal(surface.points, made.vertices)
    assert np.array_equal(surface.regular_faces, made.triangles)
    assert surface.is_manifold and surface.volume == pytest.approx(made.volume, rel=1e-6)


def test_a_mesh_goes_to_a_file(made: Result, tmp_path: Path) -> None:
    path = made.export(tmp_path / "made.3mf", {"Title": "made"})
    assert np.array_equal(read_mesh(path).vertices[read_mesh(path).triangles], made.corners)
    with pytest.raises(ExportError, match="unknown kind of file"):
        made.export(tmp_path / "made.xyz")


def test_results_cannot_be_changed(made: Result) -> None:
    for array in (made.vertices, made.triangles, made.faces, made.mesh.vertices, made.bricks.values):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0
    for name in ("vertices", "report", "made", "colour"):
        with pytest.raises(FrozenInstanceError):
            setattr(made, name, None)
    with pytest.raises(FrozenInstanceError):
        sphere.lipschitz = 2.0  # type: ignore[misc]
    with pytest.raises(TypeError):
        made.report.seconds["total"] = 0.0  # type: ignore[index]
    assert made.report.as_dict()["seconds"]["total"] > 0


def test_a_mesh_leaves_the_callers_arrays_alone() -> None:
    vertices = np.eye(3)
    mesh = Mesh(vertices, np.array([[0, 1, 2]]))
    vertices[0] = 2
    assert vertices.flags.writeable and mesh.triangles.dtype == np.int32


def test_a_mesh_says_what_it_is(made: Result) -> None:
    assert repr(made).startswith("<Result of ") and repr(made).endswith(", 20 x 20 x 10>")


def test_a_report_is_shown_in_one_line() -> None:
    made = make_mesh(sphere(), size=20, resolution=16)
    assert repr(made.report) == "<Report of scene: 20 mm, voxel 1.25 mm, watertight, manifold>"


def test_a_result_is_pickled_and_copied() -> None:
    made = make_mesh(sphere(), resolution=16, colour="steps")
    for again in (pickle.loads(pickle.dumps(made)), copy.deepcopy(made)):
        assert repr(again) == repr(made) and again.report == made.report
        np.testing.assert_array_equal(again.vertices, made.vertices)
        np.testing.assert_array_equal(again.scalars["steps"], made.scalars["steps"])
        assert not again.vertices.flags.writeable
        with pytest.raises(TypeError):
            again.scalars["steps"] = made.scalars["steps"]
