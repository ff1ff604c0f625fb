"""Every format, read back by programs that did not write it."""

from __future__ import annotations

import io
import json
import struct
import subprocess
import sys
import zipfile
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from fracslice.common import files
from fracslice.common.arrays import concatenate
from fracslice.errors import ExportError, MeshError
from fracslice.formats import ENDINGS, write
from fracslice.mesh import Mesh
from fracslice.mesh.checks import check_mesh
from fracslice.mesh.cleaning import quantise_mesh
from fracslice.mesh.models import read_mesh
from fracslice.version import APPLICATION
from tests.examples import stamped
from tests.mesh.shapes import cube, inverted, sphere

METADATA = {"Title": 'A <sphere> & "more" é', "scene_hash": "ab12"}


@pytest.fixture
def mesh() -> Mesh:
    """A hollow sphere with coordinates that need all their digits."""
    return quantise_mesh(
        concatenate([sphere(10, at=(0.1, 1 / 3, 7)), inverted(sphere(4, at=(0.1, 1 / 3, 7)))])
    )


@pytest.mark.parametrize("ending", ENDINGS)
def test_comes_back_bit_by_bit(tmp_path: Path, mesh: Mesh, ending: str) -> None:
    path = write(mesh, tmp_path / f"model{ending}", METADATA)
    back = read_mesh(path)
    assert np.array_equal(back.corners, mesh.corners)
    assert check_mesh(back) == check_mesh(mesh)


@pytest.mark.parametrize("ending", stamped(ENDINGS, {".3mf", ".stl", ".obj"}))
def test_same_mesh_same_bytes_whatever_the_clock_says(tmp_path: Path, mesh: Mesh, ending: str) -> None:
    first = write(mesh, tmp_path / f"first{ending}", METADATA).read_bytes()
    code = (
        "import time; time.time = lambda: 2e9; time.localtime = lambda *_: time.gmtime(2e9)\n"
        "import sys; from fracslice.formats import write; from fracslice.mesh.models import read_mesh\n"
        f"write(read_mesh(sys.argv[1]), sys.argv[2], {METADATA!r})"
    )
    second = tmp_path / f"second{ending}"
    write(mesh, tmp_path / "source.ply")
    subprocess.run([sys.executable, "-c", code, tmp_path / "source.ply", second], check=True)
    assert second.read_bytes() == first


def test_stl_is_what_the_format_says(tmp_path: Path) -> None:
    data = write(cube(), tmp_path / "cube.stl").read_bytes()
    assert APPLICATION in data[:80].decode()
    assert b"mm" in data[:80]
    assert not data.startswith(b"solid")
    assert struct.unpack_from("<I", data, 80) == (12,)
    assert len(data) == 84 + 12 * 50
    records = np.frombuffer(data, np.dtype([("n", "<f4", 3), ("v", "<f4", (3, 3)), ("a", "<u2")]), offset=84)
    outward = np.sign((records["v"].mean(axis=1) - 5) * (abs(records["v"].mean(axis=1) - 5) > 4.9))
    assert np.array_equal(records["n"], outward)


def test_3mf_passes_lib3mf_in_strict_mode(tmp_path: Path, mesh: Mesh) -> None:
    lib3mf = pytest.importorskip("lib3mf")
    path = write(mesh, tmp_path / "model.3mf", METADATA)
    model = lib3mf.get_wrapper().CreateModel()
    reader = model.QueryReader("3mf")
    reader.SetStrictModeActive(True)
    reader.ReadFromFile(str(path))
    assert reader.GetWarningCount() == 0
    objects = model.GetMeshObjects()
    assert objects.MoveNext()
    assert objects.GetCurrentMeshObject().IsManifoldAndOriented()
    assert objects.GetCurrentMeshObject().GetTriangleCount() == len(mesh.triangles)
    group = model.GetMetaDataGroup()
    result = {
        group.GetMetaData(i).GetName(): group.GetMetaData(i).GetValue()
        for i in range(group.GetMetaDataCount())
    }
    assert result["Title"] == METADATA["Title"]
    assert result["scene_hash"] == "ab12"
    assert result["Application"] == APPLICATION


