"""The commands as a person meets them: what they print, the files they leave, how they exit."""

from __future__ import annotations

import json
import os
import shlex
import signal
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace

import click
import numpy as np
import pytest
from click.testing import CliRunner
from fracslice.cli.main import NAMES, commands, run
from fracslice.cli.options import ClusterOptions

from fracslice.scene import library
from fracslice.volume.bricks import read_vdb

COMMAND = [sys.executable, "-c", "from fracslice.cli import main; main()"]


def fracslice(*arguments: object) -> int:
    return run([str(argument) for argument in arguments])


def test_mesh_writes_the_model_and_its_report(ball, tmp_path, capfd):
    model, report = tmp_path / "ball.stl", tmp_path / "ball.json"
    assert fracslice("mesh", ball, "-o", model, "--resolution", 32, "--report", report) == 0
    reported = json.loads(report.read_text())
    assert reported["watertight"]
    assert reported["bbox_mm"][1][2] == pytest.approx(20, rel=2e-3)
    assert model.stat().st_size == 84 + 50 * reported["triangles"]
    out, err = capfd.readouterr()
    assert "watertight, manifold" in out
    assert err == "", "no progress where nobody looks"


def test_quiet_layers_print_nothing_at_exit_either(ball, tmp_path):
    """Not even of what native code was left with."""
    arguments = [
        "slice",
        ball,
        "-o",
        tmp_path / "ball.sl1s",
        "--printer",
        "sl1s",
        "--layer",
        "1mm",
        "--quiet",
    ]
    done = subprocess.run([*COMMAND, *map(str, arguments)], check=True, capture_output=True, text=True)
    assert done.stdout == done.stderr == ""


def test_a_mesh_larger_than_memory_goes_to_stl(ball, tmp_path, capfd, monkeypatch):
    model, report = tmp_path / "ball.stl", tmp_path / "ball.json"
    monkeypatch.setattr("fracslice.jobs.mesh_steps.available_bytes", lambda: 1 << 20)
    assert fracslice("mesh", ball, "-o", model, "--resolution", 400, "--report", report) == 0
    reported = json.loads(report.read_text())
    assert (reported["printable"], reported["components"], reported["genus"]) == (True, 1, 0)
    assert model.stat().st_size == 84 + 50 * reported["triangles"]
    assert reported["volume_mm3"] == pytest.approx(4000 / 3 * np.pi, rel=1e-4)
    assert {path.name for path in tmp_path.iterdir()} == {"ball.xml", "ball.stl", "ball.json"}


def test_quiet_says_nothing(ball, tmp_path, capfd):
    assert fracslice("mesh", ball, "-o", tmp_path / "b.3mf", "--resolution", 16, "--quiet") == 0
    assert capfd.readouterr() == ("", "")


def test_size_set_and_base_change_what_is_made(ball, tmp_path, capfd):
    model = tmp_path / "b.stl"
    options = ("--size", "3cm", "--voxel", "1mm", "--set", "sphere.radius=2", "--base", "3mm")
    assert fracslice("mesh", ball, "-o", model, *options) == 0
    coarse = ("--layer", "1mm", "--pixel", "0.5mm", "--wall", "1mm", "--floor", "1mm")
    assert fracslice("check", model, "--json", *coarse) == 0
    reported = json.loads(capfd.readouterr().out.partition("\n{")[2].join(["{", ""]))
    low, high = reported["bbox_mm"]
    assert high[0] - low[0] == pytest.approx(30, rel=2e-3)
    assert high[2] == pytest.approx(27, abs=0.2)


def test_simplify_writes_fewer_triangles_and_says_how_near(ball, tmp_path, capfd):
    model, report = tmp_path / "b.stl", tmp_path / "b.json"
    options = ("--resolution", 48, "--simplify", "0.1mm", "--report", report)
    assert fracslice("mesh", ball, "-o", model, *options) == 0
    reported = json.loads(report.read_text())
    assert reported["triangles"] < reported["simplified"]["from_triangles"] / 3
    assert max(reported["simplified"]["bound_mm"], reported["simplified"]["back_mm"]) <= 0.1
    assert reported["printable"] and reported["surface_error_mm"]["max"] < 1e-4
    assert model.stat().st_size == 84 + 50 * reported["triangles"]
    assert "simplified from " in capfd.readouterr().out


