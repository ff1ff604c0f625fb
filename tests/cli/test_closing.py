"""The closing lines of meshes and layers, as exact text."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from fracslice.cli.execution import Closing
from fracslice.cli.main import run

from fracslice.common.messages import duration

pytestmark = pytest.mark.once

SHELL = """<scene version="1"><solid unit="1mm"><difference>
<box size="20 20 20"/><sphere radius="6"/></difference></solid></scene>"""


def printed(capfd: pytest.CaptureFixture[str], *arguments: object) -> list[str]:
    run([str(argument) for argument in arguments])
    return capfd.readouterr().out.splitlines()


def test_everything_that_a_maker_asks() -> None:
    whole = Closing(
        volume=38_200,
        contact=2.5,
        height=60,
        material="Siraya Tech Fast Grey",
        density=1.1,
        layers=1200,
        seconds=12_300,
        cost=1.91,
        drains=[(-30.0, 0.0, 4.0), (0.0, 0.04, 57.96)],
        drain=3,
        cavities=2,
        trapped=1200,
        loose=3,
    )
    assert list(whole.lines()) == [
        "38.2 ml, 42 g of Siraya Tech Fast Grey (1.1 g/ml), 1,200 layers, 3 h 25 min, cost 1.91",
        "drain holes of 3 mm leave the hollow at -30.0 0.0 4.0 and 0.0 0.0 58.0 mm",
        "1.2 ml trapped in 2 sealed cavities: --cavities fill, or --drain 3mm for a hollow",
        "3 loose bodies: --bridge 1mm, or --keep largest",
        "does not stand flat, 2.5 mm2 on the plate: --base 1.2mm",
    ]
    many = list(replace(whole, drains=[(-30.0, 0.0, 4.0)] * 5).lines())[1]
    assert many == "drain holes of 3 mm leave the hollow at -30.0 0.0 4.0 mm and at 4 other places"
    assert list(replace(whole, trapped=0.0644, drains=(), loose=0, contact=50).lines())[1:] == []
    tiny = replace(whole, volume=8, trapped=0.0644, drains=(), loose=0, contact=50)
    assert [line.split(":")[0].split(",")[0] for line in tiny.lines()] == [
        "8 mm3",
        "0.064 mm3 trapped in 2 sealed cavities",
    ]
    assert [duration(s) for s in (0.1, 60, 3599, 7260)] == ["1 s", "1 min", "1 h 0 min", "2 h 1 min"]


def test_parts_on_the_plate_are_not_loose(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    for height, loose in ((0, 0), (3, 1)):
        other = f'<transform translate="4 0 {height}"><box size="2 2 2"/></transform>'
        (tmp_path / "two.xml").write_text(
            f'<scene version="1"><solid unit="1mm"><union><box size="2 2 2"/>{other}</union></solid></scene>'
        )
        out = printed(capfd, "mesh", tmp_path / "two.xml", "-o", tmp_path / "m.stl", "--resolution", 24)
        assert [line for line in out if "loose" in line or "largest" in line] == [
            "1 loose body: --bridge 1mm, or --keep largest"
        ] * loose


def test_the_base_that_is_advised_leaves_most_of_a_tiny_object(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], ball: Path
) -> None:
    tiny = "mesh", ball, "-o", tmp_path / "m.stl", "--resolution", 32, "--size", "0.4mm"
    advice = printed(capfd, *tiny)[-1]
    assert advice.endswith("on the plate: --base 0.1mm")
    lines = printed(capfd, *tiny, *advice.split(": ")[1].split())
    assert "0.30 mm, " in lines[0] and "stand flat" not in lines[-1]


def test_a_mesh_ends_with_them(tmp_path: Path, capfd: pytest.CaptureFixture[str], ball: Path) -> None:
    shell, model = tmp_path / "shell.xml", tmp_path / "m.stl"
    shell.write_text(SHELL)
    options = "--voxel", "0.5mm", "--material", "pla", "--price", 20
    assert printed(capfd, "mesh", shell, "-o", model, *options)[-2:] == [
        "7.1 ml, 8.8 g of pla (1.24 g/ml), cost 0.18",
        "0.902 ml trapped in a sealed cavity: --cavities fill, or --drain 3mm for a hollow",
    ]
    assert printed(capfd, "mesh", ball, "-o", model, "--resolution", 32)[-2:] == [
        "4.18 ml, 4.6 g of resin (1.1 g/ml)",
        "does not stand flat, 0.39 mm2 on the plate: --base 0.5mm",
    ]


def test_layers_end_with_them(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    shell, out = tmp_path / "shell.xml", tmp_path / "m.sl1"
    shell.write_text(SHELL)
    options = "--layer", "1mm", "--printer", "sl1s", "--exposure", 2, 25, "--price", 50
    lines = printed(capfd, "slice", shell, "-o", out, *options)
    assert lines[-2:] == [
        "7.09 ml, 7.8 g of Prusa Orange Tough (1.1 g/ml), 20 layers, 5 min, cost 0.35",
        "0.904 ml trapped in a sealed cavity: --cavities fill, or --drain 3mm for a hollow",
    ]
    hollow = "--cavities", "fill", "--hollow", "2mm", "--drain", "4mm"
    coarse = "--layer", "1mm", "--pixel", "0.5mm"
    assert printed(capfd, "slice", shell, "-o", tmp_path / "layers", *coarse, *hollow)[-2:] == [
        "3.86 ml, 4.24 g of resin (1.1 g/ml), 20 layers",
        "drain holes of 4 mm leave the hollow at 0.0 0.0 4.0 and 0.0 0.0 16.0 mm",
    ]
