"""Types of the public records: what they take, for type checkers, is what they take at run time."""

from __future__ import annotations

import ast
import subprocess
import sys
from dataclasses import fields
from pathlib import Path
from typing import Any

from fracslice import MeshJob, Print, Scene
from fracslice.slicing import SliceJob

TAKEN = """
from fracslice import MeshJob, Print, Scene, make_mesh, slice_layers, sphere
from fracslice.scene import scene
from fracslice.scene.view import View
from fracslice.slicing import SliceJob

how = Print(cavities="fill", keep="largest", bridge=0, gap="0.1mm", thickness="1mm",
            hollow=2, drain="3mm", drain_at="0,0,1", base="1mm", raft=1.5, supports="light")
ball = Scene(sphere(), size_mm="40mm", name="ball", view=View(), printing=how, animation=None,
             tracks=(), unit_mm=None)
unit = Scene(sphere(), None, unit_mm="1cm")
job = MeshJob(size="4cm", voxel="0.5mm", resolution=None, dust=1, printing=how,
              chord="10um", simplify="0.1mm", up=[0, 0, 1], scale="102%",
              colour="point", proved=False, faces=None, palette=("#000", "#fff"), filaments=4,
              bodies=True, heights=(0.1, "0.3mm"), paint_supports=False)
layers = SliceJob(size="40mm", layer="0.1mm", pixel=("0.1mm", 0.1), up=(0, 0, 1), printing=how,
                  scale=(1, 1, 1.02), printer=None, compensation="50um", elephant_foot=0, gamma=1,
                  mirror=None, levels=8, blur=1, sections=2)
held: tuple[float | None, float, float] = ball.size_mm, how.gap, layers.pixels[0]
mesh = make_mesh(scene(sphere(), size="40mm"), voxel="2mm", thickness="3mm", scale="102%,102%,101%")
slices = slice_layers(sphere(), ("0.1mm", 0.2), size="1cm", pixel="0.1mm", bridge=1)
"""
REFUSED = """
from fracslice import MeshJob, Scene, sphere

Scene(sphere(), b"4")
MeshJob(size=[4])
"""
RECORDS: list[Any] = [Print, Scene, MeshJob, SliceJob]


def test_type_checkers_accept_lengths_as_text_and_refuse_what_is_refused(tmp_path: Path) -> None:
    (tmp_path / "taken.py").write_text(TAKEN)
    (tmp_path / "refused.py").write_text(REFUSED)
    command = [sys.executable, "-m", "mypy", str(tmp_path / "taken.py"), str(tmp_path / "refused.py")]
    said = subprocess.run(command, capture_output=True, text=True, cwd=Path(__file__).parents[1]).stdout
    assert "taken.py" not in said and said.count("refused.py") == said.count("error:") == 2, said


def test_every_field_is_in_the_snippet_and_it_runs() -> None:
    exec(TAKEN, {})
    calls = [call for call in ast.walk(ast.parse(TAKEN)) if isinstance(call, ast.Call)]
    for record in RECORDS:
        own = [c for c in calls if isinstance(c.func, ast.Name) and c.func.id == record.__name__]
        named = {word.arg for call in own for word in call.keywords}
        first = max(len(call.args) for call in own)
        assert {field.name for field in fields(record)[first:]} - {"place"} <= named, record
