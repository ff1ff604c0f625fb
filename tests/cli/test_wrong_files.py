"""Every command, pointed at any wrong file or told what cannot be: one line, status 2, nothing left."""

from __future__ import annotations

import shutil
import zipfile
from pathlib import Path

import pytest
from fracslice.cli.main import run

from fracslice.formats import ENDINGS, write
from tests.mesh import shapes

BALL = '<scene version="1"><solid size="20mm"><sphere/></solid></scene>'
COMMANDS = {
    "mesh": "mesh {} -o out/x.stl",
    "slice": "slice {} -o out/x.json --layer 5mm",
    "render": "render {} -o out/x.png",
    "check": "check {}",
    "check layers": "check {} --layer 5mm",
    "show": "show {}",
    "fly": "fly {}",
}

TAKE_MODELS = ("mesh", "slice", "render", "check", "show")


@pytest.fixture(scope="module")
def wrong(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of files that are not what they should be."""
    folder = tmp_path_factory.mktemp("wrong")
    picture = b"\x89PNG\r\n\x1a\n" + bytes(range(256)) * 4
    (folder / "ball.xml").write_text(BALL)
    (folder / "out").mkdir()
    (folder / "folder").mkdir()
    for ending in ENDINGS:
        whole = folder / f"whole{ending}"
        write(shapes.cube(), whole)
        data = whole.read_bytes()
        (folder / f"cut{ending}").write_bytes(data[: len(data) * 3 // 5])
        (folder / f"head{ending}").write_bytes(data[:10])
        (folder / f"empty{ending}").touch()
        (folder / f"picture{ending}").write_bytes(picture)
        (folder / f"xml{ending}").write_text('<svg xmlns="http://www.w3.org/2000/svg"/>')
        (folder / f"folder{ending}").mkdir()
    shutil.copy(folder / "whole.stl", folder / "stl.xml")
    (folder / "empty.xml").touch()
    (folder / "picture.png").write_bytes(picture)
    (folder / "svg.xml").write_text('<svg xmlns="http://www.w3.org/2000/svg"/>')
    (folder / "cut.xml").write_text(BALL[:40])
    with zipfile.ZipFile(folder / "other.3mf", "w") as archive:
        archive.writestr("a.txt", "a")
    shutil.copy(folder / "other.3mf", folder / "other.zip")
    return folder


def refused(folder: Path, command: str, capfd: pytest.CaptureFixture[str]) -> str:
    """The one line that a command is refused with."""
    before = {path: path.stat().st_mtime_ns for path in folder.rglob("*")}
    assert run(command.split()) == 2
    out, err = capfd.readouterr()
    assert out == ""
    assert err.startswith("fracslice: ") and err.count("\n") == 1
    for jargon in ("Error:", "not well-formed (invalid token)", "index", "Traceback", "NoneType"):
        assert jargon not in err
    assert {path: path.stat().st_mtime_ns for path in folder.rglob("*")} == before
    return err.removeprefix("fracslice: ").rstrip()


NO_SCENE = 'not a scene: expected XML that begins with <scene version="1">'
NO_FILE = "No such file or directory"
MODEL = "expected a scene, found a model"

SCENES = {
    **{f"whole{ending}": MODEL for ending in ENDINGS},
    "stl.xml": NO_SCENE,
    "picture.png": NO_SCENE,
    "other.zip": NO_SCENE,
    "empty.xml": "expected a scene, the file is empty",
    "svg.xml": "<svg> is not a known element; expected <scene>",
    "cut.xml": "not well-formed XML",
    "folder": "Is a directory",
    "none.xml": NO_FILE,
    "none.png": NO_FILE,
}


@pytest.mark.parametrize("command", COMMANDS)
def test_files_that_are_no_scenes(command: str, wrong: Path, capfd, monkeypatch) -> None:
    monkeypatch.chdir(wrong)
    monkeypatch.setattr("fracslice.viewer.viewer.need_screen", lambda: None)
    for name, message in SCENES.items():
        if not (name.startswith("whole") and command.split()[0] in TAKE_MODELS):
            line = refused(wrong, COMMANDS[command].format(name), capfd)
            assert line.startswith(name) and message in line


MODELS = {
    "cut.stl": "6 of 12 triangles; the file is cut short",
    "cut.3mf": "not a whole 3MF file: it is cut short, or of another kind",
    "cut.ply": "not a whole PLY file: it is cut short",
    "cut.glb": "not a whole GLB file: it is cut short",
    **{f"head{ending}": "" for ending in ENDINGS},
    **{f"empty{ending}": "the file is empty" for ending in ENDINGS},
    **{f"picture{ending}": "" for ending in ENDINGS},
    **{f"xml{ending}": "" for ending in ENDINGS},
    **{f"folder{ending}": "Is a directory" for ending in ENDINGS},
    **{f"none{ending}": "no such file" for ending in ENDINGS},
    "other.3mf": "not a whole 3MF file",
}


@pytest.mark.parametrize("command", TAKE_MODELS)
def test_files_that_are_no_models(command: str, wrong: Path, capfd, monkeypatch) -> None:
    monkeypatch.chdir(wrong)
    for name, message in MODELS.items():
        line = refused(wrong, COMMANDS[command].format(name), capfd)
        assert line.startswith(f"{name}: ") and message in line
        assert not any(part.replace(".", "").isdigit() and "." in part for part in line.split()[1:])


@pytest.mark.skipif(not Path("/proc/self/mem").exists(), reason="needs /proc")
def test_a_file_that_cannot_be_read(wrong: Path, capfd, monkeypatch) -> None:
    monkeypatch.chdir(wrong)
    assert "Input/output error" in refused(wrong, "mesh /proc/self/mem -o out/x.stl", capfd)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        *((f"mesh ball.xml -o out/x.{e}", ".stl, .vdb") for e in ("step", "png", "sl1", "xml", "gz")),
        *((f"slice ball.xml -o out/x.{e}", "or a folder") for e in ("step", "stl", "png", "xml")),
        *((f"render ball.xml -o out/x.{e}", "known are .png") for e in ("gif", "bmp", "stl")),
        ("check ball.xml --layer 5mm --picture out/x.gif", "expected a file name that ends in .png"),
        ("slice ball.xml -o out/x.json --preview out/x.gif", "ends in .png or .webp"),
        ("slice ball.xml -o ball.xml --format json --layer 5mm", "ball.xml: expected another file"),
        ("slice ball.xml -o out/x.png --format png --preview out/x.png", "named twice"),
        ("render ball.xml -o out/x.png --state out/x.png", "named twice"),
        ("render ball.xml -o out/x.png --state ball.xml", "named twice"),
        ("render ball.xml -o out/x.png --state none/x.npz", "does not exist"),
        ("render ball.xml -o out/x.png --state folder", "is a folder"),
        ("render ball.xml -o out/x.png --pass-images ball.xml", "expected a folder"),
        ("render ball.xml -o out/x.png --pass-images ball.xml/x", "is a file, not a folder"),
        ("mesh ball.xml -o out/x.stl --cache ball.xml", "ball.xml: expected a folder"),
        ("mesh ball.xml -o out/x.vdb --simplify 1mm", "--simplify: only for meshes"),
        ("mesh ball.xml -o out/x.vdb --chord 1mm", "--chord: only for meshes"),
        ("check ball.xml --store out", "--store: only with --layer"),
        ("check ball.xml -o out/x.stl", "--output: only with --fix"),
        *((f"check ball.xml --layer 5mm --{o} 1", f"--{o}: only for") for o in ("voxel", "dust", "chord")),
        ("check ball.xml --layer 5mm --proved", "--proved: only for meshes"),
        ("check whole.stl --proved", "--proved: only for scenes"),
        ("mesh ball.xml -o out/x.3mf --implicit --proved", "--proved: only for meshes"),
        ("show whole.stl --base 1mm", "--base: only for scenes, and a model was given"),
        ("show whole.stl --set sphere.radius=1", "--set: only for scenes"),
        ("mesh ball.xml -o out/x.stl --dust 5mm3", "'5mm3': expected a number >= 0, in mm3"),
        ("mesh ball.xml -o out/x.stl --threads 1.5", "'1.5' is not a valid whole number"),
        *(
            (f"mesh ball.xml -o out/x.stl --resolution 16 --{n} 1000m", f"{n} 1e+06 mm: expected at most")
            for n in ("bridge", "gap", "thickness", "hollow", "base", "raft")
        ),
        ("mesh ball.xml -o out/x.stl --resolution 16 --hollow 2mm --drain 1m", "drain 1000 mm: expected"),
        ("slice ball.xml -o out/x.json --up inf 0 1", "inf: expected a finite number"),
        ("slice ball.xml -o out/x.json --up 1e300 0 1", "1e+300 0 1: expected 3 numbers"),
        ("slice ball.xml -o out/x.json --layer 5mm --exposure -1 1", "exposure=-1.0: expected"),
        ("slice ball.xml -o out/layers --layer 5mm --gamma 0", "'0': expected a number > 0"),
        *(
            (f"slice ball.xml -o out/x.json --layer 5mm --{o}", f"--{o.split()[0]}: only for pictures")
            for o in ("compensation 1mm", "gamma 2", "levels 8", "blur 1", "sections 2")
        ),
        ("slice ball.xml -o out/x.cli --layer 5mm --mirror", "mirror: only for pictures, and cli files"),
        (
            "slice ball.xml -o out/x.json --compensation 1ft",
            "'1ft': expected 0, or a length such as 0.05mm or",
        ),
        ("explore ball.xml -o out/x.png --spread nan", "'nan': expected a number > 0 and <= 4"),
        ("mesh ball.xml -o out/x.stl --set animation.fps=3", "settings do not change <animation>"),
        ("bench --limit nan", "nan: expected a finite number"),
        ("bench --limit 0", "0: expected a number > 0"),
        ("bench --peer a={workload}{resolution}{output}'", "no closing quotation"),
    ],
)
def test_what_cannot_be(arguments: str, message: str, wrong: Path, capfd, monkeypatch) -> None:
    monkeypatch.chdir(wrong)
    assert message in refused(wrong, arguments, capfd)


@pytest.mark.parametrize("option", ["-o", "--report", "--picture", "--cache"])
def test_an_empty_name(option: str, wrong: Path, capfd, monkeypatch) -> None:
    monkeypatch.chdir(wrong)
    assert run(["mesh", "ball.xml", "-o", "out/x.stl", option, ""]) == 2
    assert "expected the name of a file, found nothing" in capfd.readouterr().err
    assert not list((wrong / "out").iterdir())
