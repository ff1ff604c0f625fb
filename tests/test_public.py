"""What a newcomer runs first: the tour in the docstrings and the scripts in examples/."""

from __future__ import annotations

import doctest
import importlib
import subprocess
import sys
from pathlib import Path

import pytest

import fracslice

EXAMPLES = Path(__file__).parents[1] / "examples"


@pytest.mark.parametrize(
    "name",
    [
        "fracslice",
        "fracslice.api.calls",
        "fracslice.fields.node",
        "fracslice.mesh.model",
        "fracslice.common.messages",
        "fracslice.common.parameters",
        "fracslice.scene.model",
    ],
)
def test_docstrings_say_what_happens(name):
    tested = doctest.testmod(importlib.import_module(name))
    assert tested.attempted > 0
    assert tested.failed == 0


def test_every_public_name_is_there():
    assert [name for name in fracslice.__all__ if not hasattr(fracslice, name)] == []
    assert {name for name in dir(fracslice) if not name.startswith("__")} == set(fracslice.__all__) - {
        "__version__"
    }
    with pytest.raises(AttributeError, match="no attribute 'mash'"):
        _ = fracslice.mash


def test_importing_costs_nothing():
    code = "import fracslice, sys; print('numpy' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"


def test_the_example_that_builds_and_meshes(tmp_path):
    arguments = [EXAMPLES / "build_and_mesh.py", tmp_path / "bauble.3mf", "48"]
    done = subprocess.run([sys.executable, *map(str, arguments)], capture_output=True, text=True, check=True)
    assert '"printable": true' in done.stdout
    assert (tmp_path / "bauble.3mf").exists()


@pytest.mark.nightly
def test_the_example_of_a_grid(tmp_path):
    arguments = [EXAMPLES / "from_numpy.py", tmp_path / "implant.3mf", "64"]
    done = subprocess.run([sys.executable, *map(str, arguments)], capture_output=True, text=True, check=True)
    assert "<Result of" in done.stdout and "of the solid ()" in done.stdout
    assert (tmp_path / "implant.3mf").exists()


@pytest.mark.nightly
def test_the_example_of_a_family(tmp_path):
    arguments = [EXAMPLES / "a_family.py", tmp_path, "24", "3"]
    subprocess.run([sys.executable, *map(str, arguments)], capture_output=True, check=True)
    assert sorted(path.name for path in tmp_path.iterdir()) == [f"mandelbulb-{n}.stl" for n in (2, 3)]


def test_the_example_that_flies_around(tmp_path):
    arguments = [EXAMPLES / "fly_around.py", tmp_path, "2", "40x24"]
    subprocess.run([sys.executable, *map(str, arguments)], capture_output=True, check=True)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["step000.png", "step001.png"]
