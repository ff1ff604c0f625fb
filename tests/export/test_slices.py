"""Layer formats read back, by lib3mf where it can; interrupted jobs go on; bad targets leave nothing."""

from __future__ import annotations

import atexit
import io
import json
import os
import shutil
import struct
import tempfile
import threading
import xml.etree.ElementTree as ET
import zipfile
from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from fracslice.errors import Cancelled, ExportError, FracsliceWarning
from fracslice.export import images, layer_formats, resuming
from fracslice.export.layers import FORMATS, slice_format, write_slices
from fracslice.export.resuming import Journal, journal, resumable_folder
from fracslice.export.slice_run import SliceRun
from fracslice.formulas import Node, difference, menger, sphere
from fracslice.jobs.slices import StackModel
from fracslice.scene import scene
from fracslice.slicing import SliceJob, Slicer, plan_stack
from fracslice.slicing.printers import Printer, Resin
from fracslice.slicing.raster import Screen
from fracslice.work import Work

pytestmark = pytest.mark.once

MACHINE = Printer("test", "Test", (96, 80), (24.0, 20.0), 30, portrait=True)
ROOT = difference(menger(level=1), sphere(radius=0.9))


def run(work: Work | None = None, layer: float = 0.5, root: Node = ROOT) -> SliceRun:
    job = SliceJob(size=12, layer=layer, pixel=MACHINE.pixel)
    stack = plan_stack(root, job)
    how, work = Screen(stack, printer=MACHINE), work or Work()
    mesh = StackModel(scene(root, size=12), job, Work()).mesh
    return SliceRun(stack, how, work, Resin(2, 20), {"Title": "test"}, mesh)


@pytest.fixture(scope="module")
def areas() -> np.ndarray:
    return np.array(list(Slicer(run().stack).map(lambda layer: layer.contours.area)))


def shoelace(points: np.ndarray) -> float:
    x, y = points.T
    return float(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1))) / 2


def test_png_is_what_pillow_reads() -> None:
    image = np.random.default_rng(0).integers(0, 256, (37, 101), np.uint8)
    data = images.encode(image)
    with Image.open(io.BytesIO(data)) as read:
        assert read.mode == "L"
        assert (np.asarray(read) == image).all()


@pytest.mark.parametrize("name", FORMATS)
def test_the_same_bytes_every_time(name: str, tmp_path: Path) -> None:
    paths = [write_slices(run(Work(threads=n)), tmp_path / f"{n}", name) for n in (1, 3)]
    if name == "sl1":
        return  # names of members follow the file's
    files = [sorted(p.iterdir()) if p.is_dir() else [p] for p in paths]
    assert [f.read_bytes() for f in files[0]] == [f.read_bytes() for f in files[1]]
    assert sorted(f.name for f in tmp_path.iterdir()) == ["1", "3"]


def test_sl1(tmp_path: Path) -> None:
    job = run()
    with zipfile.ZipFile(write_slices(job, tmp_path / "part.sl1")) as archive:
        assert archive.testzip() is None
        config = dict(line.split(" = ") for line in archive.read("config.ini").decode().splitlines())
        settings = dict(line.split(" = ") for line in archive.read("prusaslicer.ini").decode().splitlines())
        pictures = [n for n in archive.namelist() if n.startswith("part")]
        assert config["layerHeight"] == "0.5"
        assert config["numFast"] == "24"
        assert config["jobDir"] == "part"
        assert config["fileCreationTimestamp"] == "1980-01-01 at 00:00:00 UTC"
        area = sum(job.slicer.map(lambda layer: layer.area))
        assert float(config["usedMaterial"]) == pytest.approx(area * 0.5 / 1000, rel=1e-3)
        for width, height in ((400, 400), (800, 480)):
            with Image.open(io.BytesIO(archive.read(f"thumbnail/thumbnail{width}x{height}.png"))) as image:
                assert image.size == (width, height)
        assert settings["display_pixels_x"] == "96"
        assert settings["display_orientation"] == "portrait"
        assert pictures == [f"part{k:05d}.png" for k in range(24)]
        manifest = json.loads(archive.read("fracslice.json"))
        assert [layer["file"] for layer in manifest["layers"]] == pictures
        assert manifest["mirror"] is (settings["display_mirror_x"] == "1") is True
        with Image.open(io.BytesIO(archive.read(pictures[3]))) as image:
            assert image.size == (80, 96)
            assert image.mode == "L"
            assert (np.asarray(image) == list(job.slicer.map(job.screen.picture))[3]).all()


