"""A new formula, format, check or light is one new file."""

from __future__ import annotations

import json
import math
import re
import subprocess
import sys
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path

import pytest

from fracslice.export import layers
from fracslice.mesh.models import read_mesh
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

MEASURED = """
from fracslice import reads
from fracslice.fields.registry import run_file

run_file("pearl.py")
ball = reads('<scene version="1"><solid size="10mm"><pearl radius="0.5"/></solid></scene>').root
print(ball.distance([[2.0, 0.0, 0.0]])[0])
"""

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

EXTENDED = """
import sys


class Extended:
    def find_spec(self, name, path, target=None):
        if name != sys.argv[1]:
            return None
        found = (finder.find_spec(name, path, target) for finder in sys.meta_path if finder is not self)
        place = next(filter(None, found))
        place.submodule_search_locations.append(sys.argv[2])
        return place


sys.meta_path.insert(0, Extended())
"""
"""Adds a folder to a package."""

RENDERED = """
import numpy as np
from fracslice import reads, render

text = '<scene version="1"><solid size="10mm"><sphere/></solid><camera eye="0 -4 0"/>' \
    '<light kind="noon"/><shading ambient="0"/></scene>'
picture = np.asarray(render(reads(text), size=(16, 16), samples=4), float).sum(-1)
print(picture[5, 8] > picture[10, 8] + 30)
"""


def test_a_formula(tmp_path: Path) -> None:
    (tmp_path / "pearl.py").write_text(FORMULA)
    assert float(extended("fracslice.formulas", tmp_path, MEASURED).stdout) == pytest.approx(1.5)


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


MESH_FORMAT = """
import numpy as np
from fracslice.common.arrays import Triangles
from fracslice.formats import MeshFormat


def _write(mesh, file, metadata, work):
    mesh = mesh.in_order()
    file.write(f"OFF\\n{len(mesh.vertices)} {len(mesh.triangles)} 0\\n".encode())
    np.savetxt(file, mesh.vertices, "%.9g")
    np.savetxt(file, np.insert(mesh.triangles, 0, 3, axis=1), "%d")


def _read(path):
    _, counts, *rows = path.read_text().splitlines()
    vertices = np.array([row.split() for row in rows[: int(counts.split()[0])]], float)
    return Triangles(vertices, np.array([row.split()[1:] for row in rows[len(vertices):]], np.int32))


FORMAT = MeshFormat(_read, _write)
"""

COMMANDS = """
from fracslice.cli.main import run

assert run(["mesh", "ball.xml", "-o", "ball.off", "--resolution", "24", "--quiet"]) == 0
run(["check", "ball.off"])
assert run(["mesh", "model.xml", "-o", "model.stl", "--resolution", "24", "--quiet"]) == 0
assert run(["mesh", "ball.xml", "-o", "ball.of"]) == 2
run(["mesh", "--help"])
"""


def test_a_format_of_meshes(tmp_path: Path) -> None:
    (tmp_path / "off.py").write_text(MESH_FORMAT)
    (tmp_path / "ball.xml").write_text('<scene version="1"><solid size="10mm"><sphere/></solid></scene>')
    (tmp_path / "model.xml").write_text('<scene version="1"><solid><model file="ball.off"/></solid></scene>')
    done = extended("fracslice.formats", tmp_path, COMMANDS)
    assert read_mesh(tmp_path / "model.stl").volume == pytest.approx(math.pi * 1000 / 6, rel=0.02)
    assert "ball.off: 5,372 triangles, 9.98 x 9.98 x 9.98 mm" in done.stdout
    assert ".stl, .off, .vdb" in done.stderr
    assert ".off" in done.stdout.partition("-o, --output")[2]


CHECK = """
from fracslice.checks import Check
from fracslice.checks.problems import Problem


def _rings(layer):
    return len(layer.contours)


def _many(layers):
    most = max(layers.measured["rings"])
    if most > 2:
        first = layers.measured["rings"].index(most)
        at = 0.0, 0.0, layers.bottom(first)
        yield Problem("rings", f"{most:g} outlines in a layer", first, at, (("hollow", "none"),))


def _long(solid):
    length = solid.scale * max(solid.size)
    if length > 10:
        yield Problem("long", f"{length:.0f} mm are long", advice="--size 8mm")


def _few(mesh):
    if mesh.mesh is not None and mesh.report.triangles < 1000:
        yield Problem("few", f"{len(mesh.mesh.triangles)} triangles are few")


CHECKS = (
    Check("rings", "layers", _many, measure=_rings, of_resin=True),
    Check("long", "solid", _long, weight=3),
    Check("few", "mesh", _few),
)
"""

CHECKED = """
import json
from fracslice.cli.main import run
from fracslice.mesh import Mesh
import trimesh

solid = trimesh.util.concatenate(
    [trimesh.creation.box((2, 2, 5), trimesh.transformations.translation_matrix((3 * k, 0, 0)))
     for k in range(4)]
)
solid.export("four.stl")
run(["check", "four.stl", "--layer", "0.5mm", "--pixel", "0.05mm", "--html", "four.html"])
run(["check", "four.stl", "--layer", "0.5mm", "--pixel", "0.05mm", "--material", "pla"])
run(["check", "four.stl", "--layer", "0.5mm", "--pixel", "0.05mm", "--json"])
"""


def test_a_check_of_a_mesh_a_solid_and_layers(tmp_path: Path) -> None:
    (tmp_path / "amounts.py").write_text(CHECK)
    words = extended("fracslice.checks", tmp_path, CHECKED).stdout
    resin, filament, numbers = re.split(r"^(?=four.stl: .*layers|{)", words, flags=re.MULTILINE)[-3:]
    found = [problem["kind"] for problem in json.loads(numbers)["layers"]["problems"]]
    assert found == ["few", "rings", "long"]
    for line in (
        "48 triangles are few",
        "4 outlines in a layer: layer 0",
        "11 mm are long; --size 8mm",
    ):
        assert line in resin and line in (tmp_path / "four.html").read_text()
    assert "outlines" not in filament and "11 mm are long; --size 8mm" in filament


def extended(package: str, folder: Path, code: str) -> subprocess.CompletedProcess[str]:
    """Run code where a package has the modules of a folder, too."""
    words = [sys.executable, "-c", EXTENDED + code, package, str(folder)]
    return subprocess.run(words, capture_output=True, text=True, check=True, cwd=folder)


def test_a_light(tmp_path: Path) -> None:
    (tmp_path / "noon.py").write_text(LIGHT)
    run = extended("fracslice.scene.lights", tmp_path, RENDERED)
    assert run.stdout.split() == ["True"]
