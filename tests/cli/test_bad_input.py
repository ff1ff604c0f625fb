"""Bad input gets one clear line on stderr and exit status 2, and leaves no file."""

from __future__ import annotations

import errno
import os
import signal
from contextlib import suppress
from pathlib import Path

import pytest
from fracslice.cli.main import run

BALL = '<scene version="1"><solid size="20mm"><sphere/></solid></scene>'
LAUGHS = "".join(f'<!ENTITY l{i} "{f"&l{i - 1};" * 10}">' for i in range(1, 12))


def scene_of(inside: str, size: str = "20mm") -> str:
    return f'<scene version="1">\n<solid size="{size}">\n{inside}\n</solid>\n</scene>'


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "ball.xml").write_text(BALL)
    (tmp_path / "empty.xml").write_text(scene_of("<difference><sphere/><box size='9 9 9'/></difference>"))
    (tmp_path / "ball.toml").write_bytes(b"\xff")
    (tmp_path / "out").mkdir()
    monkeypatch.chdir(tmp_path)
    return tmp_path


def refused(capfd: pytest.CaptureFixture[str], folder: Path, *arguments: str) -> str:
    """The one line that a command is refused with."""
    before = set(folder.rglob("*"))
    assert run(arguments) == 2
    out, err = capfd.readouterr()
    assert out == ""
    assert err.startswith("fracslice: ")
    assert err.count("\n") == 1
    assert set(folder.rglob("*")) == before, "no file is left"
    return err.removeprefix("fracslice: ").rstrip()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (scene_of("<sphere>"), "bad.xml:4: not well-formed XML: mismatched tag"),
        (scene_of("<spere/>"), "bad.xml:3: <spere> is not a known element; did you mean <sphere>?"),
        (
            scene_of("<sphere radios='1'/>"),
            'bad.xml:3: <sphere> radios="1": is not an attribute of it; did you mean radius?',
        ),
        (scene_of("<sphere radius='big'/>"), 'bad.xml:3: <sphere> radius="big": expected a number > 0'),
        (scene_of("<sphere radius='nan'/>"), 'bad.xml:3: <sphere> radius="nan": expected a number > 0'),
        (scene_of("<sphere radius='inf'/>"), 'bad.xml:3: <sphere> radius="inf": expected a number > 0'),
        (scene_of("<sphere radius='-1'/>"), 'bad.xml:3: <sphere> radius="-1": expected a number > 0'),
        (scene_of("<sphere/>", "0mm"), 'bad.xml:2: <solid> size="0mm": expected a length above zero'),
        (
            scene_of("<union>\n<sphere/>\n<gyroid/></union>"),
            "bad.xml:5: <gyroid> has no end along x, y and z; put <bounds> around it",
        ),
        (
            scene_of("<intersection><sphere/><transform translate='9 0 0'><box/></transform></intersection>"),
            "empty",
        ),
        (scene_of("<bounds min='1 1 1' max='2 2 2'><sphere radius='.5'/></bounds>"), "empty"),
        (scene_of("<difference><sphere/><sphere radius='2'/></difference>"), "is outside"),
        (
            f'<!DOCTYPE a [<!ENTITY l0 "lol">{LAUGHS}]>{scene_of("&l11;")}',
            "bad.xml:1: <!DOCTYPE>: document types and",
        ),
        ("", "bad.xml: expected a scene, the file is empty"),
        ("\x00\x7fELF", "bad.xml: not a scene: expected XML that begins with <scene"),
    ],
)
def test_scenes(text, message, folder, capfd):
    (folder / "bad.xml").write_text(text)
    assert message in refused(capfd, folder, "mesh", "bad.xml", "-o", "out/x.stl", "--resolution", "32")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ("mesh none.xml -o out/x.stl", "none.xml: No such file or directory"),
        ("mesh out -o out/x.stl", "out: Is a directory"),
        ("mesh mandelblub -o out/x.stl", "mandelblub: no such scene; did you mean mandelbulb?"),
        ("mesh ball.xml", "Missing option '-o'"),
        ("mesh -o out/x.stl", "Missing argument 'SCENE|MODEL'"),
        ("mesh ball.xml -o out/x.foo", "out/x.foo: unknown kind of file; known are .3mf"),
        ("mesh ball.xml -o out", "unknown kind of file"),
        ("mesh ball.xml -o none/x.stl", "none/x.stl: the folder"),
        ("mesh ball.xml -o ball.xml/x.stl", "is a file, not a folder"),
        ("mesh ball.xml -o out/x.stl --report none/x.json", "none/x.json: the folder"),
        ("mesh ball.xml -o out/x.stl --report out/x.txt", "expected a file name that ends in .json"),
        ("mesh ball.xml -o out/x.stl --picture out/x.gif", "expected a file name that ends in .png"),
        ("mesh ball.xml -o out/x.stl --size 0", "'0': expected a length above zero"),
        ("mesh ball.xml -o out/x.stl --scale 10", "'10': expected a percentage such as 102%, or three"),
        ("mesh ball.xml -o out/x.stl --scale 102%,101%", "expected a percentage such as 102%, or three"),
        ("mesh ball.xml -o out/x.stl --up 0 0 0", "0 0 0: expected 3 numbers, not all zero"),
        ("mesh ball.xml -o out/x.stl --size nan", "'nan': expected a length"),
        ("mesh ball.xml -o out/x.stl --size 8parsec", "'8parsec': expected a length"),
        ("mesh ball.xml -o out/x.stl --voxel 0mm", "'0mm': expected a length above zero"),
        ("mesh ball.xml -o out/x.stl --voxel -1mm", "'-1mm': expected a length above zero"),
        (
            "mesh ball.xml -o out/x.stl --voxel 1m",
            "voxel 1000mm: expected 0.001221mm to 2.5mm for an object of 20mm",
        ),
        ("mesh ball.xml -o out/x.stl --voxel 1um", "voxel 0.001mm: expected 0.001221mm to 2.5mm"),
        (
            "mesh ball.xml -o out/x.stl --voxel 1mm --resolution 64",
            "voxel and resolution: expected one of them",
        ),
        ("mesh ball.xml -o out/x.stl --simplify 0", "'0': expected a length above zero"),
        (
            "mesh ball.xml -o out/x.stl --simplify 1m",
            "simplify 1000mm: expected at most 5mm for an object of",
        ),
        (
            "mesh ball.xml -o out/x.stl --drain 2mm",
            "--drain: expected --hollow, --drain-at, or a hollow",
        ),
        ("mesh ball.xml -o out/x.stl --resolution 16384", "bricks: expected at most 8"),
        ("animate ball.xml -o out/x.gif", "ball: expected an <animation> in the scene; animate --fly"),
        ("slice ball.xml -o - --layer 1mm", "-: expected the name of a file; standard input and output"),
        ("slice ball.xml -o /dev/null --layer 1mm", "/dev/null: expected a folder for png files"),
        ("slice ball.xml -o out/x.sl1 --printer ball.toml", "ball.toml: expected text in UTF-8"),
        ("mesh empty.xml -o out/x.stl", "empty.xml: the scene is empty"),
        ("slice ball.xml -o out/x --layer 2cm", "as high as the object: 20 mm; expected a lower layer or"),
        ("mesh ball.xml -o out/x.stl --resolution 0", "'0': expected a number >= 8 and <= 16384"),
        ("mesh ball.xml -o out/x.stl --cluster foo", "'foo': expected local, local:N or the address of"),
        ("mesh ball.xml -o out/x.stl --set sphere.radius=1..2:1e-9", "expected at most 10000 values"),
        (f"mesh ball.xml -o out/{'x' * 300}.stl", "File name too long"),
        ("render ball.xml -o out/x.jpg --bits 16", "bits 16: expected a .png file"),
        ("mesh ball.xml -o out/x.stl --resolution many", "'many': expected a number >= 8"),
        ("mesh ball.xml -o out/x.stl --threads 0", "0 is not in the range"),
        ("mesh ball.xml -o out/x.stl --device gpu", "'gpu' is not one of 'cpu', 'cuda', 'auto'"),
        ("mesh ball.xml -o out/x.stl --dust nan", "'nan': expected a number >= 0, in mm3"),
        (
            "mesh ball.xml -o out/x.stl --keep some",
            '\'some\': expected a whole number from 1 to 1000000, "all" or "largest"',
        ),
        (
            "mesh ball.xml -o out/x.stl --set sphre.radius=2",
            "the scene has no <sphre>; did you mean <sphere>?",
        ),
        ("mesh ball.xml -o out/x.stl --set radius=2", "expected ELEMENT.ATTRIBUTE=VALUE"),
        ("mesh ball.xml -o out/x.stl --set sphere.radius=0", "sphere.radius=0: expected a number > 0"),
        ("mesh ball.xml -o out/x.stl --voxl 1mm", "No such option '--voxl'"),
        ("check none.stl", "none.stl: no such file"),
        ("check ball.stl", "ball.stl: not an STL file"),
        ("check ball.stl --voxel 1mm", "--voxel: only for scenes"),
        ("check ball.stl --set sphere.radius=1", "--set: only for scenes"),
        ("show none.stl", "none.stl: no such file"),
        ("formulas mandelblub", "mandelblub: no such formula; did you mean mandelbulb?"),
        ("msh ball.xml", "No such command 'msh'"),
    ],
)
def test_command_lines(arguments, message, folder, capfd):
    (folder / "ball.stl").write_text("no model")
    assert message in refused(capfd, folder, *arguments.split())


