"""One output for each value of a range, and for each moment of an animation."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest
from fracslice.cli.main import run
from fracslice.cli.sweeps import members

pytestmark = pytest.mark.once

BALL = """<scene version="1"><solid size="20mm"><sphere radius="0.5"/></solid>
<animation duration="1s"/><track of="sphere.radius" keys="0s: 0.5; 1s: 1" curve="linear"/></scene>"""


@pytest.fixture
def scene(tmp_path: Path) -> str:
    (tmp_path / "ball.xml").write_text(BALL)
    return str(tmp_path / "ball.xml")


def test_values_of_ranges() -> None:
    result = members(["a.p=2..3:0.5", "a.q=7", "b[2].r=1..-1:-1"])
    assert [suffix for _, suffix in result][:4] == ["-p2-r1", "-p2-r0", "-p2-r-1", "-p2.5-r1"]
    assert result[-1][0] == ("a.p=3", "a.q=7", "b[2].r=-1")
    assert [settings for settings, _ in members(["a.p=1..3"])] == [("a.p=1",), ("a.p=2",), ("a.p=3",)]
    assert len(members(["a.p=0..1:0.1"])) == 11
    vectors = members(["t.rotate=1 0 0 -10..10:20"])
    assert vectors == [(("t.rotate=1 0 0 -10",), "-rotate-10"), (("t.rotate=1 0 0 10",), "-rotate10")]
    assert members(["a.p=2 .. 3"])[1] == (("a.p=3",), "-p3")


def test_a_table_has_a_row_for_each_mesh(scene: str, tmp_path: Path) -> None:
    def rows() -> list[dict[str, str]]:
        return list(csv.DictReader(table.open()))

    table, stl = tmp_path / "a.csv", str(tmp_path / "a.stl")
    given = ["mesh", scene, "-q", "--resolution", "24", "-o", stl, "--report", str(table)]
    assert run([*given, "--set", "sphere.radius=1..3"]) == 0
    assert [row["sphere.radius"] for row in rows()] == ["1", "2", "3"]
    assert run([*given, "--set", "sphere.radius=3..4", "--set", "solid.size=1cm"]) == 0
    assert [Path(row["file"]).stem for row in rows()] == [f"a-radius{k}" for k in (1, 2, 3, 4)]
    volumes = [float(row["volume_mm3"]) for row in rows()]
    assert volumes == pytest.approx([4189, 4189, 524, 524], rel=0.05)
    assert {row["cavities_mm3"] for row in rows()} == {"0.0"}


def test_a_table_of_something_else_is_not_replaced(
    scene: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "a.csv").write_text("x,y\n1,2\n")
    given = ["mesh", scene, "-o", str(tmp_path / "a.stl"), "--report", str(tmp_path / "a.csv")]
    assert run(given) == 2
    assert "expected a table of meshes" in capsys.readouterr().err
    assert not (tmp_path / "a.stl").exists() and (tmp_path / "a.csv").read_text() == "x,y\n1,2\n"


@pytest.mark.parametrize("command", ["mesh", "slice", "render"])
def test_a_file_for_each_value(command: str, scene: str, tmp_path: Path) -> None:
    """Each is that of its value alone."""
    ending, options = {
        "mesh": ("stl", ["--resolution", "12"]),
        "slice": ("cli", ["--layer", "1mm", "--pixel", "1mm"]),
        "render": ("png", ["--size", "12x8", "--samples", "1"]),
    }[command]
    given = [command, scene, "-q", *options]
    assert run([*given, "-o", str(tmp_path / f"a.{ending}"), "--set", "sphere.radius=0.5..1.5:0.5"]) == 0
    made = {path.name for path in tmp_path.glob(f"*.{ending}")}
    assert made == {f"a-radius{value}.{ending}" for value in ("0.5", "1", "1.5")}
    alone = tmp_path / f"alone.{ending}"
    assert run([*given, "-o", str(alone), "--set", "sphere.radius=1"]) == 0
    if command == "render":  # the text of a PNG names the scene
        assert (tmp_path / "a-radius1.png").stat().st_size > 100
    else:
        assert (tmp_path / f"a-radius1.{ending}").read_bytes() == alone.read_bytes()


def test_pages_and_previews_for_each_value(scene: str, tmp_path: Path) -> None:
    given = ["slice", scene, "-q", "--layer", "1mm", "--pixel", "1mm", "--set", "sphere.radius=1..2"]
    endings = {"-o": "cli", "--html": "html", "--preview": "png"}
    files = [text for option, ending in endings.items() for text in (option, str(tmp_path / f"a.{ending}"))]
    assert run([*given, *files]) == 0
    made = sorted(path.name for path in tmp_path.glob("a*"))
    assert made == [f"a-radius{k}.{ending}" for k in (1, 2) for ending in sorted(endings.values())]


def test_a_family_of_shards(scene: str, tmp_path: Path) -> None:
    given = ["slice", scene, "-o", str(tmp_path / "a.cli"), "--layer", "1mm", "--pixel", "1mm", "-q"]
    family = [*given, "--set", "sphere.radius=1..2"]
    for shard in ("2/2", "1/2"):
        assert run([*family, "--shard", shard, "--store", str(tmp_path / "pieces")]) == 0
    shared = [(tmp_path / f"a-radius{k}.cli").read_bytes() for k in (1, 2)]
    assert run(family) == 0
    assert shared == [(tmp_path / f"a-radius{k}.cli").read_bytes() for k in (1, 2)]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--set", "sphere.radius=1..2:-1"], "expected a range such as sphere.radius=2..9:0.5"),
        (["--set", "sphere.radius=1..2:0"], "expected a range"),
        (["--set", "sphere.radius=0..1e9"], "expected at most 10000 values"),
        (["--set", "sphere.radius=1..90000"], "expected at most 10000"),
        (["--set", "sphere.radius=-1..1"], "expected a number > 0"),
        (["--set", "sphere.radius=1..2", "--set", "sphere.radius=1..2"], "different names"),
        (["--every", "0.5s", "--time", "0.5s"], "--time and --every: expected one of them"),
        (["--every", "0s"], "expected a time in seconds above zero"),
        (["--every", "0.00001s"], "expected at most 10000"),
    ],
)
def test_what_is_refused(
    options: list[str], message: str, scene: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["mesh", scene, "-o", str(tmp_path / "a.stl"), *options]) == 2
    assert message in capsys.readouterr().err
    assert not list(tmp_path.glob("*.stl"))


def test_a_mesh_of_every_moment(scene: str, tmp_path: Path) -> None:
    """Stop motion: the scale belongs to each moment."""
    given = ["mesh", scene, "--resolution", "12", "-q"]
    report = str(tmp_path / "a.json")
    assert run([*given, "-o", str(tmp_path / "a.stl"), "--every", "0.5s", "--report", report]) == 0
    assert sorted(path.name for path in tmp_path.glob("a*")) == [
        f"a-{time}s.{ending}" for time in ("0.5", "0", "1") for ending in ("json", "stl")
    ]
    assert run([*given, "-o", str(tmp_path / "b.stl"), "--time", "0.5s"]) == 0
    assert (tmp_path / "a-0.5s.stl").read_bytes() == (tmp_path / "b.stl").read_bytes()
