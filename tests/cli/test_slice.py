"""``fracslice slice`` as a person meets it."""

from __future__ import annotations

import errno
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from fracslice.cli.main import run

from fracslice.errors import Cancelled
from fracslice.export.resuming import Journal

pytestmark = pytest.mark.once


def sliced(*arguments: object) -> int:
    return run(["slice", *map(str, arguments), "--pixel", "0.2mm"])


def test_layers_of_a_range_of_heights(ball: Path, tmp_path: Path) -> None:
    target = tmp_path / "ball.json"
    assert sliced(ball, "-o", target, "--layer", "0.2mm..0.6mm") == 0
    layers = json.loads(target.read_text())["layers"]
    assert {round(layer["height"], 3) for layer in layers} == {0.2, 0.4, 0.6}
    assert sum(layer["height"] for layer in layers) == pytest.approx(20)
    assert layers[-1]["top"] == 20


@pytest.mark.nightly
@pytest.mark.skipif(sys.platform != "linux", reason="Linux limits addresses")
def test_layers_are_made_in_few_addresses(ball: Path, tmp_path: Path) -> None:
    """Threads for which there is no room are not started."""
    code = (
        "import resource; resource.setrlimit(resource.RLIMIT_AS, (500 << 20,) * 2);"
        "from fracslice.cli import main; main()"
    )
    files = []
    for threads, start in ((1, ["-m", "fracslice.cli"]), (64, ["-c", code])):
        files.append(tmp_path / f"{threads}.cli")
        how = ["--pixel", "0.2mm", "--layer", "0.1mm", "--threads", str(threads), "-q"]
        command = [sys.executable, *start, "slice", str(ball), "-o", str(files[-1]), *how]
        done = subprocess.run(command, capture_output=True, text=True)
        assert (done.returncode, done.stderr) == (0, "")
    assert files[0].read_bytes() == files[1].read_bytes()