def test_folder_and_manifest(tmp_path: Path) -> None:
    folder = write_slices(run(), tmp_path / "layers")
    reported = json.loads((folder / "manifest.json").read_text())
    names = [layer["file"] for layer in reported["layers"]]
    assert sorted(p.name for p in folder.iterdir()) == [*names, "manifest.json"]
    assert reported["layers"][-1]["top_mm"] == 12.0
    assert reported["pixels"] == [80, 96]
    assert reported["pixel_mm"] == [0.25, 0.25]


def test_3mf_by_lib3mf(tmp_path: Path, areas: np.ndarray) -> None:
    lib3mf = pytest.importorskip("lib3mf")
    path = write_slices(run(), tmp_path / "part.3mf")
    model = lib3mf.get_wrapper().CreateModel()
    reader = model.QueryReader("3mf")
    reader.SetStrictModeActive(True)
    reader.ReadFromFile(str(path))
    assert reader.GetWarningCount() == 0
    stacks = model.GetSliceStacks()
    assert stacks.MoveNext()
    stack = stacks.GetCurrentSliceStack()
    result = []
    for k in range(stack.GetSliceCount()):
        layer = stack.GetSlice(k)
        points = np.array([tuple(v.Coordinates) for v in layer.GetVertices()])
        rings = [list(layer.GetPolygonIndices(i)) for i in range(layer.GetPolygonCount())]
        assert all(ring[0] == ring[-1] for ring in rings)
        result.append(sum(shoelace(points[ring[:-1]]) for ring in rings))
        assert layer.GetZTop() == pytest.approx(0.5 * (k + 1))
    np.testing.assert_allclose(result, areas, rtol=1e-5)


def test_3mf_holds_the_object_itself(tmp_path: Path, areas: np.ndarray) -> None:
    """For programs that do not read slices: its mesh, of the same volume, where the slices are."""
    with zipfile.ZipFile(write_slices(run(), tmp_path / "part.3mf")) as archive:
        model = ET.fromstring(archive.read("3D/3dmodel.model"))
    result = model.find(".//{*}object")
    assert result is not None
    assert (
        result.attrib["{http://schemas.microsoft.com/3dmanufacturing/slice/2015/07}meshresolution"]
        == "fullres"
    )
    points = np.array([[float(v.attrib[a]) for a in "xyz"] for v in result.iterfind(".//{*}vertex")])
    corners = points[
        [[int(t.attrib[v]) for v in ("v1", "v2", "v3")] for t in result.iterfind(".//{*}triangle")]
    ]
    volume = np.linalg.det(corners).sum() / 6
    assert volume == pytest.approx(0.5 * areas.sum(), rel=0.01)
    outlines = [
        [float(v.attrib[a]) for a in "xy"] for v in model.iterfind(".//{*}slice/{*}vertices/{*}vertex")
    ]
    for low, high in ((points.min(0), np.min(outlines, 0)), (points.max(0), np.max(outlines, 0))):
        np.testing.assert_allclose(low[:2], high, atol=0.02)
    assert points[:, 2].min() == pytest.approx(0, abs=0.01)
    assert points[:, 2].max() == pytest.approx(12, abs=0.01)


def test_svg_by_layer(tmp_path: Path, areas: np.ndarray) -> None:
    folder = write_slices(run(), tmp_path / "svg", "svg")
    files = sorted(folder.iterdir())
    assert [f.name for f in files] == [f"{k:05d}.svg" for k in range(24)]
    title, outline = ET.parse(files[5]).getroot()
    assert title.text == "top 3 mm, height 0.5 mm"
    path = outline.attrib["d"]
    rings = [
        np.array([p.split(",") for p in ring.strip(" z").split()], float) for ring in path.split("M")[1:]
    ]
    assert -sum(map(shoelace, rings)) == pytest.approx(areas[5], rel=1e-4)


