"""fracslice print, with a slicer that the test writes."""

from __future__ import annotations

import json
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
from fracslice.cli.main import run

from fracslice.export.sending import Figures, read_figures
from fracslice.export.slicer_profiles import shipped
from fracslice.mesh.models import read_mesh
from tests.waiting import wait_until

pytestmark = pytest.mark.once

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

ORCA = PROGRAM.replace('open(out, "w")', 'open(os.path.join(folder, out), "w")').replace(
    "shutil.copy(sys", 'folder = sys.argv[sys.argv.index("--outputdir") + 1]\nshutil.copy(sys'
)
"""The name of the file is relative to the output folder."""

COARSE = "--voxel", "1mm", "--simplify", "0.1mm"


@pytest.fixture
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder of programs, the only one on the path."""
    folder = tmp_path / "bin"
    folder.mkdir()
    monkeypatch.setenv("PATH", str(folder))
    return folder


def install(folder: Path, name: str, flag: str, model: str, status: int = 0, script: str = PROGRAM) -> Path:
    """Write a slicer; return the file of its arguments."""
    log, program = folder / "arguments.json", folder / name
    paths = {"log": str(log), "model": str(folder / model)}
    program.write_text(script.format(python=sys.executable, flag=flag, status=status, **paths))
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
def test_each_bed_of_parts_has_a_file(ball: Path, installed: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """Two halves that fill a bed each, without room for the pegs beside them; or copies on one bed."""
    install(installed, "prusa-slicer", "--output", "model.3mf")
    out = ball.with_name("ball.gcode")
    coarse = "--voxel", "2.5mm", "--simplify", "0.5mm", "--threads", "1"
    assert printed(ball, "-o", out, "--size", "40mm", "--bed", "42x21x42mm", *coarse) == 0
    files = sorted(path.name for path in ball.parent.glob("*.gcode"))
    assert files[:2] == ["ball-1.gcode", "ball-2.gcode"] and not out.exists()
    shown = capfd.readouterr().out.splitlines()
    assert [line.split(": ")[0].rpartition("/")[2] for line in shown[1:]] == files
    assert printed(ball, "-o", out, "--copies", "3", *coarse) == 0
    mesh = read_mesh(str(installed / "model.3mf"))
    assert out.exists() and mesh.to_trimesh().body_count == 3


@pytest.mark.parametrize(
    ("options", "reported"),
    [
        (["--copies", "2", "--parts", "2x1x1"], "--copies: not with parts"),
        (["--parts", "2x1x1", "--send", "prusalink://host"], "--send: expected one file"),
        (["--parts", "2x1x1", "--heights", "0.1mm..0.2mm"], "--heights: not for parts"),
        (["--spacing", "1mm"], "--spacing: only for --copies"),
    ],
)
def test_what_copies_and_parts_have_not_is_one_line(
    options: list[str], reported: str, ball: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    assert printed(ball, "-o", ball.with_name("ball.gcode"), *options) == 2
    error = capfd.readouterr().err
    assert reported in error and error.count("\n") == 1


@pytest.mark.skipif(sys.platform == "win32", reason="programs are scripts")
def test_curaengine_reads_definitions_before_the_model(ball: Path, installed: Path) -> None:
    log = install(installed, "CuraEngine", "-o", "model.stl")
    profile, out = ball.with_name("my.json"), ball.with_name("x.gcode")
    profile.write_text("{}")
    assert printed(ball, "-o", out, "--slicer", "cura", "--profile", profile, "-q", *COARSE) == 0
    given = json.loads(log.read_text())
    assert given[:4] == ["slice", "-j", str(profile), "-o"] and given[-2] == "-l"
    assert out.read_text() == "G28"


@pytest.mark.skipif(sys.platform == "win32", reason="programs are scripts")
@pytest.mark.parametrize(("slicer", "program"), [("orca", "orca-slicer"), ("bambu", "bambu-studio")])
def test_printer_process_and_filament_go_to_their_own_options(
    slicer: str, program: str, ball: Path, installed: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """The program writes to its output folder and leaves a result.json there, never where it was started."""
    log = install(installed, program, "--export-3mf", "model.3mf", script=ORCA)
    out, options = ball.with_name("x.3mf"), ["--slicer", slicer, "-q", *COARSE]
    profiles = []
    for kind in ("filament", "machine", "process"):
        profiles.append(ball.with_name(f"{kind}.json"))
        profiles[-1].write_text(json.dumps({"type": kind}))
        options += ["--profile", str(profiles[-1])]
    assert printed(ball, "-o", out, *options) == 0
    filament, machine, process = map(str, profiles)
    given = json.loads(log.read_text())
    assert given[:4] == ["--load-settings", f"{machine};{process}", "--load-filaments", filament]
    assert given[4:8] == ["--arrange", "1", "--slice", "0"]
    assert given[8] == "--outputdir" and given[10:12] == ["--export-3mf", "x.3mf"]
    assert out.read_text() == "G28"
    capfd.readouterr()
    profiles[0].write_text("{}")
    assert printed(ball, "-o", out, *options) == 2
    assert "filament.json: type None: expected machine, process or filament" in capfd.readouterr().err


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


@pytest.mark.skipif(sys.platform != "linux", reason="needs /proc")
@pytest.mark.parametrize("cancelled", [False, True])
def test_a_slicer_ends_with_the_process_that_started_it(cancelled: bool, tmp_path: Path) -> None:
    """And what the slicer started, whether the process is killed or the work is cancelled."""
    program = f"cd {tmp_path}; sleep 97 & echo $! > new; mv new pid; wait"
    code = f"""if True:
        import threading
        from fracslice.export.sending import _run_program
        from fracslice.work import Work
        work = Work(1)
        if {cancelled}:
            threading.Timer(1, work.cancel.set).start()
        _run_program(["sh", "-c", {program!r}], work, "")
    """
    with subprocess.Popen([sys.executable, "-c", code], stderr=subprocess.DEVNULL) as process:
        wait_until((tmp_path / "pid").exists, 20)
        slicer = Path(f"/proc/{(tmp_path / 'pid').read_text().strip()}/cmdline")
        assert b"97" in slicer.read_bytes()
        if not cancelled:
            process.kill()
    wait_until(lambda: not slicer.exists() or not slicer.read_bytes(), 20)


@pytest.mark.skipif(sys.platform == "win32", reason="programs are scripts")
def test_the_summary_has_what_the_slicer_says(
    ball: Path, installed: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """Time, weight and cost; and no settings that happen to have the word."""
    said = r"; filament used [mm] = 920.5, 79.5\n; total filament used [g] = 12.31\n"
    said += r"; total filament cost = 0.5\n"
    said += r"; estimated printing time (normal mode) = 1d 2h 3m 40s\n"
    script = PROGRAM.replace('write("G28")', f'write("G28\\n{said}")').replace(
        'print("Slicing done"',
        'print(\'error_limit = 3\\n"warning": [1, 2]\\nnozzle_error = 4\')\nprint("Done"',
    )
    install(installed, "prusa-slicer", "--output", "model.3mf", script=script)
    out = ball.with_name("ball.gcode")
    assert printed(ball, "-o", out, *COARSE) == 0
    shown, warned = capfd.readouterr()
    assert shown.splitlines()[-1] == f"{out}: made by PrusaSlicer, 26 h 4 min, 12.3 g, cost 0.50"
    assert warned == "PrusaSlicer: warning: Low bed adhesion\n"


def test_figures_are_read_of_each_slicer(tmp_path: Path) -> None:
    """As their sources write them: OrcaSlicer's project of two plates, Bambu Studio's head, CuraEngine's."""
    head = "; HEADER_BLOCK_START\n; BambuStudio 02.00\n"
    head += "; model printing time: 1h 2m; total estimated time: 1h 5m 6s\n"
    head += "; total filament length [mm] : 1000.5,499.5\n; total filament weight [g] : 3.0,1.5\n"
    with zipfile.ZipFile(tmp_path / "two.3mf", "w") as file:
        for plate in (1, 2):
            file.writestr(f"Metadata/plate_{plate}.gcode", head + "G1 X1\n" * 200_000)
    assert read_figures(tmp_path / "two.3mf") == Figures(2 * 3906, 9.0, None, pytest.approx(3.0))
    (tmp_path / "c.gcode").write_text(";FLAVOR:Marlin\n;TIME:6543.5\n;Filament used: 1.25m, 0.75m\nG28\n")
    assert read_figures(tmp_path / "c.gcode") == Figures(6543.5, None, None, 2.0)
    (tmp_path / "d.gcode").write_text("G28\n")
    assert read_figures(tmp_path / "d.gcode") == Figures()