@pytest.mark.parametrize("command", ["slice", "check"])
def test_printers_are_listed_without_a_scene(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run([command, "--printer", "list"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) >= 6
    assert any(line.startswith("sl1s ") and "2560 x 1620, 128 x 81 x 150 mm" in line for line in lines)


@pytest.mark.parametrize(
    ("options", "reported"),
    [
        (["--layer", "0.4mm..0.2mm"], "expected a range from the lowest to the highest"),
        (["--layer", "0.2mm..thick"], "'0.2mm..thick': expected a length, or two"),
        (["--layer", "..0.2mm"], "'..0.2mm': expected a length, or two"),
        (["--layer", "30mm"], "as high as the object"),
        (["--format", "gcode"], "known are"),
    ],
)
def test_bad_input_is_one_line(
    options: list[str], reported: str, ball: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    assert sliced(ball, "-o", tmp_path / "out.cli", *options) == 2
    error = capfd.readouterr().err
    assert error.startswith("fracslice: ")
    assert error.count("\n") == 1
    assert reported in error
    assert [path.name for path in tmp_path.iterdir()] == ["ball.xml"]


@pytest.mark.parametrize(
    ("options", "reported"),
    [
        (["--layer", "0.2mm..0.6mm", "--printer", "sl1s"], "has layers of one height"),
        (["--layer", "0.2mm"], "needs --printer, such as sl1;"),
        (["--layer", "0.2mm", "-o", "out.goo"], "needs --printer, such as jupiter-2;"),
        (["-o", "out.pm3", "--printer", "saturn-2"], "out.pm3: Elegoo Saturn 2 reads encrypted .ctb"),
    ],
)
def test_what_an_archive_cannot_say_is_refused_before_the_object_is_changed(
    options: list[str], reported: str, ball: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    wrong = ["--hollow", "15mm"]
    assert run(["slice", str(ball), "-o", str(tmp_path / "out.sl1"), *options, *wrong]) == 2
    error = capfd.readouterr().err
    assert reported in error and error.count("\n") == 1
    assert [path.name for path in tmp_path.iterdir()] == ["ball.xml"]


def test_a_folder_that_is_not_this_job(ball: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "layers").mkdir()
    (tmp_path / "layers" / "job.json").write_text('{"mine": 1}')
    assert sliced(ball, "-o", tmp_path / "layers", "--layer", "1mm") == 2
    assert "its files are no interrupted job" in capfd.readouterr().err
    assert (tmp_path / "layers" / "job.json").read_text() == '{"mine": 1}'


@pytest.mark.parametrize("ending", ["sl1", "3mf", "png"])
def test_names_that_are_no_text(ending: str, ball: Path, tmp_path: Path) -> None:
    """Linux has names of any bytes."""
    scene, target = (tmp_path / os.fsdecode(b"b\xff." + e) for e in (b"xml", ending.encode()))
    ball.rename(scene)
    how = {"sl1": ["slice", "--layer", "5mm", "--printer", "sl1s"], "3mf": ["mesh", "--resolution", "16"]}
    command = how.get(ending, ["render", "--size", "8x8", "--samples", "1"])
    assert run([command[0], str(scene), "-o", str(target), *command[1:]]) == 0
    assert target.stat().st_size


@pytest.mark.parametrize("date", ["today", "1e9", "9" * 20])
def test_an_impossible_date(
    date: str, ball: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("SOURCE_DATE_EPOCH", date)
    assert sliced(ball, "-o", tmp_path / "layers", "--layer", "5mm") == 2
    assert capfd.readouterr().err.startswith(f"fracslice: SOURCE_DATE_EPOCH={date}: expected seconds")


def test_a_file_that_is_written_is_named_when_its_page_is_stopped(
    ball: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    def stopped(*_: object) -> None:
        raise Cancelled

    monkeypatch.setattr("fracslice.jobs.slice_checks.check_run", stopped)
    target = tmp_path / "a.json"
    assert sliced(ball, "-o", target, "--layer", "5mm", "--html", tmp_path / "a.html") == 130
    assert capfd.readouterr().err == f"fracslice: stopped; {target} is written\n"
    assert target.exists() and not (tmp_path / "a.html").exists()


def test_an_element_without_an_end_is_named_by_its_line(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    scene = tmp_path / "a.xml"
    scene.write_text('<scene version="1">\n<solid\nsize="4mm">\n<!-- --><gyroid/></solid></scene>')
    assert sliced(scene, "-o", tmp_path / "a.json", "--layer", "1mm") == 2
    assert capfd.readouterr().err.startswith(f"fracslice: {scene}:4: <gyroid> has no end")


def test_the_volume_is_the_same_in_all_formats_and_after_an_interruption(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """Of a comb, whose layers cannot be interpolated."""
    scene, add = tmp_path / "comb.xml", Journal.append
    scene.write_text(
        '<scene version="1"><solid unit="1mm"><box size="2 2 24"/>'
        '<repeat period="9 9 3" count="1 1 8"><box size="8 8 1"/></repeat></solid></scene>'
    )

    def volume(target: str, *options: object) -> str:
        assert (
            run(["slice", str(scene), "-o", str(tmp_path / target), "--layer", "0.1mm", *map(str, options)])
            == 0
        )
        return capfd.readouterr().out.splitlines()[1].split(" ml")[0]

    def stopped(self: Journal, data: bytes) -> None:
        if self.count == 99:
            raise Cancelled
        add(self, data)

    layers = volume("layers", "--pixel", "0.05mm")
    assert float(layers) == pytest.approx((8 * 64 + 16 * 4) / 1000, rel=0.01)
    assert volume("a.cli", "--pixel", "0.05mm") == layers
    printer = ("--printer", "sl1s")
    with monkeypatch.context() as patch:
        patch.setattr(Journal, "append", stopped)
        assert run(["slice", str(scene), "-o", str(tmp_path / "a.sl1"), "--layer", "0.1mm", *printer]) == 130
    assert volume("a.sl1", *printer) == layers
    with monkeypatch.context() as patch:
        patch.setattr(Journal, "append", stopped)
        target = ["-o", str(tmp_path / "b.cli"), "--layer", "0.1mm"]
        assert run(["slice", str(scene), *target, "--pixel", "0.05mm"]) == 130
    assert volume("b.cli", "--pixel", "0.05mm").startswith("about ")


@pytest.mark.parametrize(("name", "pixels"), [("a.sl1", "--printer=sl1s"), ("layers", "--pixel=1mm")])
def test_a_full_disk_keeps_the_finished_layers_and_says_so(
    name: str,
    pixels: str,
    ball: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
) -> None:
    def full(_: int) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    given = ["slice", str(ball), "-o", str(tmp_path / name), "--layer=1mm", pixels]
    with monkeypatch.context() as patch:
        patch.setattr("os.fsync", full)
        assert run(given) == 2
    assert "the disk is full; the same command goes on from the finished layers" in capfd.readouterr().err
    assert run(given) == 0
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(["ball.xml", name])


def test_an_edited_scene_begins_afresh_and_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """Interrupted, edited, and the same command again: not a layer of the scene before."""
    scene, target, add = tmp_path / "a.xml", tmp_path / "a.sl1", Journal.append
    text = (
        '<scene version="1"><solid size="20mm"><difference><box size="1 1 1.5"/>'
        '<cylinder radius="{}" height="3"/></difference></solid></scene>'
    )
    options = ("-o", target, "--layer", "1mm", "--printer", "sl1s", "--quiet")
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1700000000")

    def stopped(self: Journal, data: bytes) -> None:
        if self.count == 8:
            raise Cancelled
        add(self, data)

    scene.write_text(text.format(0.3))
    with monkeypatch.context() as patch:
        patch.setattr(Journal, "append", stopped)
        assert run(["slice", str(scene), *map(str, options)]) == 130
    assert capfd.readouterr().err.endswith("stopped; the same command goes on from the finished layers\n")
    scene.write_text(text.format(0.1))
    assert run(["slice", str(scene), *map(str, options)]) == 0
    reported = capfd.readouterr().err
    assert (
        reported.startswith(f"fracslice: {target}: ")
        and "begun afresh" in reported
        and reported.count("\n") == 1
    )
    edited = target.read_bytes()
    target.unlink()
    assert run(["slice", str(scene), *map(str, options)]) == 0
    assert target.read_bytes() == edited
    assert capfd.readouterr().err == ""


def test_layers_that_lost_the_object_are_no_success(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "sheet.xml"
    path.write_text(
        '<scene version="1"><solid size="30mm"><union><sphere radius="0.1"/><transform rotate="1 2 3 50">'
        '<box size="1 1 0.002"/></transform></union></solid></scene>'
    )
    assert run(["slice", str(path), "-o", str(tmp_path / "l.svg"), "--pixel=0.6mm", "--layer=0.6mm"]) == 1
    assert "sheet.xml:1 is finer than the samples and missing: pixels of" in capsys.readouterr().out
    assert run(["check", str(path), "--pixel=0.6mm", "--layer=0.6mm"]) == 1
    assert "is finer than the samples and missing: pixels of" in capsys.readouterr().out