def test_svg_with_layers(tmp_path: Path, areas: np.ndarray) -> None:
    root = ET.parse(write_slices(run(), tmp_path / "part.svg")).getroot()
    names = "{http://slic3r.org/namespaces/slic3r}"
    assert [float(g.attrib[f"{names}z"]) for g in root] == pytest.approx(0.5 * np.arange(1, 25))
    for group, area in zip(root, areas, strict=True):
        total = 0.0
        for polygon in group:
            ring = np.array([p.split(",") for p in polygon.attrib["points"].split()], float)
            assert (shoelace(ring) > 0) == (polygon.attrib[f"{names}type"] == "hole")  # y points down
            total -= shoelace(ring)
        assert total == pytest.approx(area, rel=1e-4)


def test_cli_as_text(tmp_path: Path, areas: np.ndarray) -> None:
    lines = write_slices(run(), tmp_path / "part.cli").read_text().splitlines()
    assert lines[:2] == ["$$HEADERSTART", "$$ASCII"]
    assert lines[-1] == "$$GEOMETRYEND"
    assert "$$LAYERS/000024" in lines
    result: list[float] = []
    for line in lines:
        if line.startswith("$$LAYER/"):
            result.append(0.0)
            assert float(line[8:]) * 1e-3 == pytest.approx(0.5 * len(result))
        if line.startswith("$$POLYLINE/"):
            _, direction, count, *numbers = line[11:].split(",")
            ring = np.array(numbers, float).reshape(-1, 2) * 1e-3
            assert len(ring) == int(count)
            assert (ring[0] == ring[-1]).all()
            assert (shoelace(ring[:-1]) > 0) == (direction == "1")
            result[-1] += shoelace(ring[:-1])
    np.testing.assert_allclose(result, areas, rtol=1e-4)


def test_cli_in_binary(tmp_path: Path, areas: np.ndarray) -> None:
    data = write_slices(run(), tmp_path / "part.cli", "cli-binary").read_bytes()
    at = data.index(b"$$HEADEREND") + len(b"$$HEADEREND")
    result: list[float] = []
    while at < len(data):
        (command,) = struct.unpack_from("<H", data, at)
        if command == 127:
            assert struct.unpack_from("<f", data, at + 2)[0] * 1e-3 == pytest.approx(0.5 * len(result) + 0.5)
            result.append(0.0)
            at += 6
        else:
            assert command == 130
            _, direction, count = struct.unpack_from("<iii", data, at + 2)
            ring = np.frombuffer(data, "<f4", 2 * count, at + 14).reshape(-1, 2) * 1e-3
            assert (shoelace(ring[:-1]) > 0) == (direction == 1)
            result[-1] += shoelace(ring[:-1])
            at += 14 + 8 * count
    np.testing.assert_allclose(result, areas, rtol=1e-4)


def test_json(tmp_path: Path, areas: np.ndarray) -> None:
    reported = json.loads(write_slices(run(), tmp_path / "part.json").read_text())
    assert reported["unit"] == "mm"
    assert reported["metadata"] == {"Title": "test"}
    for layer, area in zip(reported["layers"], areas, strict=True):
        assert sum(shoelace(np.array(c["points"])) for c in layer["contours"]) == pytest.approx(
            area, rel=1e-4
        )
        assert all(c["parent"] < i for i, c in enumerate(layer["contours"]))


def cancelled_after(layers: int) -> Work:
    """Work that is cancelled once so many slabs are done."""
    work = Work(threads=1)

    def progress(stage: str, done: float) -> None:
        if stage == "slicing" and done * 24 >= layers:
            work.cancel.set()

    object.__setattr__(work, "progress", progress)
    return work