def test_a_shipped_scene_is_known_by_its_name(tmp_path, capfd):
    assert (
        fracslice(
            "mesh", "menger-sponge", "-o", tmp_path / "m.ply", "--resolution", 27, "--set", "menger.level=1"
        )
        == 0
    )
    assert (tmp_path / "m.ply").exists()


def test_a_vdb_file_holds_distances_in_mm(ball, tmp_path):
    report = tmp_path / "b.json"
    assert (
        fracslice("mesh", ball, "-o", tmp_path / "b.vdb", "--resolution", 24, "-q", "--report", report) == 0
    )
    bricks = read_vdb(tmp_path / "b.vdb")
    assert bricks.voxel == pytest.approx(json.loads(report.read_text())["voxel_mm"])
    x, y, z = (
        bricks.origin + bricks.voxel * (bricks.ijk[:, None] + np.indices((8, 8, 8)).reshape(3, -1).T)
    ).T
    distance, band = np.sqrt(x**2 + y**2 + (z - 10) ** 2).T - 10, 3 * bricks.voxel
    assert abs(bricks.values - distance.clip(-band, band)).max() < 0.15 * bricks.voxel


def test_a_vdb_file_of_a_fractal_holds_distances_too(tmp_path):
    """It held the field's values, which are up to 5 times as steep."""
    assert fracslice("mesh", "mandelbulb", "-o", tmp_path / "b.vdb", "--resolution", 48, "-q") == 0
    grid = read_vdb(tmp_path / "b.vdb")
    slopes = abs(np.diff(grid.values.reshape(-1, 8, 8, 8), axis=3)) / grid.voxel
    assert abs(grid.values).max() == pytest.approx(3 * grid.voxel) and slopes.max() < 3


