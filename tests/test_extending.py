"""A new formula, format or light is one new file."""

from __future__ import annotations

import subprocess
import sys
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

import pytest

from fracslice.export import layers
from fracslice.fields.registry import run_file
from fracslice.scene import reads
from tests.export.test_slices import run

FORMULA = '''
from fracslice.formulas import Box, Number, shape, sqrt


@shape(radius=Number(1.0, "the radius", above=0))
def pearl(x, y, z, radius):
    """A ball."""
    return sqrt(x * x + y * y + z * z) - radius


@pearl.bounds
def pearl_bounds(node):
    return Box.centred(node["radius"])
'''

FORMAT = """
from fracslice.export.layer_formats import FileFormat


def _encode(run, layer):
    return f"{layer.top:.2f} {layer.area:.1f}\\n".encode()


def _assemble(run, layers, file):
    file.writelines(layers)


FORMATS = (FileFormat("areas", _encode, _assemble, endings=(".areas",)),)
"""


LIGHT = """
from fracslice.scene.lights import Kind


def down(x, y, z, u, v, far):
    zero = 0.0 * x
    return zero, zero, zero + 1.0, zero + far, zero + 1.0


KIND = Kind("overhead", lambda light, eye, far: (down, {"far": far}), is_soft=lambda light: False)
"""

RENDERED = """
import sys
import numpy as np


class Extended:
    def find_spec(self, name, path, target=None):
        if name != "fracslice.scene.lights":
            return None
        found = (finder.find_spec(name, path, target) for finder in sys.meta_path if finder is not self)
        place = next(filter(None, found))
        place.submodule_search_locations.append(sys.argv[1])
        return place


sys.meta_path.insert(0, Extended())
from fracslice import reads, render

text = '<scene version="1"><solid size="10mm"><sphere/></solid><camera eye="0 -4 0"/>' \
    '<light kind="noon"/><shading ambient="0"/></scene>'
picture = np.asarray(render(reads(text), size=(16, 16), samples=4), float).sum(-1)
print(picture[5, 8] > picture[10, 8] + 30)
"""


def test_a_formula(tmp_path: Path) -> None:
    (tmp_path / "pearl.py").write_text(FORMULA)
    run_file(str(tmp_path / "pearl.py"))
    ball = reads('<scene version="1"><solid size="10mm"><pearl radius="0.5"/></solid></scene>').root
    assert ball.distance([[2.0, 0.0, 0.0]]) == pytest.approx(1.5)


def test_a_format_of_layers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "areas.py").write_text(FORMAT)
    place = spec_from_file_location(
        layers.__name__, layers.__file__, submodule_search_locations=[*layers.__path__, str(tmp_path)]
    )
    assert place and place.loader
    extended = module_from_spec(place)
    monkeypatch.setitem(sys.modules, layers.__name__, extended)
    place.loader.exec_module(extended)
    stack = run()
    extended.write_slices(stack, tmp_path / "ball.areas")
    rows = [line.split() for line in (tmp_path / "ball.areas").read_text().splitlines()]
    assert len(rows) == stack.layers
    assert [float(area) for _, area in rows] == pytest.approx(
        [stack.slicer.areas[k] for k in range(stack.layers)], abs=0.05
    )


def test_a_light(tmp_path: Path) -> None:
    (tmp_path / "noon.py").write_text(LIGHT)
    run = subprocess.run(
        [sys.executable, "-c", RENDERED, tmp_path], capture_output=True, text=True, check=True
    )
    assert run.stdout.split() == ["True"]