def test_a_voxel_count_that_does_not_fit_in_memory(folder, capfd, monkeypatch):
    monkeypatch.setattr("fracslice.jobs.mesh_steps.available_bytes", lambda: 1 << 28)
    line = refused(capfd, folder, "mesh", "ball.xml", "-o", "out/x.3mf", "--resolution", "800")
    assert "GB of memory" in line
    assert line.endswith("mm fits, and an .stl file is written piece after piece")


@pytest.mark.parametrize(
    "error",
    [
        MemoryError("std::bad_alloc"),
        RuntimeError("can't start new thread"),
        ImportError("libx.so: failed to map segment from shared object"),
    ],
)
def test_a_lack_of_memory_is_one_line(error, folder, capfd, monkeypatch):
    def lacking(*_):
        raise error

    monkeypatch.setattr("fracslice.jobs.mesh_steps.sample_surface", lacking)
    assert run(["mesh", "ball.xml", "-o", "out/x.stl", "--resolution", "24"]) == 1
    assert capfd.readouterr().err.startswith("fracslice: out of memory: a coarser voxel")


def test_a_grid_that_is_too_large_is_told_in_voxels_and_mm(folder, capfd):
    error = refused(capfd, folder, "mesh", "ball.xml", "-o", "x.stl", "--resolution", "16384")
    assert "expected at most 8172 voxels, or a voxel 2 times as large, 0.00245 mm" in error


