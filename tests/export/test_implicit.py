"""Formulas in 3MF, read by lib3mf in strict mode and evaluated by a reader written from the specification."""

from __future__ import annotations

import os
import zipfile
from pathlib import Path
from xml.etree import ElementTree as Tree

import numpy as np
import pytest
from fracslice.cli.main import run

from fracslice.common.parameters import AUTO
from fracslice.errors import KernelError, MeshError, SceneError
from fracslice.export import implicit as graphs
from fracslice.export.implicit import write_implicit
from fracslice.fields.devices import reference
from fracslice.fields.registry import get
from fracslice.formulas import Node, mandelbulb, menger, model, sphere, transform, twist, union
from fracslice.jobs.mesh import make_implicit
from fracslice.mesh.models import read_mesh
from fracslice.records import MeshJob
from fracslice.scene import Print, library, read, scene
from tests.scene.trees import OTHERS, SHAPES

pytestmark = pytest.mark.once

CORE = "{http://schemas.microsoft.com/3dmanufacturing/core/2015/02}"
IMPLICIT = "{http://schemas.3mf.io/3dmanufacturing/implicit/2023/12}"
LEVEL_SET = "{http://schemas.3mf.io/3dmanufacturing/volumetric/2022/01}levelset"
NODES = {
    "addition": np.add, "subtraction": np.subtract, "multiplication": np.multiply, "division": np.divide,
    "min": np.minimum, "max": np.maximum, "abs": np.abs, "sqrt": np.sqrt, "floor": np.floor, "sin": np.sin,
    "cos": np.cos, "atan2": np.arctan2, "exp": np.exp, "log": np.log,
    "select": lambda a, b, c, d: np.where(a < b, c, d),
}  # fmt: skip
"""Nodes of the specification with scalar inputs A, B, C, D."""


class Read:
    """The function, the domain and the attributes of the level set that a file builds."""

    def __init__(self, path: Path) -> None:
        with zipfile.ZipFile(path) as archive:
            root = Tree.fromstring(archive.read("3D/3dmodel.model"))
        (item,) = root.iter(f"{CORE}item")
        objects = {e.attrib["id"]: e for e in root.iter(f"{CORE}object")}
        (level_set,) = objects[item.attrib["objectid"]]
        assert level_set.tag == LEVEL_SET
        self.about = level_set.attrib
        (self.function,) = root.iter(f"{IMPLICIT}implicitfunction")
        assert self.function.attrib["id"] == self.about["functionid"]
        rows = objects[self.about["meshid"]].iter(f"{CORE}vertex")
        self.corners = np.array([[float(v.attrib[k]) for k in "xyz"] for v in rows])

    def __call__(self, points: np.ndarray) -> np.ndarray:
        """Values at points [3, n]; a node refers to earlier ones only."""
        values: dict[str, np.ndarray] = {}
        for node in self.function:
            kind, name = node.tag.removeprefix(IMPLICIT), node.get("identifier")
            inputs = {e.attrib["identifier"]: e.attrib["ref"] for e in node.iterfind(f"{IMPLICIT}in/")}
            if kind == "constant":
                values[f"{name}.value"] = np.float64(node.attrib["value"])
            elif kind == "decomposevector":
                assert inputs == {"A": "inputs.pos"}
                values |= {f"{name}.{axis}": row for axis, row in zip("xyz", points, strict=True)}
            elif kind in NODES:
                operands = [values[inputs[letter]] for letter in "ABCD"[: len(inputs)]]
                with np.errstate(all="ignore"):
                    values[f"{name}.result"] = NODES[kind](*operands)
            elif kind == "out":
                (output,) = node
                assert output.attrib["identifier"] == self.about["channel"]
                return np.broadcast_to(values[output.attrib["ref"]], points[0].shape)
            else:
                assert kind == "in"
        raise AssertionError("no output")


def points_in(box: np.ndarray, count: int) -> np.ndarray:
    """Random points in a slightly larger box [2, 3]."""
    middle, half = box.mean(0), np.ptp(box, axis=0) / 2
    return np.random.default_rng(1).uniform(middle - 1.1 * half, middle + 1.1 * half, (count, 3)).T


def test_a_menger_sponge_of_level_4_is_a_file_of_3_kilobytes(tmp_path: Path) -> None:
    made = make_implicit(scene(menger(level=4), size="81mm"), MeshJob(), tmp_path / "menger.3mf")
    assert os.path.getsize(made.path) < 3300
    assert made.box.size == pytest.approx((81, 81, 81), rel=1e-6)
    function = Read(made.path)
    assert function.about["meshbboxonly"] == "true" and float(
        function.about["minfeaturesize"]
    ) == pytest.approx(81 / 256)
    box = np.array([function.corners.min(0), function.corners.max(0)])
    np.testing.assert_allclose(box, [[-40.5, -40.5, 0], [40.5, 40.5, 81]], atol=0.2)
    points = points_in(box, 100_000)
    expected = 40.5 * reference(menger(level=4))(*((points - [[0], [0], [40.5]]) / 40.5))
    np.testing.assert_allclose(function(points), expected, atol=1e-9)
    assert 0.05 < (expected < 0).mean() < 0.25