def test_a_file_of_that_name_goes_before_a_shipped_scene(ball, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    ball.rename(tmp_path / "mandelbulb")
    assert fracslice("mesh", "mandelbulb", "-o", "m.stl", "--resolution", 16) == 0


def test_check_says_whether_a_scene_would_print(ball, capfd):
    assert fracslice("check", ball, "--resolution", 16, "--size", "9mm", "--json") == 1, "it needs supports"
    reported = json.loads(capfd.readouterr().out)
    assert (reported["printable"], reported["components"], reported["genus"]) == (True, 1, 0)


def test_check_exits_1_for_a_model_with_a_hole(ball, tmp_path, capfd):
    model = tmp_path / "b.stl"
    assert fracslice("mesh", ball, "-o", model, "--resolution", 16, "-q") == 0
    data = bytearray(model.read_bytes()[:-50])
    data[80:84] = ((len(data) - 84) // 50).to_bytes(4, "little")
    model.write_bytes(data)
    assert fracslice("check", model) == 1
    assert "would not print: 3 open edges" in capfd.readouterr().out


def test_formulas_lists_and_describes(capfd):
    assert fracslice("formulas") == 0
    assert "mandelbulb" in capfd.readouterr().out
    assert fracslice("formulas", "box") == 0
    assert "expected: 3 numbers > 0" in capfd.readouterr().out


def test_scenes_lists_what_ships(capfd):
    assert fracslice("scenes") == 0
    lines = capfd.readouterr().out.splitlines()
    lines.remove("")
    assert [line.split()[0] for line in lines] == library.names() + library.gallery()
    assert all(len(line.split()) > 4 for line in lines)


def test_version_and_help(capfd):
    assert fracslice("--help") == 0
    assert fracslice("mesh", "--help") == 0
    text = capfd.readouterr().out
    assert "--resolution" in text
    assert "None" not in text  # a range without limits
    assert fracslice() == 2


def test_help_is_quick():
    """By the processor's time: on an idle machine the clock's is the same."""
    subprocess.run([*COMMAND, "--help"], check=True, capture_output=True)
    times = []
    for _ in range(5):
        before = os.times()
        subprocess.run([*COMMAND, "--help"], check=True, capture_output=True)
        after = os.times()
        times.append(
            after.children_user + after.children_system - before.children_user - before.children_system
        )
    assert min(times) < 0.3


def test_heavy_packages_are_not_loaded_for_help():
    code = "import sys; from fracslice.cli.main import run; run(['--help']); print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    loaded = set(done.stdout.splitlines()[-1].split())
    heavy = "numpy numba trimesh manifold3d pymeshlab pyvista lxml rich fracslice.scene fracslice.volume"
    assert loaded & set(heavy.split()) == set()


def loaded_by(*arguments: object) -> set[str]:
    """Modules that a command loads; its status is 0."""
    code = "import sys; from fracslice.cli.main import run; print(run(sys.argv[1:]), *sys.modules)"
    command = [sys.executable, "-c", code, *map(str, arguments)]
    status, *modules = subprocess.run(command, check=True, capture_output=True, text=True).stdout.split()
    assert status == "0"
    return set(modules)


COMPILERS = {"numba", "llvmlite.binding", "llvmlite.ir"}
"""Loading them takes a tenth of a small job, or more."""


def test_a_mesh_does_without_numba(ball, tmp_path, monkeypatch):
    """Nor LLVM, once the scene is compiled."""
    monkeypatch.setenv("FRACSLICE_CACHE", str(tmp_path / "cache"))
    command = "mesh", ball, "-o", tmp_path / "b.stl", "--resolution", 24, "--quiet"
    assert "numba" not in loaded_by(*command)
    loaded = loaded_by(*command)
    assert loaded & COMPILERS == set()
    assert sum(name.startswith("fracslice") for name in loaded) < 195, "each takes a millisecond"


@pytest.mark.nightly
def test_a_slice_does_without_numba(ball, tmp_path, monkeypatch):
    """Nor LLVM, once the scene is compiled."""
    monkeypatch.setenv("FRACSLICE_CACHE", str(tmp_path / "cache"))
    command = "slice", ball, "-o", tmp_path / "a.svg", "--size", "5mm", "--layer", "0.5mm", "--quiet"
    assert "numba" not in loaded_by(*command)
    loaded = loaded_by(*command)
    assert loaded & COMPILERS == set()
    assert sum(name.startswith("fracslice") for name in loaded) < 195, "each takes a millisecond"


def test_the_exit_looks_for_no_garbage():
    """That takes a tenth of a small job."""
    code = """if True:
        import gc, sys
        from fracslice.cli import main
        try:
            main(["--help"])
        except SystemExit as end:
            print(end.code, gc.get_freeze_count() > 10_000)"""
    done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    assert done.stdout.endswith("0 True\n")


@pytest.mark.skipif(sys.platform != "linux", reason="parameters of glibc")
def test_freed_memory_is_laid_once():
    """A mesh of 256 voxels of a Menger sponge took 5.0 CPU seconds and takes 3.6."""
    code = """if True:
        import gc
        from resource import RUSAGE_SELF, getrusage
        from fracslice.cli import main

        def faults():
            before = getrusage(RUSAGE_SELF).ru_minflt
            for _ in range(20):
                [bytearray(3 << 20) for _ in range(6)]
            print(getrusage(RUSAGE_SELF).ru_minflt - before)

        gc.freeze = faults  # main calls it before it exits
        main(["--version"])
    """
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert int(result.stdout.split()[-1]) < 15_000


def test_progress_is_shown_on_a_terminal_only(ball, tmp_path):
    reader, writer = os.openpty()
    arguments = ["mesh", str(ball), "-o", str(tmp_path / "b.stl"), "--resolution", "24"]
    with subprocess.Popen([*COMMAND, *arguments], stdout=subprocess.PIPE, stderr=writer) as running:
        os.close(writer)
        shown = b"".join(iter(lambda: read(reader), b""))
        assert b"sampling" not in running.stdout.read()
    os.close(reader)
    assert running.returncode == 0
    assert shown.index(b"preparing") < shown.index(b"sampling"), "while a new scene is compiled"


def read(terminal: int) -> bytes:
    """What was written to a terminal; nothing once its other side is closed."""
    try:
        return os.read(terminal, 1 << 16)
    except OSError:
        return b""


@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="needs /proc")
@pytest.mark.parametrize(("number", "status"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_signal_stops_it_and_leaves_no_file(tmp_path, number, status):
    target = tmp_path / "out"
    target.mkdir()
    arguments = ["mesh", "mandelbulb", "-o", str(target / "m.stl"), "--resolution", "768"]
    running = subprocess.Popen([*COMMAND, *arguments], stderr=subprocess.PIPE, text=True)
    while not listens(running.pid):
        time.sleep(0.05)
    time.sleep(0.5)
    running.send_signal(number)
    assert running.communicate(timeout=60)[1] == "fracslice: stopped; nothing was written\n"
    assert running.returncode == status
    assert list(target.iterdir()) == []


@pytest.mark.parametrize("command", ["render", "explore"])
def test_a_signal_while_a_picture_is_written_leaves_it_whole(ball, tmp_path, monkeypatch, command):
    flush = os.fsync

    def pressed(handle):
        monkeypatch.undo()
        os.kill(os.getpid(), signal.SIGINT)
        flush(handle)

    monkeypatch.setattr(os, "fsync", pressed)
    target = tmp_path / "a.png"
    assert run([command, str(ball), "-o", str(target), "--size", "8x8", "--samples", "1", "-q"]) == 0
    assert target.exists()


def test_a_signal_while_workers_end_does_not_stop_what_is_done(tmp_path, monkeypatch):
    @contextmanager
    def connected(*_):
        yield SimpleNamespace(pieces=SimpleNamespace(tidy=lambda: None))
        os.kill(os.getpid(), signal.SIGINT)

    monkeypatch.setattr("fracslice.cluster.connect", connected)
    given = {"output": str(tmp_path / "a.stl"), "cluster": "local:1", "shard": None, "store": None}
    with ClusterOptions(**given, threads=1, quiet=True).working() as work:
        assert work.cluster is not None


def listens(pid: int) -> bool:
    """Whether a process has a handler for SIGTERM."""
    status = dict(line.split(":", 1) for line in Path(f"/proc/{pid}/status").read_text().splitlines())
    return bool(int(status["SigCgt"], 16) >> (signal.SIGTERM - 1) & 1)


@pytest.mark.parametrize(
    ("module", "command"),
    [
        ("typing", "mesh"),
        ("click", "mesh"),
        ("fracslice.common.memory", "mesh"),
        ("fracslice.cli.mesh", "mesh"),
        ("fracslice.scene", "mesh"),
        ("fracslice.cli.mesh", "--help"),
    ],
)
def test_a_signal_during_an_import_is_one_line(ball, tmp_path, module, command):
    code = f"""if True:
        import os, signal, sys
        signal.signal(signal.SIGINT, signal.default_int_handler)
        class Interrupts:
            def find_spec(self, name, path=None, target=None):
                if name == {module!r}:
                    os.kill(os.getpid(), signal.SIGINT)
        sys.meta_path.insert(0, Interrupts())
        from fracslice.cli import main
        main()"""
    arguments = [command, str(ball), "-o", str(tmp_path / "b.stl"), "--resolution", "24"]
    done = subprocess.run([sys.executable, "-c", code, *arguments], capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (130, "fracslice: stopped; nothing was written\n")


@pytest.mark.parametrize("name", NAMES)
def test_every_help_ends_with_examples_that_parse(name):
    shown = CliRunner().invoke(commands, [name, "--help"]).output
    examples = shown.partition("Examples:\n")[2].splitlines()
    assert examples
    for example in examples:
        program, command, *arguments = shlex.split(example)
        assert (program, command) == ("fracslice", name)
        commands.get_command(click.Context(commands), name).make_context(name, arguments)
