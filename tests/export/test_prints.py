"""Print files read back by readers that are not ours: every pixel of every layer, heights and exposures."""

from __future__ import annotations

import io
import math
import shutil
import subprocess
import time
import zipfile
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from itertools import groupby
from pathlib import Path

import numpy as np
import pytest
from scipy.ndimage import label

from fracslice.errors import ExportError
from fracslice.export.layers import (
    ENDINGS,
    FORMATS,
    PRINTS,
    archives,
    printers_file,
    slice_format,
    write_slices,
)
from fracslice.export.slice_run import SliceRun
from fracslice.formulas import difference, menger, sphere, transform
from fracslice.jobs.slices import StackModel
from fracslice.scene import scene
from fracslice.slicing import SliceJob, Slicer, adapted, plan_stack
from fracslice.slicing.printers import PRINTERS, Printer, Resin
from fracslice.slicing.raster import Screen
from fracslice.work import Work
from tests.examples import stamped
from tests.export import decoders, readers

pytestmark = pytest.mark.once

MACHINE = Printer("test", "Test", (96, 80), (24.0, 20.0), 30, portrait=True)
ROOT = difference(menger(level=1), sphere(radius=0.9))
JOB = SliceJob(size=12, layer=0.5, pixel=MACHINE.pixel)
RESIN = Resin(2.5, 30, "Test resin", bottom_layers=2, transition_layers=3, density=1.2)


def quantised(bits: int) -> Callable[[np.ndarray], np.ndarray]:
    most = 2**bits - 1
    return lambda image: np.floor(image / 255 * most + 0.5).astype(int)