@pytest.mark.parametrize("name", ["menger-sponge", "mandelbulb", "twisted-vase"])
def test_lib3mf_reads_them_in_strict_mode(name: str, tmp_path: Path) -> None:
    lib3mf = pytest.importorskip("lib3mf")
    made = make_implicit(read(library.path(name)), None, tmp_path / "model.3mf")
    model = lib3mf.get_wrapper().CreateModel()
    reader = model.QueryReader("3mf")
    reader.SetStrictModeActive(True)
    reader.ReadFromFile(str(made.path))
    assert reader.GetWarningCount() == 0
    functions, sets = model.GetFunctions(), model.GetLevelSets()
    assert functions.MoveNext() and sets.MoveNext()
    function = functions.GetCurrentFunction()
    assert sets.GetCurrentLevelSet().GetFunction().GetResourceID() == function.GetResourceID()
    assert function.GetNodes().Count() == made.operations - 2  # x, y and z are one node


@pytest.mark.parametrize("name", ["mandelbulb", "mandelbox", "quaternion-julia", "hybrid", "twisted-vase"])
def test_shipped_scenes_are_their_field_at_100_000_points(name: str, tmp_path: Path) -> None:
    """In mm, placed as a mesh is; the field over its Lipschitz bound."""
    job = MeshJob(size=50, up=(0, 1, 0), printing=Print(base=2))
    made = make_implicit(read(library.path(name)), job, tmp_path / "model.3mf")
    function = Read(made.path)
    points = points_in(function.corners, 100_000)
    values = function(points)
    field = reference(made.root)(*made.place.units(points.T).T)
    expected = field * made.place.scale / made.root.bounds.lipschitz
    off = np.abs(values - expected)
    assert np.isfinite(values).all() and 0.02 < (values < 0).mean() < 0.9
    assert np.quantile(off, 0.999) < 1e-6 and ((values < 0) != (expected < 0)).mean() < 1e-4
    assert made.box.lo[2] == 0 and (values[points[2] < -1e-3] > 0).all()


def test_a_third_of_the_shapes_and_every_operator_are_their_fields(tmp_path: Path) -> None:
    inner = union(sphere(radius=0.4), transform(sphere(radius=0.3), translate=(0.5, 0.1, 0)))
    roots: list[Node] = [made for f in SHAPES[::3] if (made := possible(f)) is not None]
    roots += [made for f in OTHERS if (made := possible(f, inner)) is not None]
    assert len(roots) > 15
    points = np.random.default_rng(3).uniform(-1.2, 1.2, (3, 500))
    for root in roots:
        known = root.changed(**{k: 4 for k, v in root.values.items() if isinstance(v, str) and v == AUTO})
        made = write_implicit(graphs.operations(known), known.bounds.box, 0.1, tmp_path / "one.3mf", {})
        expected = reference(known)(*points) / known.bounds.lipschitz
        off = np.abs(Read(made)(points) - expected) / (1 + np.abs(expected))
        assert off.max() < 1e-9, root.formula.name


@pytest.mark.parametrize("name", ["model", "scaffold"])
def test_what_lies_in_memory_is_no_formula(name: str) -> None:
    stone = Path(__file__).parents[2] / "examples" / "stone.stl"
    root = model(file=str(stone)) if name == "model" else get(name)(sphere(radius=0.4), count=20)
    with pytest.raises(SceneError, match=f"<{name}> is data in memory, no formula"):
        graphs.operations(root)


def possible(formula: object, *children: Node) -> Node | None:
    """A formula with its defaults, if it has them all and a box."""
    try:
        made: Node = formula(*children)  # type: ignore[operator]
    except SceneError:
        return None
    return made if made.bounds.box.finite and not made.is_in_memory else None


def test_what_is_no_formula_is_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "x.3mf"
    for how in (Print(bridge=1.0), Print(keep="largest"), Print(cavities="fill")):
        with pytest.raises(SceneError, match="needs samples of the field; expected a mesh"):
            make_implicit(scene(sphere(), size=10), MeshJob(printing=how), path)
    monkeypatch.setattr(graphs, "MOST", 50)
    with pytest.raises(KernelError, match="more than 50 operations"):
        make_implicit(scene(twist(mandelbulb(), degrees=10), size=10), None, path)
    monkeypatch.undo()
    assert not path.exists()
    for options, message in (
        (["-o", "x.stl"], "x.stl: expected a file name that ends in .3mf, for --implicit"),
        (["-o", str(path), "--chord", "0.1mm"], "--chord: only for meshes"),
    ):
        assert run(["mesh", "mandelbulb", "--implicit", *options]) == 2
        assert message in capfd.readouterr().err
    make_implicit(scene(sphere(), size=10), None, path)
    with pytest.raises(MeshError, match="holds a formula"):
        read_mesh(path)
