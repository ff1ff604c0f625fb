"""fracslice print, with a slicer that the test writes."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest
from fracslice.cli.main import run

from fracslice.mesh.reading import read_mesh

PROGRAM = """#!{python}
import json, os, shutil, sys
out = sys.argv[sys.argv.index({flag!r}) + 1]
json.dump(sys.argv[1:], open({log!r}, "w"))
shutil.copy(sys.argv[-1], {model!r})
print("[2026-11-22 22:02:03] [0x7f1c] [warning] Low bed adhesion")
print("Slicing done", file=sys.stderr)
if {status}:
    sys.exit("no profile fits")
open(out, "w").write("G28")
"""

COARSE = "--voxel", "1mm", "--simplify", "0.1mm"


@pytest.fixture
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder of programs, the only one on the path."""
    folder = tmp_path / "bin"
    folder.mkdir()
    monkeypatch.setenv("PATH", str(folder))
    return folder


def install(folder: Path, name: str, flag: str, model: str, status: int = 0) -> Path:
    """Write a slicer; return the file of its arguments."""
    log, program = folder / "arguments.json", folder / name
    paths = {"log": str(log), "model": str(folder / model)}
    program.write_text(PROGRAM.format(python=sys.executable, flag=flag, status=status, **paths))
    program.chmod(0o755)
    return log


def printed(*arguments: object) -> int:
    return run(["print", *map(str, arguments)])


@pytest.mark.skipif(sys.platform == "win32", reason="programs are scripts")
def test_a_slicer_gets_a_simplified_mesh_and_its_warnings_are_passed_on(
    ball: Path, installed: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    log = install(installed, "prusa-slicer", "--output", "model.3mf")
    out, profile = ball.with_name("ball.gcode"), ball.with_name("my.ini")
    profile.write_text("layer_height = 0.2\n")
    assert printed(ball, "-o", out, "--profile", profile, *COARSE) == 0
    assert out.read_text() == "G28"
    arguments = json.loads(log.read_text())
    assert arguments[:4] == ["--export-gcode", "--load", str(profile), "--output"]
    assert arguments[5].endswith("ball.3mf")
    mesh = read_mesh(str(installed / "model.3mf"))
    assert mesh.is_watertight and len(mesh.triangles) < 1500
    shown, warned = capfd.readouterr()
    assert shown.splitlines() == [
        f"{len(mesh.triangles):,} triangles: PrusaSlicer takes about 1 s",
        f"{out}: made by PrusaSlicer",
    ]
    assert warned == "PrusaSlicer: warning: Low bed adhesion\n"
    assert {p.name for p in ball.parent.iterdir()} == {"ball.xml", "ball.gcode", "my.ini", "bin"}


@pytest.mark.skipif(sys.platform == "win32", reason="programs are scripts")
@pytest.mark.parametrize(
    ("slicer", "program", "flag", "model", "out", "expected"),
    [
        ("cura", "CuraEngine", "-o", "model.stl", "x.gcode", ["slice", "-j", "{}", "-o"]),
        (
            "orca",
            "orca-slicer",
            "--export-3mf",
            "model.3mf",
            "x.3mf",
            ["--load-settings", "{}", "--slice", "0"],
        ),
    ],
)
def test_other_slicers_have_their_own_command_lines(
    slicer: str,
    program: str,
    flag: str,
    model: str,
    out: str,
    expected: list[str],
    ball: Path,
    installed: Path,
) -> None:
    log = install(installed, program, flag, model)
    profile = ball.with_name("my.json")
    profile.write_text("{}")
    options = "--slicer", slicer, "--profile", profile, "-q", *COARSE
    assert printed(ball, "-o", ball.with_name(out), *options) == 0
    assert json.loads(log.read_text())[: len(expected)] == [e.format(profile) for e in expected]
    assert ball.with_name(out).exists()


def test_a_missing_program_is_one_line(
    ball: Path, installed: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    assert printed(ball, "-o", ball.with_name("ball.gcode")) == 2
    error = capfd.readouterr().err
    assert (
        error
        == "fracslice: PrusaSlicer is not installed: no program prusa-slicer or PrusaSlicer on the path\n"
    )
    assert printed(ball, "-o", ball.with_name("ball.gcode"), "--slicer", "orca") == 2
    assert "ball.gcode: expected a file name that ends in .3mf" in capfd.readouterr().err


@pytest.mark.skipif(sys.platform == "win32", reason="programs are scripts")
def test_a_failure_is_one_line_and_leaves_no_file(
    ball: Path, installed: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    install(installed, "prusa-slicer", "--output", "model.3mf", status=3)
    assert printed(ball, "-o", ball.with_name("ball.gcode"), "-q", *COARSE) == 2
    assert capfd.readouterr().err == "fracslice: PrusaSlicer failed with status 1: no profile fits\n"
    assert {p.name for p in ball.parent.iterdir()} == {"ball.xml", "bin"}
