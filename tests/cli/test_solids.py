"""Commands of scenes that take a model: what they make of it, and models beside their scene."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from fracslice.cli.main import run

from fracslice.jobs.shared import MeshRecipe
from fracslice.mesh.models import read_mesh
from fracslice.records import MeshJob
from fracslice.scene import read, to_xml
from tests.examples import BRACKET
from tests.mesh import shapes

pytestmark = pytest.mark.once


def status(command: str) -> int:
    return run(command.split())


@pytest.fixture(name="cube")
def cube_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return shapes.cube(10, (1, 2, 3)).export(tmp_path / "cube.stl")


def test_commands_of_scenes_take_a_model(cube: Path, capfd: pytest.CaptureFixture[str]) -> None:
    assert status("mesh cube.stl -o same.ply --resolution 16 -q") == 0
    assert read_mesh("same.ply").volume == pytest.approx(1000, rel=1e-9)
    assert status("mesh cube.stl -o hollow.stl --resolution 32 --hollow 1mm -q") == 0
    assert 470 < read_mesh("hollow.stl").volume < 488  # with drain holes
    assert status("mesh cube.stl -o large.stl --resolution 16 -q --set model.units=cm") == 0
    assert read_mesh("large.stl").size.tolist() == [100, 100, 100]
    assert status("slice cube.stl -o layers.json --layer 2mm") == 0
    assert "5 layers" in capfd.readouterr().out
    assert status("render cube.stl -o cube.png --size 16x12 --samples 1 --device cpu -q") == 0
    assert Path("cube.png").stat().st_size > 100
    assert status("check cube.stl -q --layer 1mm") == 0


def test_a_fault_of_a_model_is_one_line(cube: Path, capfd: pytest.CaptureFixture[str]) -> None:
    shapes.without(shapes.cube(), 3).export("open.stl")
    assert status("mesh open.stl -o x.stl") == 2
    line = capfd.readouterr().err
    assert line.startswith("fracslice: open.stl: 3 open edges (a hole in the surface): expected a solid; ")
    assert line.count("\n") == 1 and not Path("x.stl").exists()


def test_models_outside_of_the_folder_need_an_option(cube: Path, capfd: pytest.CaptureFixture[str]) -> None:
    Path("scenes").mkdir()
    text = '<scene version="1"><solid size="1cm"><model file="../cube.stl"/></solid></scene>'
    Path("scenes/a.xml").write_text(text)
    assert status("mesh scenes/a.xml -o x.stl --resolution 16 -q") == 2
    line = 'scenes/a.xml:1: <model> file="../cube.stl": expected a file in the folder of the scene, or'
    assert f"fracslice: {line} --allow-files-outside\n" == capfd.readouterr().err
    assert status("mesh scenes/a.xml -o x.stl --resolution 16 -q --allow-files-outside") == 0


def test_a_worker_reads_the_same_model(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shutil.copy(BRACKET, tmp_path / "x.stl")
    path = tmp_path / "a.xml"
    path.write_text('<scene version="1"><solid size="1cm"><model file="x.stl" size="2"/></solid></scene>')
    scene = read(path)
    monkeypatch.chdir("/")
    planned = MeshRecipe(to_xml(scene), "a", MeshJob(resolution=16)).plan()
    assert planned.root.key == scene.root.key


def test_the_example_is_a_scene_of_its_model() -> None:
    root = read(Path(__file__).parents[2] / "examples" / "filled-vase.xml").root
    assert [node["place"] for node in root.walk() if node.formula.name == "model"] == ["bed", "bed"]
    assert root.bounds.box.size[2] == pytest.approx(80, abs=0.1)
    assert (root.distance([(-5, 5, 0.6), (-5, 5, -1), (0, -20, 40)]) < 0).tolist() == [True, False, False]


def test_the_geode_is_half_of_a_stone_without_its_fractal() -> None:
    root = read(Path(__file__).parents[2] / "examples" / "stone.xml").root
    points = [(0, 0, 1), (0, 0, -8), (20, 0, 0), (0, 0, -13), (0, 0, -17)]
    assert (root.distance(points) < 0).tolist() == [False, False, True, True, False]
