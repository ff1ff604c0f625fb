"""``fracslice plate`` and ``--copies`` as a person meets them."""

from __future__ import annotations

import re
import zipfile
from pathlib import Path

import numpy as np
import pytest
from fracslice.cli.main import run
from PIL import Image
from scipy.ndimage import label

from fracslice.mesh.models import read_mesh
from tests.export import readers

pytestmark = pytest.mark.once

MARS = ["--printer", "mars-5", "--layer", "4mm", "--threads", "1"]


def test_copies_are_what_one_is(ball: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    one, four = tmp_path / "one.goo", tmp_path / "four.goo"
    assert run(["slice", str(ball), "-o", str(one), *MARS]) == 0
    assert run(["slice", str(ball), "-o", str(four), "--copies", "4", *MARS]) == 0
    assert "four.goo: 4 parts, 5 layers" in capsys.readouterr().out
    alone, whole = (readers.goo(path.read_bytes()) for path in (one, four))
    assert whole.tops == alone.tops
    for small, large in zip(alone.pictures, whole.pictures, strict=True):
        assert label(large)[1] == 4
        assert int(large.sum(dtype=np.int64)) == 4 * int(small.sum(dtype=np.int64))
    assert whole.about["volume"] == pytest.approx(4 * alone.about["volume"])


def test_meshes_of_a_plate(ball: Path, tmp_path: Path) -> None:
    """A .3mf file holds each mesh once; other files hold all triangles. Both are one plate, in its middle."""
    given = [
        "plate",
        str(ball),
        str(ball),
        "-o",
        "",
        "--bed",
        "60x50x30mm",
        "--resolution",
        "24",
        "--threads",
        "1",
    ]
    volume = 4 / 3 * np.pi * 10**3
    for ending in ("3mf", "stl"):
        given[4] = str(tmp_path / f"two.{ending}")
        assert run(given) == 0
        mesh = read_mesh(given[4])
        assert mesh.to_trimesh().volume == pytest.approx(2 * volume, rel=0.02)
        assert mesh.to_trimesh().is_watertight
        low, high = mesh.vertices.min(0), mesh.vertices.max(0)
        assert (low + high)[:2] / 2 == pytest.approx([30, 25], abs=0.5)
        assert high[0] - low[0] == pytest.approx(42, abs=1.5)
    archive = zipfile.ZipFile(tmp_path / "two.3mf")
    assert Image.open(archive.open("Metadata/thumbnail.png")).size == (480, 360)
    text = archive.read("3D/3dmodel.model").decode()
    assert (text.count("<object "), text.count("<item ")) == (1, 2)


def test_lib3mf_reads_a_plate_in_strict_mode(ball: Path, tmp_path: Path) -> None:
    lib3mf = pytest.importorskip("lib3mf")
    path = tmp_path / "three.3mf"
    given = ["-o", str(path), "--copies", "3", "--resolution", "16", "--threads", "1"]
    assert run(["plate", str(ball), *given]) == 0
    model = lib3mf.get_wrapper().CreateModel()
    reader = model.QueryReader("3mf")
    reader.SetStrictModeActive(True)
    reader.ReadFromFile(str(path))
    assert reader.GetWarningCount() == 0
    assert model.GetBuildItems().Count() == 3
    assert model.GetMeshObjects().Count() == 1
    assert model.HasPackageThumbnailAttachment()


def test_copies_of_a_mesh(ball: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Their amounts add up in the summary."""
    path, given = tmp_path / "four.3mf", ["--material", "pla", "--price", "100", "--resolution", "16"]
    assert run(["mesh", str(ball), "-o", str(path), "--copies", "4", "--threads", "1", *given]) == 0
    first, _, _, one, *_ = capsys.readouterr().out.splitlines()
    assert first.startswith(f"{path}: 4 parts, ")
    volumes = [float(v) for v in re.findall(r"(\S+) ml", f"{first} {one}")]
    assert volumes[0] == pytest.approx(4 * volumes[1], rel=1e-2)
    assert float(first.split()[-1]) == pytest.approx(volumes[0] * 0.124, abs=0.02)
    assert zipfile.ZipFile(path).read("3D/3dmodel.model").count(b"<item ") == 4


@pytest.mark.parametrize(
    ("options", "reported"),
    [
        (["-o", "p.goo", *MARS, "--copies", "90"], "of 90 parts fit: expected fewer parts"),
        (["-o", "p.goo", *MARS, "--bed", "60x50mm"], "--bed and --printer: expected one of them"),
        (["-o", "p.goo", *MARS, "--voxel", "1mm"], "--voxel: only for meshes"),
        (["-o", "p.goo", *MARS, "--layer", "0.1mm..0.5mm"], "layers of one height"),
        (["-o", "p.stl", "--layer", "1mm"], "--layer: only for layers"),
        (
            ["-o", "p.stl", "--bed", "60"],
            "'60': expected three lengths such as 220x220x250mm, or",
        ),
        (["-o", "p.stl", "--bed", "19x50mm"], "no room for it on the bed"),
        (["-o", "p.stl", "--bed", "50x50x10mm", "--resolution", "24"], " mm high, the bed has 10 mm"),
        (["-o", "p.stl", "--copies", "0"], "0 is not in the range"),
    ],
)
def test_bad_input_is_one_line(
    options: list[str],
    reported: str,
    ball: Path,
    tmp_path: Path,
    capfd: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run(["plate", str(ball), *options]) == 2
    error = capfd.readouterr().err
    assert error.startswith("fracslice: ")
    assert error.count("\n") == 1
    assert reported in error
    assert [path.name for path in tmp_path.iterdir()] == ["ball.xml"]