BUNDLE = """# vendor
[printer:*common*]
printer_technology = FFF
nozzle_diameter = 0.4
start_gcode = G28 ; home\\nG1 Z5 = here
[printer:Own One]
inherits = *common*
default_print_profile = 0.2mm
default_filament_profile = "My PLA";"other"
[printer:Own Resin]
printer_technology = SLA
[print:*base*]
layer_height = 0.1
perimeters = 2
[print:0.2mm]
inherits = *base*; *missing none*
layer_height = 0.2
[print:*missing none*]
perimeters = 4
[filament:My PLA]
temperature = 215
compatible_printers_condition = nozzle_diameter[0]!=0.8
"""


@pytest.mark.skipif(sys.platform == "win32", reason="programs are scripts")
def test_printers_of_a_bundle_are_one_profile_with_what_they_inherit(
    ball: Path, installed: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("fracslice.export.slicer_profiles.Path.home", lambda: ball.parent)
    monkeypatch.setenv("XDG_CONFIG_HOME", str(ball.parent))
    script = PROGRAM.replace(
        "print(", "shutil.copy(sys.argv[sys.argv.index('--load') + 1], {model!r} + '.ini')\nprint(", 1
    )
    install(installed, "prusa-slicer", "--output", "model.3mf", script=script)
    profiles = installed / "resources" / "profiles"
    profiles.mkdir(parents=True)
    (profiles / "Own.ini").write_text(BUNDLE)
    out = ball.with_name("ball.gcode")
    assert printed(ball, "-o", out, "--printer", "Own One", "-q", *COARSE) == 0
    given = dict(line.split(" = ", 1) for line in (installed / "model.3mf.ini").read_text().splitlines())
    assert given["layer_height"] == "0.2" and given["perimeters"] == "4" and given["temperature"] == "215"
    assert given["start_gcode"] == "G28 ; home\\nG1 Z5 = here" and given["nozzle_diameter"] == "0.4"
    assert given["printer_settings_id"] == "Own One" and "inherits" not in given
    assert run(["print", "--printer", "list"]) == 0
    shown = capfd.readouterr().out.splitlines()
    assert "Own One" in shown and not {"Own Resin", "*common*"} & set(shown)
    out.unlink()
    assert printed(ball, "-o", out, "--printer", "Own Onf", *COARSE) == 2
    error = capfd.readouterr().err
    assert "printer 'Own Onf': no such printer of PrusaSlicer; did you mean Own One?" in error
    assert error.count("\n") == 1 and not out.exists()


@pytest.mark.skipif(sys.platform == "win32", reason="programs are scripts")
def test_printers_of_a_tree_are_three_profiles(
    ball: Path, installed: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of a model, that of its usual nozzle; inherited filaments of the library, too."""
    monkeypatch.setattr("fracslice.export.slicer_profiles.Path.home", lambda: ball.parent)
    tree = {
        "BBL/machine/Own X1": {"type": "machine_model"},
        "BBL/machine/Own X1 0.4 nozzle": {
            "type": "machine",
            "inherits": "fdm_own",
            "default_print_profile": "0.20mm",
            "default_filament_profile": ["Own PLA"],
        },
        "BBL/machine/fdm_own": {"type": "machine", "nozzle_diameter": ["0.4"]},
        "BBL/process/0.20mm": {"type": "process", "layer_height": "0.2"},
        "BBL/filament/Own PLA": {"type": "filament", "inherits": "fdm_pla"},
        "OrcaFilamentLibrary/filament/base/fdm_pla": {"type": "filament", "density": ["1.24"]},
    }
    for name, values in tree.items():
        file = installed / "resources" / "profiles" / f"{name}.json"
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(json.dumps(values))
    found = shipped("OrcaSlicer", ("OrcaSlicer",), str(installed / "orca-slicer"))
    assert {"Own X1", "Own X1 0.4 nozzle"} == {name for name in found.printers if name.startswith("Own")}
    machine, process, filament = (json.loads(file.read_text()) for file in found.write("Own X1", ball.parent))
    assert machine["nozzle_diameter"] == ["0.4"] and machine["type"] == "machine"
    assert process["layer_height"] == "0.2" and filament["density"] == ["1.24"]
