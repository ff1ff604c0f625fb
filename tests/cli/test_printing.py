"""The scene's <print> and the flags that override it, the same for mesh and check."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from fracslice.cli.main import run
from PIL import Image

pytestmark = pytest.mark.once

TEXT = """<scene version="1">
  <solid size="20mm"><box/><transform translate="1.2 0 0"><box/></transform></solid>
  <print bridge="2mm"/>
</scene>"""

LAYERS = "--layer", "0.5mm", "--pixel", "0.2mm", "--wall", "0.4mm", "--floor", "0.4mm"
"""The solid is sampled as finely as its limits ask."""


@pytest.fixture
def pair(tmp_path: Path) -> str:
    (tmp_path / "pair.xml").write_text(TEXT)
    return str(tmp_path / "pair.xml")


def test_the_scene_is_obeyed_and_flags_override_it(pair: str, tmp_path: Path) -> None:
    def bodies(*flags: str) -> int:
        report = tmp_path / "report.json"
        made = [
            "mesh",
            pair,
            "-o",
            str(tmp_path / "x.stl"),
            "--resolution",
            "48",
            "-q",
            "--report",
            str(report),
        ]
        assert run([*made, *flags]) == 0
        return int(json.loads(report.read_text())["components"])

    assert bodies() == 1
    assert bodies("--bridge", "0") == 2
    assert bodies("--bridge", "0", "--keep", "largest") == 1


@pytest.mark.parametrize(("flags", "status"), [([], 0), (["--bridge", "0"], 0), (["--wall", "3mm"], 1)])
def test_check_says_whether_it_would_print(
    pair: str, flags: list[str], status: int, capfd: pytest.CaptureFixture[str]
) -> None:
    layers = [*LAYERS, "--json", "-q"]
    assert run(["check", pair, *layers, *flags]) == status
    report = json.loads(capfd.readouterr().out)
    assert bool(report["problems"]) == bool(status)
    assert len(report["bodies"]) == (2 if "--bridge" in flags else 1)


def test_a_wrong_length_is_bad_input(pair: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    target = tmp_path / "x.stl"
    assert run(["mesh", pair, "-o", str(target), "--thickness", "-1"]) == 2
    assert "expected 0, or a length above zero" in capfd.readouterr().err
    assert run(["mesh", pair, "-o", str(target), "--thickness", "1um", "-q"]) == 2
    assert "expected at least 0.0625 mm" in capfd.readouterr().err
    assert not target.exists()


def test_check_ends_with_a_verdict(pair: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    def lines(*arguments: str) -> list[str]:
        run(["check", *arguments, "-q"])
        return capfd.readouterr().out.splitlines()

    assert lines(pair, *LAYERS)[-1].endswith(", would print")
    reported = lines(pair, *LAYERS, "--wall", "3mm")
    assert reported[0].endswith(", would not print:")
    assert " of walls are thinner than 3 mm: at " in reported[-1]
    reported = lines(pair, *LAYERS, "--bridge", "0", "--set", "transform.rotate=0 1 0 45")
    assert reported[0].endswith(", would print with supports:")
    assert any(line.startswith("  1 island in the air, the first from layer ") for line in reported)


def test_a_filament_has_a_weight_of_its_own_and_no_problems_of_resin(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    hollow = tmp_path / "hollow.xml"
    hollow.write_text(
        """<scene version="1"><solid size="20mm"><difference><box/><sphere radius="0.3"/></difference></solid>
        </scene>"""
    )

    def lines(*arguments: str) -> list[str]:
        run(["check", str(hollow), "--layer", "0.5mm", "--pixel", "0.5mm", "-q", *arguments])
        return capfd.readouterr().out.splitlines()

    resin, (filament,) = lines(), lines("--material", "pla")
    assert "would not print" in resin[0] and " sealed cavity with " in resin[1]
    assert filament.endswith(", would print")
    ml, grams = (float(part.split()[0]) for part in filament.split(", ")[2:4])
    assert grams == pytest.approx(1.24 * ml, rel=0.01)


@pytest.mark.parametrize("flags", [["--bridge", "2mm"], ["--bridge", "0", "--keep", "largest"]])
def test_the_worst_layers_are_named(pair: str, flags: list[str], tmp_path: Path) -> None:
    """Of a solid that nothing is wrong with it is the lowest."""
    sheet = tmp_path / "worst.png"
    run(["check", pair, *LAYERS, "--picture", str(sheet), "-q", *flags])
    with Image.open(sheet) as image:
        assert min(image.size) > 20
        assert (np.asarray(image.convert("L"))[-20:] < 64).any(), "a line says which layer it is"


def test_what_does_not_fit_is_said_before_any_layer(
    pair: str, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    from fracslice.slicing import Slicer

    monkeypatch.setattr(Slicer, "map", None)
    layers = ["--layer", "1mm", "--printer", "sl1s", "--size", "300mm", "--bridge", "0", "-q"]
    assert run(["check", pair, *layers]) == 1
    reported = capfd.readouterr().out.splitlines()
    assert len(reported) == 1
    assert "would not print: does not fit the Original Prusa SL1S Speed: 300 x " in reported[0]
    assert run(["check", pair, *layers, "--json"]) == 1
    reported = json.loads(capfd.readouterr().out)
    assert reported["fits"] is False and len(reported["problems"]) == 1


def test_check_says_what_a_voxel_or_a_pixel_may_lose(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """A plate of 0.15 mm on a block of 10 mm: no limit forbids it, and it is thinner than what shows it."""
    (tmp_path / "plate.xml").write_text(
        """<scene version="1"><solid size="20mm"><union><box size="1 1 1"/>
        <transform translate="1 0 0"><box size="1.0 0.8 0.015"/></transform></union></solid></scene>"""
    )

    def reported(*how: str) -> list[str]:
        run(["check", str(tmp_path / "plate.xml"), "-q", *how])
        lines = capfd.readouterr().out.splitlines()
        return [line for line in lines if "may be lost" in line]

    (line,) = reported("--layer", "1mm", "--pixel", "0.3mm")
    assert "thinner than 0.3 mm" in line and "the thinnest, 0.15 mm" in line
    x, _, z = map(float, line.split(" at ")[1].split()[:3])
    assert 0 < x < 10 and abs(z - 5) < 0.5, "mm from the middle, above the lowest point"
    assert reported("--resolution", "48") == [], "a mesh job samples what it would lose finer"
    assert reported("--layer", "1mm", "--pixel", "0.1mm") == []


BORED = """<scene version="1"><solid unit="1mm"><difference><box size="4 4 4"/>
<transform translate="1 0 0"><cylinder radius="0.2" height="6"/></transform></difference></solid></scene>"""


def write_bored(path: Path, sides: int = 64) -> None:
    """Write a cube of 4 mm with an upright bore of 0.4 mm at x = 1 mm, as binary STL."""
    turn = 2 * np.pi * np.arange(sides) / sides
    way = np.stack([np.cos(turn), np.sin(turn)], 1)
    rim, side = 0.2 * way + (1, 0), 2 * way / np.abs(way).max(1)[:, None]
    rings = [
        np.column_stack([of, np.full(sides, z)]) for of, z in ((rim, 2), (rim, -2), (side, -2), (side, 2))
    ]
    triangles = []
    for one, other in zip(rings, [*rings[1:], rings[0]], strict=True):
        a, b, c, d = one, np.roll(one, -1, 0), np.roll(other, -1, 0), other
        triangles += [np.stack([a, b, c], 1), np.stack([a, c, d], 1)]
    facets = np.zeros(8 * sides, [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("colour", "<u2")])
    facets["corners"] = np.concatenate(triangles)
    path.write_bytes(bytes(80) + np.uint32(8 * sides).tobytes() + facets.tobytes())


@pytest.mark.nightly
def test_a_bore_that_may_close_is_a_note(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """It is named for a scene and a model of it, and leaves the verdict as it is."""
    scene, model = tmp_path / "bore.xml", tmp_path / "bore.stl"
    scene.write_text(BORED)
    write_bored(model)
    coarse = "--layer", "0.1mm", "--pixel", "0.1mm", "--wall", "0.2mm", "--floor", "0.2mm"
    for source in (scene, model):
        assert run(["check", str(source), *coarse, "-q"]) == 0
        verdict, note = capfd.readouterr().out.splitlines()[-2:]
        assert verdict.endswith(", would print")
        assert note.startswith("1 hole of 0.4 mm, narrower than 0.5 mm, may close: at 1.00 ")