READERS = {
    "sl1": (readers.sl1, lambda image: image),
    "goo": (readers.goo, lambda image: image),
    "ctb": (readers.ctb, lambda image: image >> 1),
    "cbddlp": (readers.ctb, lambda image: (image.astype(int) + 32) // 64),
    "pwmx": (readers.photon, quantised(4)),
    "nanodlp": (readers.nanodlp, lambda image: image),
    "cxdlpv4": (readers.cxdlp, lambda image: image >> 1),
    "pwsz": (readers.pwsz, quantised(4)),
}
"""Readers of the formats of known printers, and what a format keeps of a grey level."""

LARGEST = {
    form: max(machines, key=lambda machine: math.prod(machine.pixels))
    for form, machines in groupby(
        sorted(
            (p for p in PRINTERS.values() if f".{p.file}" in ENDINGS), key=lambda p: ENDINGS[f".{p.file}"]
        ),
        key=lambda p: ENDINGS[f".{p.file}"],
    )
}
"""Of each format, the printer of most pixels."""

CASES = {
    "goo": ("part.goo", readers.goo, lambda image: image),
    "prz": ("part.prz", readers.goo, lambda image: image),
    "ctb 2": ("part.ctb", readers.ctb, lambda image: image >> 1),
    "ctb 3": ("part.ctb", readers.ctb, lambda image: image >> 1),
    "cbddlp": ("part.cbddlp", readers.ctb, lambda image: (image.astype(int) + 32) // 64),
    "pwmx 1": ("part.pwmx", readers.photon, quantised(4)),
    "pwma 516": ("part.pwma", readers.photon, quantised(4)),
    "pm5 517": ("part.pm5", readers.photon, quantised(4)),
    "cxdlpv4": ("part.cxdlpv4", readers.cxdlp, lambda image: image >> 1),
    "nanodlp": ("part.nanodlp", readers.nanodlp, lambda image: image),
    "pwsz": ("part.pwsz", readers.pwsz, quantised(4)),
}


def run(version: int = 1, most: float | None = None, compensation: float = 0.0) -> SliceRun:
    stack = plan_stack(ROOT, JOB)
    if most is not None:
        stack = adapted(stack, most)
    screen = Screen(stack, printer=replace(MACHINE, version=version), compensation=compensation)
    return SliceRun(stack, screen, resin=RESIN, metadata={"Title": "test"}, picture=picture)


@cache
def picture() -> np.ndarray:
    """A rendered preview, once for all files."""
    return StackModel(scene(ROOT, size=12), JOB, Work()).picture()


@pytest.mark.skipif(not hasattr(time, "tzset"), reason="the time zone cannot be set")
def test_a_file_is_the_same_in_every_time_zone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def written(zone: str) -> bytes:
        monkeypatch.setenv("TZ", zone)
        time.tzset()
        return write_slices(run(), tmp_path / "part.nanodlp").read_bytes()

    try:
        assert written("JST-9") == written("UTC0")
    finally:
        monkeypatch.undo()
        time.tzset()


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("most", [None, 1.0])
def test_every_pixel_height_and_exposure_comes_back(case: str, most: float | None, tmp_path: Path) -> None:
    name, read, level = CASES[case]
    job = run(int((case.split() + ["1"])[1]), most)
    result = read(write_slices(job, tmp_path / name).read_bytes())
    expected = list(Slicer(job.stack).map(job.screen.picture))
    assert len(result.pictures) == job.layers
    assert job.layers < 24 if most else job.layers == 24
    for one, other in zip(result.pictures, expected, strict=True):
        assert (one == level(other)).all()
    np.testing.assert_allclose(result.tops, job.stack.tops, rtol=1e-5)
    np.testing.assert_allclose(result.exposures, RESIN.exposures(job.layers), rtol=1e-6)
    assert result.exposures[:3] == pytest.approx([30, 30, 30 - 27.5 / 4])
    for preview in result.previews:  # rendered: neither empty nor of one colour
        assert len(np.unique(preview.reshape(-1, 3), axis=0)) > 50
    unit = 1000 if name.endswith(("goo", "prz")) else 1
    area = sum(image.sum() / 255 * h for image, h in zip(expected, job.stack.heights, strict=True))
    assert result.about["volume"] * 1000 / unit == pytest.approx(area * 0.25**2, rel=1e-3)


def printed(machine: Printer, layer: float, path: Path) -> Path:
    """A file of a ball that touches no side, for a machine; checked to be that machine's."""
    job = SliceJob(size=12, layer=layer, pixel=machine.pixel)
    stack = plan_stack(sphere(), job)
    one = SliceRun(
        stack, Screen(stack, printer=machine), resin=RESIN, metadata={"Title": "test"}, picture=picture
    )
    form = slice_format(write_slices(one, path))
    read, level = READERS[form]
    result = read(path.read_bytes())
    expected = [level(image) for image in Slicer(stack).map(one.screen.picture)]
    assert len(result.pictures) == len(expected) == len(stack.z)
    assert all(np.array_equal(a, b) for a, b in zip(result.pictures, expected, strict=True))
    np.testing.assert_allclose(result.tops, stack.tops, rtol=1e-5)
    assert all(image.any() for image in result.pictures)
    assert result.previews and all(len(np.unique(p.reshape(-1, 3), axis=0)) > 50 for p in result.previews)
    return path


ONE_EACH = {machine.file: name for name, machine in PRINTERS.items()}.values()
"""A printer for each format."""


@pytest.mark.parametrize("name", stamped(PRINTERS, ONE_EACH))
def test_one_object_through_every_printer(name: str, tmp_path: Path) -> None:
    """An eighth of the pixels of the screen along each side, as the screen is turned and mirrored."""
    machine = PRINTERS[name]
    ending = f".{machine.file}" if f".{machine.file}" in ENDINGS else ".goo"
    instead = printers_file(machine, f"part{ending}")
    assert instead == "" or instead.endswith("convert part.goo with UVtools")
    columns, rows = machine.pixels
    printed(replace(machine, pixels=(columns // 8, rows // 8)), 3.0, tmp_path / f"part{ending}")


@pytest.mark.parametrize("form", LARGEST)
def test_the_largest_screen_of_every_format(form: str, tmp_path: Path) -> None:
    printed(LARGEST[form], 6.0, tmp_path / f"part.{LARGEST[form].file}")


def test_a_lift_in_two_stages_and_all_rests(tmp_path: Path) -> None:
    """A .goo file has fields for them; others have the whole lift, and all rests before a layer."""
    slow = replace(
        RESIN, lift=2, lift_speed=40, lift_2=4, lift_speed_2=180, retract_2=1.5, retract_speed_2=30
    )
    slow = replace(slow, wait=1, wait_after=0.5, wait_lifted=0.25)
    job = replace(run(), resin=slow)
    about = readers.goo(write_slices(job, tmp_path / "part.goo").read_bytes()).about
    assert about["rests"] == pytest.approx((0.5, 0.25, 1) * 2)
    back = (4.5, slow.retract_speed)
    assert about["motion"] == pytest.approx((2, 40) * 2 + back * 2 + (4, 180) * 2 + (1.5, 30) * 2)
    for layer in about["layers"]:
        assert layer == pytest.approx((0, 0.5, 0.25, 1, 2, 40, 4, 180, *back, 1.5, 30)[: len(layer)])
    motion = 60 * (2 / 40 + 4 / 180 + 4.5 / slow.retract_speed + 1.5 / 30) + 1.75
    assert slow.seconds(np.ones(10)) == pytest.approx(float(slow.exposures(10).sum()) + 10 * motion)
    with pytest.raises(ExportError, match="retract_2 = 7: expected at most the whole lift, 6 mm"):
        replace(slow, retract_2=7)


def test_larger_layers_are_lifted_farther_and_more_slowly(tmp_path: Path) -> None:
    """By UVtools' full range, in files with a lift for each layer; the time is that of all lifts."""
    resin = replace(
        RESIN, bottom_layers=1, transition_layers=0, lift=6, lift_speed=40, small_lift=3, small_lift_speed=160
    )
    lifts = [(own.lift, own.lift_speed) for own in resin.of_layers(np.array([9, 4, 4, 1, 1, 3, 5.0]))]
    assert lifts == [(6, 40), (6, 40), (5.2, 70), (5.2, 70), (3, 160), (4.5, 100), (6, 40)]
    assert resin.of_layers(np.array([2.0, 2, 2]))[1:] == [replace(resin, lift=3, lift_speed=160)] * 2
    for name in ("goo", "ctb 3", "pwma 516", "cxdlpv4", "pwsz"):
        path, read, _ = CASES[name]
        job = replace(run(int((name.split() + ["1"])[1])), resin=resin)
        found = read(write_slices(job, tmp_path / path).read_bytes()).lifts
        expected = [(own.lift, own.lift_speed) for own in resin.of_layers(_areas(job))]
        assert np.array(found) == pytest.approx(np.array(expected)) and len(set(expected)) > 2
    for values, reported in (
        ({"small_lift": 7}, "small_lift = 7: expected at most lift, 6 mm"),
        ({"small_lift_speed": 9}, "small_lift_speed = 9: expected at least lift_speed"),
    ):
        with pytest.raises(ExportError, match=reported):
            replace(resin, **values)


def _areas(job: SliceRun) -> np.ndarray:
    return np.array([job.slicer.areas[k] for k in range(job.layers)])


@pytest.mark.parametrize(("portrait", "mirror"), [(False, False), (False, True), (True, False), (True, True)])
def test_extents_of_layers_in_a_pwsz_file(portrait: bool, mirror: bool, tmp_path: Path) -> None:
    """As the pictures have them: places of their lit pixels, and the number of components."""
    stack = plan_stack(difference(ROOT, transform(ROOT, translate=(0.3, 0.7, 0))), JOB)
    machine = replace(MACHINE, portrait=portrait, mirror=mirror)
    job = SliceRun(stack, Screen(stack, printer=machine), resin=RESIN, picture=picture)
    about = readers.pwsz(write_slices(job, tmp_path / "part.pwsz").read_bytes())
    assert len(about.pictures) == len(about.about["extents"]) == job.layers
    for shown, (_, area, *corners, count, largest) in zip(
        about.pictures, about.about["extents"], strict=True
    ):
        rows, columns = np.nonzero(shown >= 8)
        found = [columns.min(), rows.min(), columns.max() + 1, rows.max() + 1]
        middle = np.array(shown.shape[::-1]) / 2
        assert np.array(corners) == pytest.approx((np.array(found) - [*middle, *middle]) * 0.25)
        assert count == label(shown >= 8, np.ones((3, 3)))[1]
        assert 0 < largest <= 1.5 * area


def test_pictures_that_are_compensated(tmp_path: Path) -> None:
    job = run(compensation=0.1)
    expected = list(Slicer(job.stack).map(job.screen.picture))
    for name, read, level in (CASES["goo"], CASES["cbddlp"]):
        result = read(write_slices(job, tmp_path / name).read_bytes())
        assert all((a == level(b)).all() for a, b in zip(result.pictures, expected, strict=True))


@pytest.mark.parametrize("case", CASES)
def test_a_damaged_file_is_no_whole_one(case: str, tmp_path: Path) -> None:
    """What the readers of the other tests accept is whole: they notice a lost or changed end."""
    name, read, _ = CASES[case]
    whole = write_slices(run(int((case.split() + ["1"])[1])), tmp_path / name).read_bytes()
    for cut in (1, 10, len(whole) // 2):
        with pytest.raises(readers.DamagedError):
            read(whole[:-cut])


def test_print_files_need_printer_and_resin(tmp_path: Path) -> None:
    job = run()
    for name in PRINTS:
        for lacking in (replace(job, resin=None), replace(job, screen=Screen(job.stack))):
            with pytest.raises(ExportError, match="needs"):
                write_slices(lacking, tmp_path / f"part.{name}")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", ["ctb", "cbddlp", "pwmx"])
def test_pictures_beyond_offsets_of_32_bits(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A small limit stands for 4 GiB; `most` of these formats leaves room for 100,000 layers of tables."""
    form = PRINTS[name]
    assert form.most is not None and form.most + 100_000 * 300 < 2**32
    monkeypatch.setitem(FORMATS, name, replace(form, most=5000))
    with pytest.raises(ExportError, match=r"of 24 layers are larger than .* GiB: expected less") as error:
        write_slices(run(), tmp_path / f"part.{name}")
    assert len(str(error.value).splitlines()) == 1
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("values", [(-1, 30), (2, float("nan")), (0, 30), (2, float("inf"))])
def test_exposures_that_no_printer_takes(values: tuple[float, float]) -> None:
    with pytest.raises(ExportError, match="expected a number"):
        Resin(*values)


@pytest.mark.skipif(not shutil.which("cargo"), reason="needs cargo")
def test_goo_by_the_crate_goo(tmp_path: Path) -> None:
    crate = tmp_path / "crate"
    shutil.copytree(Path(__file__).parent / "goo", crate)
    command = ["cargo", "build", "--release", "--quiet", "--locked"]
    if subprocess.run(command, cwd=crate, capture_output=True).returncode:
        pytest.skip("the crate cannot be had here")
    job = run(most=1.0)
    path = write_slices(job, tmp_path / "part.goo")
    subprocess.run([crate / "target/release/layers", path, tmp_path / "pixels"], check=True)
    rows, columns = job.screen.shape
    result = np.fromfile(tmp_path / "pixels", np.uint8).reshape(-1, rows, columns)
    assert (result == list(Slicer(job.stack).map(job.screen.picture))).all()


def test_photon_by_pyphotonfile(tmp_path: Path) -> None:
    """It reads the layout; its own decoder of run lengths needs NumPy 1. Its screen: 1440 x 2560 pixels."""
    pyphotonfile = pytest.importorskip("pyphotonfile")
    machine = PRINTERS["photon"]
    stack = plan_stack(sphere(), SliceJob(size=12, layer=3, pixel=machine.pixel))
    job = SliceRun(stack, Screen(stack, printer=machine), resin=RESIN, picture=picture)
    result = pyphotonfile.Photon(str(write_slices(job, tmp_path / "part.photon")))
    assert (result.layer_height, result.exposure_time, result.exposure_time_bottom) == (3, 2.5, 30)
    pictures = [decoders.picture(decoders.rle1(layer._data), (2560, 1440)) for layer in result.layers]
    expected = [image >= 224 for image in Slicer(stack).map(job.screen.picture)]
    assert len(pictures) == 4 and expected[1].any()
    assert all((one == other).all() for one, other in zip(pictures, expected, strict=True))


def test_archives_are_those_of_zipfile() -> None:
    members = [("config.ini", b"a = 1\n"), ("thumbnail/a.png", bytes(range(256))), ("empty", b"")]
    ours, expected = io.BytesIO(), io.BytesIO()
    archives.write_archive(ours, iter(members))
    with zipfile.ZipFile(expected, "w") as archive:
        for name, data in members:
            archive.writestr(zipfile.ZipInfo(name), data)
    assert ours.getvalue() == expected.getvalue()
