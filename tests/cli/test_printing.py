"""The scene's <print> and the flags that override it, the same for mesh and check."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from fracslice_cli.main import run

TEXT = """<scene version="1">
  <solid size="20mm"><box/><transform translate="1.2 0 0"><box/></transform></solid>
  <print bridge="2mm"/>
</scene>"""


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


@pytest.mark.parametrize(("flags", "status"), [([], 0), (["--bridge", "0"], 1), (["--wall", "3mm"], 1)])
def test_check_says_whether_it_would_print(
    pair: str, flags: list[str], status: int, capfd: pytest.CaptureFixture[str]
) -> None:
    layers = ["--layer", "0.5mm", "--pixel", "0.2mm", "--json", "-q"]
    assert run(["check", pair, *layers, *flags]) == status
    report = json.loads(capfd.readouterr().out)
    assert bool(report["problems"]) == bool(status)
    assert len(report["solid"]["bodies"]) == (2 if "--bridge" in flags else 1)


def test_a_wrong_length_is_bad_input(pair: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    target = tmp_path / "x.stl"
    assert run(["mesh", pair, "-o", str(target), "--thickness", "-1"]) == 2
    assert "expected 0, or a length above zero" in capfd.readouterr().err
    assert run(["mesh", pair, "-o", str(target), "--thickness", "1um", "-q"]) == 2
    assert "expected at least 0.0625 mm" in capfd.readouterr().err
    assert not target.exists()
