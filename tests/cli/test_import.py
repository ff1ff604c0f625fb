"""fracslice import: scenes of Mandelbulber."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from fracslice.cli.main import run

from fracslice.scene import read

KNOWN = "# version 2.33\n[main_parameters]\nformula_1 5;\nN 4;\nhdr true;\n"
HYBRID = (
    "# version 2.33\n[main_parameters]\nhybrid_fractal_enable true;\nN 3;\nformula_1 5;\nformula_2 1619;\n"
)


def test_a_scene_is_written_with_a_summary(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    source, target = tmp_path / "my.fract", tmp_path / "my.xml"
    source.write_text(KNOWN)
    assert run(["import", str(source), "-o", str(target)]) == 0
    out = capfd.readouterr().out
    assert out.splitlines()[0] == f"{target}: Quaternion"
    assert f"not understood: {source}:5: hdr" in out
    assert read(target).root.children[0].formula.name == "quaternion_mandelbrot"


def test_a_formula_that_is_not_known_is_left_out_if_asked(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    source, target = tmp_path / "my.fract", tmp_path / "my.xml"
    source.write_text(HYBRID)
    words = ["import", str(source), "-o", str(target), "--json"]
    assert run(words) == 2
    assert "my.fract:6: formula_2 1619 (transfDIFSGearV1): not known here" in capfd.readouterr().err
    assert not target.exists()
    assert run([*words, "--leave-out"]) == 1
    figures = json.loads(capfd.readouterr().out)
    assert figures["formulas"] == ["Quaternion"]
    assert figures["missing"] == [f"{source}:6: formula_2 1619 (transfDIFSGearV1)"]
    assert target.exists()
