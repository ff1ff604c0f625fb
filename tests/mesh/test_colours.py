"""Colours and scalars of vertices: as in pictures, in files and in other libraries."""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np
import pytest
from fracslice.cli.main import run

from fracslice import make_mesh
from fracslice.common.files import RELATIONS
from fracslice.errors import MeshError, SceneError
from fracslice.formulas import julia, mandelbox, material, sphere, transform, union
from fracslice.mesh import Mesh
from fracslice.mesh.models import read_coloured
from fracslice.rendering.materials import paint
from fracslice.work import Work

pytestmark = pytest.mark.once

RED, BLUE = (0.9, 0.1, 0.2), (0.1, 0.2, 0.8)
TWO = union(
    material(sphere(radius=1), colour=RED),
    transform(material(sphere(radius=1), colour=BLUE), translate=(1.5, 0, 0)),
)


@pytest.fixture(scope="module")
def two() -> Mesh:
    return make_mesh(TWO, size="20mm", resolution=16, colour="material").mesh


def test_vertices_have_the_colours_of_their_materials(two: Mesh) -> None:
    assert two.colours is not None
    left = two.vertices[:, 0] < two.vertices[:, 0].mean() - 0.2
    right = two.vertices[:, 0] > two.vertices[:, 0].mean() + 0.2
    assert (two.colours[left] == np.rint(255 * np.array(RED))).all()
    assert (two.colours[right] == np.rint(255 * np.array(BLUE))).all()
    assert set(two.scalars["material"][left]) == {1.0} and set(two.scalars["material"][right]) == {2.0}


def test_steps_are_counted_and_coloured() -> None:
    points = np.random.default_rng(0).uniform(-1, 1, (3000, 3))
    done = paint(julia(c=(0, 0, 0, 0), iterations=6), points, "steps", Work())
    r, counted = np.linalg.norm(points, axis=1), np.zeros(3000)
    for k in range(6):
        counted += r ** (2**k) < 16.0
    assert np.allclose(done.scalars["steps"], counted / 16)
    assert len(np.unique(done.colours, axis=0)) == len(np.unique(counted))
    again = paint(
        material(julia(c=(0, 0, 0, 0), iterations=6), palette="viridis", trap="steps"),
        points,
        "material",
        Work(threads=2),
    )
    assert np.array_equal(again.colours, done.colours)


@pytest.mark.parametrize("trap", ["point", "axes", "sphere"])
def test_distances_of_an_orbit_beyond_1_have_colours_of_their_own(trap: str) -> None:
    points = np.random.default_rng(0).uniform(-2, 2, (500, 3))
    done = paint(mandelbox(scale=-1.5, iterations=3, julia=(2, 1, -1)), points, trap, Work())
    distant = done.scalars[trap] > 1
    assert distant.sum() > 100
    assert len(np.unique(done.scalars[trap][distant])) > 50 < len(np.unique(done.colours[distant], axis=0))
    assert set(paint(sphere(), points, trap, Work()).scalars[trap]) == {1.0}


def test_other_meshes_of_a_mesh_keep_them(two: Mesh) -> None:
    for other in (two.in_order(), two.translated((1, 2, 3)), two.scaled(2.0)):
        assert other.colours is not None and len(other.colours) == len(other.vertices)
    ordered = two.in_order()
    assert np.array_equal(ordered.colours[ordered.triangles], two.colours[two.triangles])  # type: ignore[index]
    half = two.selected(two.corners[:, :, 0].max(axis=1) < two.vertices[:, 0].mean() - 0.2)
    assert (half.scalars["material"] == 1).all() and len(half.vertices) < len(two.vertices)


def test_files_hold_them(two: Mesh, tmp_path: Path) -> None:
    import trimesh

    ordered = two.in_order()
    ply = trimesh.load_mesh(two.export(tmp_path / "two.ply"), process=False)
    assert np.array_equal(ply.visual.vertex_colors[:, :3], ordered.colours)
    glb = trimesh.load_mesh(two.export(tmp_path / "two.glb"), process=False)
    light = ((np.array(RED) + 0.055) / 1.055) ** 2.4
    assert abs(glb.visual.vertex_colors[:, :3] / 255 - light).max(axis=1).min() < 0.01
    data = (tmp_path / "two.ply").read_bytes()
    assert b"property float material" in data and b"property float trap" in data
    assert b"_material" in (tmp_path / "two.glb").read_bytes().lower()