def test_a_full_disk(folder, capfd, monkeypatch):
    def full(_: int) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr("os.fsync", full)
    line = refused(capfd, folder, "mesh", "ball.xml", "-o", "out/x.stl", "--resolution", "16")
    assert line == "out/x.stl: the disk is full; the file was not written"


@pytest.mark.parametrize("ending", ["xml", "stl", "3mf", "ply", "obj", "glb"])
def test_a_pipe(ending, folder, capfd):
    os.mkfifo(folder / f"pipe.{ending}")
    line = refused(capfd, folder, "check", f"pipe.{ending}")
    assert line == f"pipe.{ending}: expected a file, found a pipe or a device"


@pytest.mark.parametrize(
    ("number", "reader", "name"),
    [
        (signal.SIGINT, "fracslice.mesh.models.read_mesh", "ball.stl"),
        (signal.SIGTERM, "fracslice.mesh.models.read_mesh", "ball.stl"),
        (signal.SIGTERM, "fracslice.scene.read", "ball.xml"),
    ],
)
def test_the_first_signal_ends_reading(number, reader, name, folder, capfd, monkeypatch):
    def reading(*_: object, **__: object) -> None:
        signal.raise_signal(number)
        pytest.fail("it goes on")

    def going_on(*_: object, **__: object) -> None:
        with suppress(BaseException):
            signal.raise_signal(number)

    monkeypatch.chdir(folder)
    for read in (reading, going_on):
        monkeypatch.setattr(reader, read)
        assert run(["check", name]) == 128 + number
        assert capfd.readouterr().err == "fracslice: stopped; nothing was written\n"


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_a_folder_that_is_not_writable(folder, capfd):
    (folder / "out").chmod(0o500)
    assert "not writable" in refused(capfd, folder, "mesh", "ball.xml", "-o", "out/x.stl")


def test_an_old_file_survives_bad_input(folder, capfd):
    (folder / "out/x.stl").write_text("old")
    refused(capfd, folder, "mesh", "ball.xml", "-o", "out/x.stl", "--set", "sphere.radius=0")
    assert (folder / "out/x.stl").read_text() == "old"