@pytest.mark.parametrize("is_large", [False, True])
def test_blocks_of_a_3mf_model_are_joined(is_large: bool) -> None:
    """Deflated by themselves, as tasks of a cluster do; also with the header of one of more than 2 GiB."""
    texts = [b"<model>", b"", bytes(range(256)) * 999, b"</model>"]
    file = io.BytesIO()
    files.join(file, (partial(files.append, files.deflate(text)) for text in texts), is_large)
    with zipfile.ZipFile(file) as archive:
        assert archive.testzip() is None
        assert archive.read("3D/3dmodel.model") == b"".join(texts)
        assert archive.namelist() == ["[Content_Types].xml", "_rels/.rels", "3D/3dmodel.model"]


def test_3mf_members_carry_no_time(tmp_path: Path) -> None:
    with zipfile.ZipFile(write(cube(), tmp_path / "cube.3mf")) as archive:
        assert {entry.date_time for entry in archive.infolist()} == {(1980, 1, 1, 0, 0, 0)}


def test_glb_stands_upright_in_metres(tmp_path: Path) -> None:
    import trimesh

    tall = Mesh(cube(10).vertices * (1, 2, 3), cube().triangles)
    scene = trimesh.load_scene(write(tall, tmp_path / "tall.glb", METADATA))
    assert scene.extents == pytest.approx([0.01, 0.03, 0.02])
    data = (tmp_path / "tall.glb").read_bytes()
    document = json.loads(data[20 : 20 + struct.unpack_from("<I", data, 12)[0]])
    assert document["asset"]["extras"]["Title"] == METADATA["Title"]


def test_extreme_coordinates_survive_text(tmp_path: Path) -> None:
    values = np.array([1e-38, -1e-30, 16777217.0, 3.4e38, 1 / 3, -0.1, 123456.789], np.float32).astype(float)
    mesh = Mesh(
        np.stack([values, np.roll(values, 1), np.roll(values, 2)], axis=1), np.array([[0, 1, 2]], np.int32)
    )
    for ending in (".3mf", ".obj"):
        back = read_mesh(write(mesh, tmp_path / f"extreme{ending}"))
        assert np.array_equal(back.corners, mesh.corners)


@pytest.mark.parametrize("far", [np.nan, np.inf, 1e39])
@pytest.mark.parametrize("ending", ENDINGS)
def test_invalid_meshes_are_not_written(tmp_path: Path, far: float, ending: str) -> None:
    mesh = cube()
    with pytest.raises(ExportError, match="not a finite number of 32 bits"):
        write(Mesh(mesh.vertices + far, mesh.triangles), tmp_path / f"far{ending}")
    with pytest.raises(ExportError, match="names a vertex that does not exist"):
        write(Mesh(mesh.vertices, mesh.triangles - 1), tmp_path / f"gap{ending}")
    assert not list(tmp_path.iterdir())


def test_arrays_of_another_shape_are_no_mesh() -> None:
    with pytest.raises(MeshError, match=r"vertices: expected an array \[n, 3\], found one of shape \[8, 2\]"):
        Mesh(cube().vertices[:, :2], cube().triangles)
    with pytest.raises(MeshError, match=r"triangles: expected .* of shape \[0\]"):
        Mesh(cube().vertices, [])  # type: ignore[arg-type]


def test_unknown_ending_and_empty_mesh(tmp_path: Path) -> None:
    with pytest.raises(ExportError, match=r"known are \.3mf, \.glb"):
        write(cube(), tmp_path / "cube.step")
    with pytest.raises(ExportError, match="no triangles"):
        write(Mesh(np.zeros((0, 3)), np.zeros((0, 3), np.int32)), tmp_path / "empty.stl")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("ending", ENDINGS)
@pytest.mark.parametrize("part", [0.0, 0.3, 0.5, 0.95])
def test_a_file_cut_off_is_one_clear_line(tmp_path: Path, mesh: Mesh, ending: str, part: float) -> None:
    whole = write(mesh, tmp_path / f"whole{ending}").read_bytes()
    cut = tmp_path / f"cut{ending}"
    cut.write_bytes(whole[: int(part * len(whole))])
    if ending == ".obj" and part > 0:  # text without an end: what is there is a mesh, but not a closed one
        assert not check_mesh(read_mesh(cut)).printable if part > 0.5 else True
        return
    with pytest.raises(MeshError) as failure:
        read_mesh(cut)
    assert str(failure.value).startswith(str(cut))
    assert "\n" not in str(failure.value)