def test_3mf_by_lib3mf(two: Mesh, tmp_path: Path) -> None:
    lib3mf = pytest.importorskip("lib3mf")
    model = lib3mf.get_wrapper().CreateModel()
    reader = model.QueryReader("3mf")
    reader.SetStrictModeActive(True)
    reader.ReadFromFile(str(two.export(tmp_path / "two.3mf")))
    assert reader.GetWarningCount() == 0
    objects, groups = model.GetMeshObjects(), model.GetColorGroups()
    assert objects.MoveNext() and groups.MoveNext()
    solid, group = objects.GetCurrentMeshObject(), groups.GetCurrentColorGroup()
    ordered = two.in_order()
    for k in (0, len(two.triangles) // 2, len(two.triangles) - 1):
        properties = solid.GetTriangleProperties(k)
        for corner in range(3):
            colour = group.GetColor(properties.PropertyIDs[corner])
            expected = ordered.colours[ordered.triangles[k, corner]]  # type: ignore[index]
            assert (colour.Red, colour.Green, colour.Blue) == tuple(expected)


def test_libraries_get_them(two: Mesh) -> None:
    solid = two.to_trimesh()
    assert np.array_equal(solid.visual.vertex_colors[:, :3], two.colours)
    assert np.array_equal(solid.vertex_attributes["material"], two.scalars["material"])
    pytest.importorskip("pyvista")
    surface = two.to_pyvista()
    assert np.array_equal(surface.point_data["RGB"], two.colours)
    assert np.array_equal(surface.point_data["trap"], two.scalars["trap"])


def test_edited_objects_are_coloured(two: Mesh) -> None:
    made = make_mesh(TWO, size="20mm", resolution=16, colour="material", raft="2mm")
    assert len(made.scalars["trap"]) == len(made.vertices)
    raft = (204, 204, 204)  # in no material
    assert {tuple(c) for c in made.colours} == {tuple(c) for c in two.colours} | {raft}  # type: ignore[union-attr]


def test_the_command_and_what_it_refuses(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    args = ["mesh", "menger-sponge", "--resolution", "16", "--quiet", "--colour", "steps", "-o"]
    assert run([*args, str(tmp_path / "a.ply")]) == 0
    assert b"property uchar red" in (tmp_path / "a.ply").read_bytes()
    assert run([*args, str(tmp_path / "a.stl")]) == 2
    assert "colour: expected a file that holds colours: .3mf, .glb, .ply" in capsys.readouterr().err
    assert not (tmp_path / "a.stl").exists()
    with pytest.raises(SceneError, match="colour='red': expected material, point"):
        make_mesh(sphere(), size="1cm", resolution=8, colour="red")  # type: ignore[arg-type]


def test_colours_are_read_back(two: Mesh, tmp_path: Path) -> None:
    """By `show`: of vertices, and in .3mf files of corners: a vertex has one for each colour."""
    assert two.colours is not None
    for name in ("two.ply", "two.glb", "two.3mf"):
        read = read_coloured(two.export(tmp_path / name))
        assert read.colours is not None and read.volume == pytest.approx(two.volume, rel=1e-5)
        off = read.colours[read.triangles].astype(int) - two.colours[two.triangles]
        assert np.abs(off).max() <= (3 if name == "two.glb" else 0)  # linear light in bytes
    plain = read_coloured(Mesh(two.vertices, two.triangles).export(tmp_path / "plain.3mf"))
    assert plain.colours is None and len(plain.vertices) == len(two.vertices)


def test_show_opens_on_coloured_files(two: Mesh, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    meshes: list[Mesh] = []
    monkeypatch.setattr("fracslice.viewer.show", meshes.append)
    assert run(["show", str(two.export(tmp_path / "two.3mf"))]) == 0
    assert meshes[0].colours is not None
    assert len(np.unique(meshes[0].colours, axis=0)) == len(np.unique(two.colours, axis=0))


def test_a_file_with_bad_colours_is_one_line(tmp_path: Path) -> None:
    text = [f'<vertex x="{x}" y="{y}" z="0"/>' for x, y in ((0, 0), (1, 0), (0, 1))]
    rows = '<triangle v1="0" v2="1" v3="2" pid="2" p1="9"/>'
    head = '<m:colorgroup id="2"><m:color color="#zz0000"/></m:colorgroup>'
    mesh = f"<mesh><vertices>{''.join(text)}</vertices><triangles>{rows}</triangles></mesh>"
    model = f'<resources>{head}<object id="1">{mesh}</object></resources><build><item objectid="1"/></build>'
    for broken in (True, False):
        own = model if broken else model.replace("#zz0000", "#aa0000")
        with zipfile.ZipFile(tmp_path / "x.3mf", "w") as file:
            file.writestr("_rels/.rels", RELATIONS)
            file.writestr("3D/3dmodel.model", f'<model xmlns:m="m">{own}</model>')
        if broken:
            with pytest.raises(MeshError, match="not a valid 3MF file"):
                read_coloured(tmp_path / "x.3mf")
        else:
            assert read_coloured(tmp_path / "x.3mf").colours is None  # no such colour in the group
