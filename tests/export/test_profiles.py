"""Printers and resins from tables and files; which file a printer reads."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest

from fracslice.errors import ExportError, SliceError
from fracslice.export.layers import ENDINGS, printers_file, slice_format
from fracslice.slicing import printers
from fracslice.slicing.printers import PRINTERS, Resin, default_resin, printer, resin

OWN = """
title = "Mine"
pixels = [1440, 2560]
screen = [68.04, 120.96]
height = 150
file = "ctb"
version = 2
motion = [7, 80, 210, 1.5]
[resin]
exposure = 8
bottom_exposure = 60.5
lift = 6
"""


def test_the_table_of_printers() -> None:
    page = (Path(__file__).parents[2] / "docs/reference/printers.md").read_text(encoding="utf-8")
    assert len(PRINTERS) >= 60
    for machine in PRINTERS.values():
        assert 0.014 <= min(machine.pixel) <= max(machine.pixel) <= 0.12, machine.name
        assert machine.file and all(value >= 0 for value in machine.motion)
        assert f"| {machine.name} | {machine.title} | .{machine.file} |" in page
    written = {machine.file for machine in PRINTERS.values() if f".{machine.file}" in ENDINGS}
    assert {"sl1", "goo", "prz", "ctb", "nanodlp", "pwmx", "pwma"} <= written


def test_only_the_printer_of_a_job_is_made(monkeypatch: pytest.MonkeyPatch) -> None:
    """All of the table take a thirtieth of a small job."""
    made = list[str]()
    monkeypatch.setattr(printers, "validate", lambda record, _: made.append(record.name))
    assert printer("mars-5").name == "mars-5"
    assert made == ["mars-5"]


@pytest.mark.parametrize(
    ("name", "output", "expected"),
    [
        ("mars-5", "a.goo", ""),
        ("mars-5", "a.sl1", "Elegoo Mars 5 reads .goo files: make a.goo"),
        ("mars-5", "layers", "Elegoo Mars 5 reads .goo files: make layers.goo"),
        ("sl1s", "a.sl1s", ""),
        ("sonic-mini-8k-s", "a.goo", ""),
        ("photon-mono-4k", "a.pwmx", "Anycubic Photon Mono 4K reads .pwma files: make a.pwma"),
        (
            "mars-2",
            "a.ctb",
            "Elegoo Mars 2 reads encrypted .ctb files, which are not written: "
            "make a.goo and convert it with UVtools",
        ),
        (
            "mars-3",
            "a.goo",
            "Elegoo Mars 3 reads encrypted .ctb files, which are not written: convert a.goo with UVtools",
        ),
        (
            "mars-5-ultra",
            "a.ctb",
            "Elegoo Mars 5 Ultra reads encrypted .ctb files, which are not written: "
            "make a.goo and convert it with UVtools",
        ),
    ],
)
def test_which_file_a_printer_reads(name: str, output: str, expected: str) -> None:
    assert printers_file(printer(name), output) == expected


def test_encrypted_files_are_not_written_as_plain_ones(tmp_path: Path) -> None:
    with pytest.raises(ExportError, match=r"encrypted [.]ctb files are not written"):
        slice_format(tmp_path / "a.encrypted.ctb")


def test_the_table_is_that_of_its_source() -> None:
    """Figures of UVtools' profiles. Versions are at most the source's: boards read older ones."""
    lines = (Path(__file__).parent / "uvtools.csv").read_text().splitlines()[1:]
    source = {row["name"]: row for row in csv.DictReader(lines)}
    assert source.keys() == set(PRINTERS) - {"sl1", "sl1s", "mars-4"}
    other = {"mars-2": "encrypted.ctb", "sonic-mini-8k-s": "prz"}  # of version 4; a .goo by another name
    for name, row in source.items():
        machine = printer(name)
        own = (
            *machine.pixels,
            *machine.screen,
            machine.height,
            machine.mirror,
            machine.portrait,
            *machine.motion,
        )
        keys = "pixels_x pixels_y width depth height mirror portrait lift lift_speed retract_speed wait"
        assert own == tuple(float(row[key]) for key in keys.split()), name
        assert machine.file == other.get(name, row["file"])
        assert machine.version <= int(row["version"] or 517), name
        start = default_resin(machine, 0.05)
        assert start and start.motion + start.exposure < 30


def test_exposures_are_the_resins_and_the_layers() -> None:
    result = [default_resin(printer(name), layer) for name in ("sl1", "sl1s") for layer in (0.025, 0.05, 0.1)]
    assert [(r.exposure, r.bottom_exposure) for r in result if r] == [
        *((6, 35), (7.5, 35), (13, 45)),
        *((1.8, 25), (2, 25), (2.6, 25)),
    ]
    assert all(default_resin(machine, 0.05) for machine in PRINTERS.values())
    start = default_resin(printer("mars-5"), 0.05)
    assert start and (start.exposure, start.bottom_exposure, start.bottom_layers) == (3, 30, 4)
    assert resin("Siraya Tech Fast Grey", printer("sl1"), 0.06).exposure == 10
    with pytest.raises(ExportError, match=r"did you mean .Siraya Tech Fast Grey."):
        resin("Siraya Fast Gray", printer("sl1"), 0.05)
    with pytest.raises(ExportError, match=r"unknown for Elegoo Mars 5; expected a [.]toml or [.]ini file"):
        resin("Siraya Tech Fast Grey", printer("mars-5"), 0.05)


def test_a_printer_of_ones_own(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(OWN)
    machine = printer(str(path))
    assert (machine.name, machine.title, machine.pixels) == ("mine", "Mine", (1440, 2560))
    assert machine.pixel == pytest.approx((0.04725, 0.04725))
    result = default_resin(machine, 0.05)
    assert result is not None
    assert (result.exposure, result.bottom_exposure) == (8, 60.5)
    assert (result.lift, result.lift_speed, result.retract_speed, result.wait) == (6, 80, 210, 1.5)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("height", "hight", "'hight': unknown; expected name, title, pixels"),
        ("height = 150", "", "height is missing"),
        ("height", "settings = []\nheight", "'settings': unknown"),
        ("1440", "-1440", "pixels=.*: expected 2 whole numbers"),
        ("150", '"tall"', "height=.*: expected a number"),
        ("[1440", "1440", r"line \d+"),
        ('file = "ctb"', "mirror = 1", "true or false for mirror"),
        ('"Mine"', "5", "title=5: expected text in one line"),
        ('"ctb"', "5", "file=5: expected text in one line"),
        ("1440", "65536", "pixels=.*: expected 2 whole numbers .* 65535"),
    ],
)
def test_a_wrong_printer_is_one_line(old: str, new: str, message: str, tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(OWN.replace(old, new, 1))
    with pytest.raises(SliceError, match=message) as failure:
        printer(str(path))
    assert str(failure.value).startswith(str(path)) and "\n" not in str(failure.value)


def test_a_resin_of_ones_own(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text("exposure = 2.5\nbottom_exposure = 30\nbottom_layers = 4\n")
    assert resin(str(path), None, 0.05) == Resin(2.5, 30, "mine", bottom_layers=4)
    for text, message in (
        ("exposure = 2.5", "bottom_exposure is missing"),
        ("exposure = 2.5\nbottom_exposure = -1", "bottom_exposure=-1: expected a number > 0"),
        ("name = 5\nexposure = 2.5\nbottom_exposure = 9", "name=5: expected text"),
        ("exposures = 2.5", "'exposures': unknown; expected exposure"),
    ):
        path.write_text(text)
        with pytest.raises(ExportError, match=message) as failure:
            resin(str(path), None, 0.05)
        assert str(failure.value).startswith(str(path))
    with pytest.raises(ExportError, match="No such file"):
        resin(str(tmp_path / "none.toml"), None, 0.05)


@pytest.mark.parametrize("name", ["mine.toml", "mine.ini"])
def test_a_file_that_may_not_be_read(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(*_: object) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr("fracslice.common.files.open_regular", refused)
    with pytest.raises(ExportError, match=rf"^{name}: Permission denied$"):
        resin(name, None, 0.05)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("exposure = " + "9" * 10**5, "expected at most 16 kB of settings"),
        ("exposure = " + "9" * 10**4, "not a TOML file: "),
        ("exposure = " + "[" * 10**4, "expected at most 8 tables and arrays within each other"),
        (f"exposure = {'[' * 20}1{']' * 20}", "expected at most 8 tables and arrays within each other"),
        (".".join("a" * 2000) + " = 1", "expected at most 8 tables and arrays within each other"),
    ],
)
def test_hostile_settings_are_one_line(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(text)
    for read, error in (
        (lambda: resin(str(path), None, 0.05), ExportError),
        (lambda: printer(str(path)), SliceError),
    ):
        with pytest.raises(error, match=f"^{path}: {message}"):
            read()


def test_a_resin_profile_of_prusaslicer(tmp_path: Path) -> None:
    path = tmp_path / "Fast Grey.ini"
    path.write_text(
        "# generated by PrusaSlicer 2.5.0 on 2022-10-20 at 13:33:45 UTC\n"
        "bottle_cost = 0\nexposure_time = 2.4\nfaded_layers = 8\ninitial_exposure_time = 28\n"
        "material_density = 1.15\nmaterial_notes = LIFT_DISTANCE=8.0\\nLIFT_SPEED=2.5\\nRETRACT_SPEED=3\n"
    )
    result = resin(str(path), printer("mars-5"), 0.05)
    assert result == Resin(
        2.4, 28, "Fast Grey", transition_layers=8, density=1.15, lift=8, lift_speed=150, retract_speed=180
    )
    path.write_text("exposure_time = fast\n")
    with pytest.raises(ExportError, match="exposure_time = fast: expected a number"):
        resin(str(path), None, 0.05)
    path.write_text("exposure_time = 2\ninitial_exposure_time = 9\nfaded_layers = inf\n")
    with pytest.raises(ExportError, match="transition_layers=inf: expected a whole number"):
        resin(str(path), None, 0.05)
