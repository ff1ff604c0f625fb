"""Shards of a job without a scheduler."""

from __future__ import annotations

import threading
import zipfile
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path

import pytest
from fracslice.cli.main import run as command

from fracslice.cluster import ResultFolder, Shard
from fracslice.common import files
from fracslice.errors import ClusterError, SharedError
from fracslice.export.layers import write_slices
from fracslice.export.slice_run import RangeTask
from fracslice.formulas import box, cone, flake, sphere
from fracslice.jobs import shared
from fracslice.jobs.mesh import Result, make_mesh
from fracslice.mesh import shells
from fracslice.records import MeshJob
from fracslice.rendering import progressive
from fracslice.scene import scene
from fracslice.volume import sampler
from fracslice.work import Work

from .test_cluster import RECIPE, rendered, sliced

pytestmark = pytest.mark.once

pytest.importorskip("fsspec")


@pytest.fixture
def line(tmp_path: Path) -> list[str]:
    (tmp_path / "bulb.xml").write_text(RECIPE.scene)
    return [
        "slice",
        str(tmp_path / "bulb.xml"),
        "-o",
        str(tmp_path / "b.cli"),
        "--layer",
        "0.1mm",
        "--pixel",
        "0.05mm",
    ]


def test_shards_of_layers_make_one_file(
    line: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Each range is made once: what writes beside the pieces does not take them for leftovers."""
    made, make = list[str](), RangeTask.make
    monkeypatch.setattr(RangeTask, "make", lambda of, work: (made.append(of.name), make(of, work))[1])
    for number in (2, 3):
        assert command([*line, "--shard", f"{number}/3", "--quiet"]) == 0
        assert "shard 1 writes the file" in capsys.readouterr().err
        assert not (tmp_path / "b.cli").exists()
    assert command([*line, "--shard", "1/3", "--quiet"]) == 0
    assert len(made) == len(set(made)) > 8
    assert (tmp_path / "b.cli").read_bytes() == sliced(Work(2), tmp_path)


def test_a_shard_makes_what_others_leave(tmp_path: Path) -> None:
    """It waits for them once."""
    shard, waits = Shard(ResultFolder(str(tmp_path / "pieces")), 1, 3, patience=0.3), list[float]()

    class Event(threading.Event):
        def wait(self, timeout: float | None = None) -> bool:
            waits.append(timeout or 0.0)
            return super().wait(timeout)

    made = list(shard.made([Nothing(f"nothing-{n}") for n in range(12)], Work(1, cancel=Event())))
    assert sorted(made) == list(range(12)) and 0 < len(waits) < 4
    run = RECIPE.run(Work(1, cluster=replace(shard, patience=0)))
    write_slices(run, tmp_path / "b.cli")
    assert (tmp_path / "b.cli").read_bytes() == sliced(Work(2), tmp_path)


@dataclass(frozen=True)
class Nothing:
    """Task without work."""

    name: str
    job: str = "nothing"

    def make(self, _: Work) -> bytes:
        """Nothing."""
        return b""


def test_shards_of_a_mesh_make_one_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Tips and dust included; the other shard ends when its pieces are made. Borders are joined by tasks.

    Tasks write the triangles to their places: the file is the one that they wrote, under another name.
    """
    monkeypatch.setattr(shared, "LEAST", 1)
    monkeypatch.setattr(shared, "FIRST", 7)
    monkeypatch.setattr(shared, "ROWS", 1000)
    monkeypatch.setattr(files, "append_file", None)
    places, place = list[int](), shared.Place.result
    monkeypatch.setattr(shared.Place, "result", lambda of, n, work: (places.append(n), place(of, n, work))[1])
    monkeypatch.setattr(shells, "FAN", 2)
    joins, join = list[str](), shared.JoinTask.make
    monkeypatch.setattr(shared.JoinTask, "make", lambda of, work: (joins.append(of.name), join(of, work))[1])
    shape = cone(radius=0.5, height=2.0) | sphere(radius=0.05).translate((0.8, 0.0, 0.0))
    turned = scene(shape.rotate(70.0, (0.0, 1.0, 0.2)), size="20mm")
    job = MeshJob(resolution=32, dust=2.0)
    shards = [Shard(ResultFolder(str(tmp_path / "pieces")), number, 2) for number in (1, 2)]
    paths = {number: tmp_path / f"{number}.stl" for number in (0, 1, 2)}

    def made(shard: Shard | None) -> Result | None:
        number = shard.number if shard else 0
        try:
            return make_mesh(turned, job, Work(1, cluster=shard), paths[number])
        except SharedError:
            return None

    with ThreadPoolExecutor(2) as pool:
        first, second = pool.map(made, shards)
    whole = made(None)
    assert first and whole and second is None
    assert not paths[2].exists()
    assert len(places) == len(set(places)) == -(-(whole.report.mesh.triangles - 7) // 1000) > 3
    assert paths[1].stat().st_nlink == 2
    assert sorted(joins) == [
        f"joined-{level}-0000{n}" for level, n in ((1, 0), (1, 1), (1, 2), (2, 0), (2, 1))
    ]
    assert paths[1].read_bytes() == paths[0].read_bytes()
    assert len(whole.whole.vertices) == first.report.mesh.vertices
    for part in ("mesh", "removed"):
        ours, theirs = (dict(vars(getattr(result.report, part))) for result in (first, whole))
        assert ours.pop("bbox_mm", None) == theirs.pop("bbox_mm", None)
        assert ours == pytest.approx(theirs)
    assert first.report.surface_error_mm.max == pytest.approx(whole.report.surface_error_mm.max)
    assert first.report.surface_to_mesh_mm.max == pytest.approx(whole.report.surface_to_mesh_mm.max)


def test_other_formats_are_joined(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shared, "LEAST", 1)
    hollowed, job = scene(box() - sphere(radius=0.6), size="20mm"), MeshJob(resolution=16)
    shard = Shard(ResultFolder(str(tmp_path / "pieces")), 1, 1)
    one, two = (tmp_path / f"{name}.ply" for name in ("one", "two"))
    make_mesh(hollowed, job, Work(1), one)
    joined = make_mesh(hollowed, job, Work(1, cluster=shard), two)
    assert one.read_bytes() == two.read_bytes()
    assert joined.mesh.is_watertight


def test_a_3mf_file_is_concatenated(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """By two shards; vertices at seams and at a tip's triangles, which come last, are numbered once."""
    monkeypatch.setattr(shared, "LEAST", 1)
    monkeypatch.setattr(files, "ROWS", 256)
    monkeypatch.setattr(shared, "BLOCKS", 2)
    monkeypatch.setattr(shared, "joined_pieces", None)
    turned = scene(cone(radius=0.5, height=2.0).rotate(70.0, (0.0, 1.0, 0.2)), size="20mm")
    shards = [Shard(ResultFolder(str(tmp_path / "pieces")), number, 2, patience=600) for number in (1, 2)]
    targets, made = {number: tmp_path / f"{number}.3mf" for number in (0, 1, 2)}, list[str]()
    encode = shared.Encode.result
    monkeypatch.setattr(
        shared.Encode,
        "result",
        lambda of, n, work: (made.append(f"{of.name}-{n}"), encode(of, n, work))[1],
    )

    def made_by(shard: Shard) -> str:
        try:
            make_mesh(turned, MeshJob(resolution=32), Work(1, cluster=shard), targets[shard.number])
        except SharedError as error:
            return str(error)
        return ""

    with ThreadPoolExecutor(2) as pool:
        first, second = pool.map(made_by, shards)
    make_mesh(turned, MeshJob(resolution=32), Work(1), targets[0])
    assert first == "" and second.startswith("this shard made ") and "pieces; shard 1 writes" in second
    one, other = (zipfile.ZipFile(targets[k]) for k in (0, 1))
    assert set(one.namelist()) - set(other.namelist()) == {"Metadata/thumbnail.png"}  # of a mesh in memory
    assert one.read("3D/3dmodel.model") == other.read("3D/3dmodel.model")
    assert not targets[2].exists()
    assert len(made) == len(set(made)) > 8
    with zipfile.ZipFile(targets[1]) as archive:
        assert archive.testzip() is None
        assert archive.read("3D/3dmodel.model").count(b"<vertex ") > 4 * 256


def test_what_needs_the_whole_mesh_is_sampled_by_all(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Chord and simplification are of the whole mesh, so shard 1 makes them of the shared samples."""
    monkeypatch.setattr(sampler, "MANY_BRICKS", 1)
    monkeypatch.setattr(shared, "BRICKS", 8)
    ball, job = scene(sphere(), size="20mm"), MeshJob(resolution=16, chord=0.2, simplify=0.3)
    pieces, made = ResultFolder(str(tmp_path / "pieces")), list[str]()
    write = ResultFolder.write
    monkeypatch.setattr(
        ResultFolder, "write", lambda of, job, name, data: (made.append(name), write(of, job, name, data))
    )
    with pytest.raises(SharedError, match="shard 1 makes the mesh"):
        make_mesh(ball, job, Work(1, cluster=Shard(pieces, 2, 2, patience=0)), tmp_path / "two.stl")
    make_mesh(ball, job, Work(1, cluster=Shard(pieces, 1, 2, patience=0)), tmp_path / "one.stl")
    make_mesh(ball, job, Work(1), tmp_path / "alone.stl")
    assert (tmp_path / "one.stl").read_bytes() == (tmp_path / "alone.stl").read_bytes()
    assert not (tmp_path / "two.stl").exists()
    samples = [name for name in made if name.startswith("samples")]
    assert len(samples) > 2 and len(set(samples)) == len(samples), "made once"


def test_shards_of_a_frame_work_at_the_same_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(progressive, "PIXELS", 1024)
    shards = [Shard(ResultFolder(str(tmp_path / "pieces")), number, 2) for number in (1, 2)]
    with ThreadPoolExecutor(2) as pool:
        sums = list(pool.map(lambda shard: rendered(Work(1, cluster=shard), tmp_path), shards))
    assert sums == [rendered(Work(2), tmp_path)] * 2


@pytest.mark.parametrize("text", ["0/3", "4/3", "3", "a/b", "1/0"])
def test_bad_shards(text: str, line: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(ClusterError, match="such as 3/64"):
        Shard.read(text, ResultFolder("x"))
    assert command([*line, "--shard", text]) != 0
    assert "such as 3/64" in capsys.readouterr().err


def test_options_that_exclude_each_other(line: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert command([*line, "--shard", "1/2", "--cluster", "local"]) == 2
    assert command([*line, "--store", "x"]) == 2
    assert command([*line, "--cluster", "local:x"]) != 0
    assert "expected local, local:N" in capsys.readouterr().err


@pytest.mark.nightly
def test_a_shared_has_the_note_on_near_bodies(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In a file of pieces, whose bodies meet in pieces and over seams."""
    monkeypatch.setattr(shared, "LEAST", 1)
    flakes = scene(flake(solid="tetrahedron", level=1), size="40mm", name="flakes")
    shard = Shard(ResultFolder(str(tmp_path / "pieces")), 1, 1, patience=0)
    joined, alone = (
        make_mesh(flakes, MeshJob(resolution=32), work, tmp_path / "a.stl")
        for work in (Work(1, cluster=shard), Work(1))
    )
    assert joined.report.notes == alone.report.notes and "two voxels" in joined.report.notes[0]