@pytest.mark.parametrize("form", FORMATS)
def test_an_interrupted_job_goes_on(form: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    target = tmp_path / "part.sl1"
    with pytest.raises(Cancelled):
        write_slices(run(cancelled_after(8)), target, form)
    assert not (target.exists() and target.is_file())
    assert not (target / "manifest.json").exists()
    made: list[int] = []
    real = Slicer.map

    def watched(self: Slicer, make: Any, layers: Any, pictures: Any) -> Any:
        made.extend(layers)
        return real(self, make, layers, pictures)

    with monkeypatch.context() as patch:
        patch.setattr(Slicer, "map", watched)
        write_slices(run(), target, form)
    assert 0 < len(made) < 24
    assert contents(target) == contents(write_slices(run(), _beside(tmp_path, "part.sl1"), form))
    assert sorted(p.name for p in tmp_path.iterdir()) == ["again", "part.sl1"]


def test_layers_of_a_folder_are_written_by_their_threads(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In any order, so that an interrupted job may lack one before the last; the bytes are the same."""
    put, threads = layer_formats.write_small_file, set()

    def watched(path: str, data: bytes) -> None:
        threads.add(threading.current_thread())
        put(path, data)

    monkeypatch.setattr(layer_formats, "write_small_file", watched)
    with pytest.raises(Cancelled):
        write_slices(run(cancelled_after(16)), tmp_path / "part")
    (tmp_path / "part" / "00003.png").unlink()
    threads.clear()
    write_slices(run(Work(threads=2)), tmp_path / "part")
    assert threads
    assert threading.main_thread() not in threads
    assert contents(tmp_path / "part") == contents(fresh("png"))


def test_a_print_is_written_while_another_thread_reads_the_layers(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    real, threads = resuming.crc32, set()

    def watched(data: bytes) -> int:
        threads.add(threading.current_thread())
        return real(data)

    monkeypatch.setattr(resuming, "crc32", watched)
    monkeypatch.setattr(resuming, "GROUP", 1 << 10)
    whole = [
        write_slices(run(Work(threads=n)), _beside(tmp_path, "part"), "goo").read_bytes() for n in (1, 2)
    ]
    assert len(threads) > 1
    assert whole[0] == whole[1] == fresh("goo").read_bytes()


def _beside(folder: Path, name: str) -> Path:
    (folder / "again").mkdir(exist_ok=True)
    return folder / "again" / name


@cache
def fresh(form: str) -> Path:
    """The whole job, made at once."""
    folder = Path(tempfile.mkdtemp(prefix="fracslice-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return write_slices(run(), folder / "part", form)


def contents(path: Path) -> dict[str, bytes]:
    if path.is_dir():
        return {p.name: p.read_bytes() for p in path.iterdir()}
    return {"": path.read_bytes()}


def last_layer(target: Path) -> Path:
    """File with the last layers that an interrupted job left."""
    if target.is_dir():
        return max(path for path in target.iterdir() if path.suffix != ".json")
    return target.with_name(f".{target.name}.part")


@pytest.mark.parametrize("cut", [1, 150])
@pytest.mark.parametrize("form", FORMATS)
def test_a_truncated_remainder_goes_on_from_what_is_whole(form: str, cut: int, tmp_path: Path) -> None:
    target = tmp_path / "part"
    with pytest.raises(Cancelled):
        write_slices(run(cancelled_after(16)), target, form)
    part = last_layer(target)
    part.write_bytes(part.read_bytes()[:-cut])
    write_slices(run(), target, form)
    assert contents(target) == contents(fresh(form))


@pytest.mark.parametrize("form", FORMATS)
def test_a_damaged_layer_is_made_again(form: str, tmp_path: Path) -> None:
    """One bit of a layer that looks whole: as long as it was, with the same end."""
    target = tmp_path / "part"
    with pytest.raises(Cancelled):
        write_slices(run(cancelled_after(16)), target, form)
    layer = last_layer(target)
    data = bytearray(layer.read_bytes())
    data[len(data) // 2] ^= 1
    layer.write_bytes(data)
    write_slices(run(), target, form)
    assert contents(target) == contents(fresh(form))


@pytest.mark.parametrize("form", ["png", "svg"])
def test_another_whole_layer_in_the_place_of_one_is_noticed(form: str, tmp_path: Path) -> None:
    target = tmp_path / "part"
    with pytest.raises(Cancelled):
        write_slices(run(cancelled_after(16)), target, form)
    (target / f"00002.{form}").write_bytes((target / f"00009.{form}").read_bytes())
    write_slices(run(), target, form)
    assert contents(target) == contents(fresh(form))


@pytest.mark.parametrize("survived", range(3))
def test_a_folder_goes_on_wherever_its_job_was_killed(
    survived: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Before job.json or manifest.json got its name, or before job.json was removed."""
    target, left = tmp_path / "part", survived

    def until_killed(plain: Callable[..., None]) -> Callable[..., None]:
        def call(*paths: Any, **how: Any) -> None:
            nonlocal left
            left -= 1
            if left < 0:
                raise SystemExit
            plain(*paths, **how)

        return call

    with monkeypatch.context() as patch:
        for name in ("replace", "unlink"):
            patch.setattr(os, name, until_killed(getattr(os, name)))
        with pytest.raises(SystemExit):
            write_slices(run(), target)
    assert len([name for name in os.listdir(target) if not name.endswith("png")]) == min(survived + 1, 2)
    write_slices(run(), target)
    assert contents(target) == contents(fresh("png"))


SMALLER = difference(menger(level=1), sphere(radius=0.8))
"""As large, and all that an archive's first member says of it is the same."""


@pytest.mark.parametrize("form", FORMATS)
def test_the_remainder_of_another_job_is_not_used(form: str, tmp_path: Path) -> None:
    target = tmp_path / "part.sl1"
    with pytest.raises(Cancelled):
        write_slices(run(cancelled_after(8), root=SMALLER), target, form)
    with pytest.warns(FracsliceWarning, match=r"part.sl1: layers left by another job .* begun afresh"):
        write_slices(run(), target, form)
    assert contents(target) == contents(write_slices(run(), _beside(tmp_path, "part.sl1"), form))
    assert sorted(p.name for p in tmp_path.iterdir()) == ["again", "part.sl1"]


@pytest.mark.parametrize(("before", "after"), [("cli", "cli-binary"), ("sl1", "3mf"), ("png", "svg")])
def test_the_remainder_of_another_format_is_not_used(before: str, after: str, tmp_path: Path) -> None:
    with pytest.raises(Cancelled):
        write_slices(run(cancelled_after(8)), tmp_path / "part", before)
    with pytest.warns(FracsliceWarning, match="begun afresh"):
        write_slices(run(), tmp_path / "part", after)


def test_a_job_is_known_by_all_that_its_layers_follow_from(monkeypatch: pytest.MonkeyPatch) -> None:
    job = run()
    changes: dict[str, list[dict[str, Any]]] = {
        "stack": [
            {"root": SMALLER},
            {"tops": job.stack.tops + 1e-9},
            {"corner": (0.0, 0.0)},
            {"notes": ("a",)},
        ],
        "screen": [{"gamma": 1.1}, {"compensation": 0.01}, {"mirror": True}, {"printer": None}]
        + [{"levels": 4}, {"blur": 1}],
        "": [{"resin": Resin(2, 21)}, {"metadata": {"Title": "other"}}],
    }
    jobs = [job]
    for part, values in changes.items():
        whole = getattr(job, part) if part else job
        changed = [replace(whole, **value) for value in values]
        jobs += [replace(job, **{part: each}) for each in changed] if part else changed
    keys = [each.key("png") for each in jobs] + [job.key("svg")]
    monkeypatch.setitem(vars(sphere), "lipschitz", 1.5)
    keys.append(run(root=difference(menger(level=1), sphere(radius=0.9))).key("png"))
    assert len(set(keys)) == len(keys)
    monkeypatch.undo()
    assert run().key("png") == keys[0]


@pytest.mark.parametrize("spoil", ["forged", "linked", "lent"])
def test_a_remainder_that_somebody_else_can_have_written_is_not_used(spoil: str, tmp_path: Path) -> None:
    target, part, reported = (tmp_path / name for name in ("part.cli", ".part.cli.part", ".part.cli.job"))
    with pytest.raises(Cancelled):
        write_slices(run(cancelled_after(8)), target)
    if spoil == "forged":
        reported.write_text(json.dumps({"application": "fracslice", "job": run().key("cli")}))
    elif spoil == "linked":
        part.rename(tmp_path / "mine")
        part.symlink_to(tmp_path / "mine")
    else:
        part.chmod(0o666)
    before = part.read_bytes()
    with pytest.warns(FracsliceWarning, match="begun afresh") if spoil == "forged" else nullcontext():
        write_slices(run(), target)
    assert contents(target) == contents(write_slices(run(), _beside(tmp_path, "part.cli")))
    if spoil == "linked":
        assert (tmp_path / "mine").read_bytes() == before


def test_two_at_once_do_not_spoil_each_other(tmp_path: Path) -> None:
    with journal(tmp_path / "part.cli", "one") as kept:
        kept.append(b"layer")
        with (
            pytest.raises(ExportError, match="another process is writing it"),
            journal(tmp_path / "part.cli", "two"),
        ):
            pass
        assert list(kept) == [b"layer"]


def test_two_at_once_do_not_mix_their_layers(tmp_path: Path) -> None:
    folder = tmp_path / "layers"
    with resumable_folder(folder, "one", "{:05}.png".format):
        (folder / "00000.png").write_bytes(b"one")
        with pytest.raises(ExportError, match="layers: another process is writing it"):
            write_slices(run(), folder)
        assert (folder / "00000.png").read_bytes() == b"one"


def test_a_layer_that_is_a_link_is_not_written_through(tmp_path: Path) -> None:
    with pytest.raises(Cancelled):
        write_slices(run(cancelled_after(8)), tmp_path / "layers")
    (tmp_path / "mine").write_text("mine")
    (tmp_path / "layers" / "00023.png").symlink_to(tmp_path / "mine")
    with pytest.raises(ExportError, match="layers: "):
        write_slices(run(), tmp_path / "layers")
    assert (tmp_path / "mine").read_text() == "mine"


def test_a_full_disk_leaves_the_remainder_and_no_archive(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(self: Journal, *_: object) -> None:
        raise OSError(28, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(Journal, "append", full)
        with pytest.raises(ExportError, match="disk is full"):
            write_slices(run(), tmp_path / "part.sl1")
    assert not (tmp_path / "part.sl1").exists()
    write_slices(run(), tmp_path / "part.sl1")


def test_a_journal_knows_the_begins_and_sizes_of_layers(tmp_path: Path) -> None:
    def interrupted() -> None:
        with journal(tmp_path / "job", "key") as layers:
            for layer in (b"area and pixels", b"8 bytes.", b"area" * 9):
                layers.append(layer)
            raise Cancelled

    with pytest.raises(Cancelled):
        interrupted()
    with journal(tmp_path / "job", "key") as layers:
        assert (layers.begins, layers.sizes) == ([b"area and", b"8 bytes.", b"areaarea"], [15, 8, 36])
        layers.append(b"areaarea")
        assert layers.begins[3:] == [b"areaarea"]
        assert layers.size == sum(layers.sizes) + 4 * 8
        assert list(layers) == [b"area and pixels", b"8 bytes.", b"area" * 9, b"areaarea"]


def test_a_layer_survives_the_process_as_soon_as_it_is_appended(tmp_path: Path) -> None:
    with journal(tmp_path / "job", "key") as layers:
        layers.append(b"one layer")
        assert (tmp_path / ".job.part").read_bytes().endswith(b"one layer")


@pytest.mark.parametrize(
    ("path", "name", "message"),
    [
        ("x.gcode", None, "unknown kind of file"),
        ("x.cli", "dxf", "format 'dxf': known are"),
        ("missing/x.cli", None, "does not exist"),
    ],
)
def test_bad_targets(path: str, name: str | None, message: str, tmp_path: Path) -> None:
    with pytest.raises(ExportError, match=message):
        slice_format(tmp_path / path, name)


def test_folders_with_something_in_them(tmp_path: Path) -> None:
    (tmp_path / "other.txt").write_text("mine")
    for name in ("png", "svg"):
        with pytest.raises(ExportError, match="not empty"):
            write_slices(run(), tmp_path, name)
    assert [p.name for p in tmp_path.iterdir()] == ["other.txt"]
