"""What is declared is used, what is used is declared, and the main job needs no extra."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest

pytestmark = pytest.mark.once

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
EXTRAS = PROJECT["optional-dependencies"]

MODULES = {
    "pillow": "PIL",
    "scikit-image": "skimage",
    "imageio-ffmpeg": "imageio_ffmpeg",
    "trame-client": "trame_client",
    "trame-rca": "trame_rca",
    "trame-vuetify": "trame",
}
"""Of packages, where it has another name."""

WITHIN = {"vtkmodules": "pyvista", "Imath": "OpenEXR"}
"""Modules that come with a package, and no other way."""

BLOCKED = (
    "pyvista vtkmodules matplotlib skimage manifold3d pymeshlab lxml networkx "
    "hypothesis shapely uharfbuzz imageio_ffmpeg pyoidn distributed dask fsspec trame aiohttp"
)


DEVELOPERS = {"dev", "docs"}
"""Extras that nobody else needs."""


def modules(requirements: list[str]) -> set[str]:
    """The modules of packages."""
    packages = [re.match(r"[\w-]+", requirement)[0] for requirement in requirements]  # type: ignore[index]
    return {MODULES.get(package, package) for package in packages}


def imports(node: ast.AST) -> Iterator[str]:
    """The modules that code imports, those for type checkers left out; `find_spec` and `lacking` look for
    some, too.
    """
    if isinstance(node, ast.If) and getattr(node.test, "id", "") == "TYPE_CHECKING":
        return
    if isinstance(node, ast.Import):
        yield from (name.name for name in node.names)
    elif isinstance(node, ast.ImportFrom) and not node.level:
        yield str(node.module)
    elif isinstance(node, ast.Call) and getattr(node.func, "id", "") in ("find_spec", "lacking"):
        yield from (word.value for word in node.args[:1] if isinstance(word, ast.Constant))
    for child in ast.iter_child_nodes(node):
        yield from imports(child)


def used() -> set[str]:
    """What is imported at run time and is neither ours nor Python's."""
    files = [*ROOT.glob("fracslice/**/*.py"), *ROOT.glob("cli/*.py")]
    assert len(files) > 100
    result = {
        name.partition(".")[0]
        for file in files
        for name in imports(ast.parse(file.read_text(encoding="utf-8")))
    }
    return {WITHIN.get(name, name) for name in result - set(sys.stdlib_module_names) - {"fracslice", "cli"}}


def test_every_core_dependency_is_imported_at_run_time() -> None:
    assert modules(PROJECT["dependencies"]) - used() == set()


def test_what_is_imported_at_run_time_is_declared() -> None:
    extras = [package for name, packages in EXTRAS.items() if name not in DEVELOPERS for package in packages]
    assert used() <= modules(PROJECT["dependencies"] + extras)
    assert modules(extras) - used() == set()


def test_what_is_for_developers_is_not_needed_by_anybody_else() -> None:
    own = [package for name in DEVELOPERS for package in EXTRAS[name] if not package.startswith("fracslice")]
    assert modules(own) & used() == set()
    assert EXTRAS["dev"][0] == f"fracslice[{','.join(name for name in EXTRAS if name not in DEVELOPERS)}]"


def without(modules: str, *commands: str, cwd: Path) -> subprocess.CompletedProcess[str]:
    """Commands one after the other, until one fails, where modules cannot be imported."""
    code = (
        f"import sys; sys.modules.update(dict.fromkeys({modules.split()!r}))\n"
        "from fracslice.cli.main import run\n"
        "for command in sys.argv[1:]:\n"
        "    if status := run(command.split()): sys.exit(status)"
    )
    command = [sys.executable, "-c", code, *commands]
    return subprocess.run(command, capture_output=True, text=True, cwd=cwd, check=False)


def test_the_main_job_needs_no_extra(ball_xml: Path) -> None:
    ball_xml.write_text(
        ball_xml.read_text(encoding="utf-8").replace("sphere", "box")
    )  # a ball stands on a point
    done = without(
        BLOCKED,
        "mesh ball.xml -o ball.3mf --resolution 16",
        "mesh ball.xml -o ball.ply --resolution 16",
        "check ball.ply --layer 1mm --pixel 0.5mm",
        "slice ball.xml -o ball.sl1 --printer sl1 --layer 5mm",
        "render ball.xml -o ball.exr --size 16x9 --samples 1 --device cpu",
        cwd=ball_xml.parent,
    )
    assert (done.returncode, done.stderr) == (0, "")
    made = {path.name for path in ball_xml.parent.iterdir()}
    assert made == {"ball.xml", "ball.3mf", "ball.ply", "ball.sl1", "ball.exr"}


@pytest.mark.parametrize(
    ("module", "arguments", "line"),
    [
        ("pyvista", "mesh ball.xml -o b.stl --picture b.png", 'pictures of meshes need pyvista{} "pyvista"'),
        ("pyvista", "fly ball.xml", 'windows need pyvista{} "pyvista"'),
        (
            "distributed",
            "slice ball.xml -o b.cli --cluster local",
            'clusters need distributed{} "distributed"',
        ),
        ("matplotlib", "bench", 'plots need matplotlib{} "matplotlib"'),
    ],
)
def test_a_missing_extra_is_one_line_that_says_what_to_install(
    ball_xml: Path, module: str, arguments: str, line: str
) -> None:
    done = without(module, arguments, cwd=ball_xml.parent)
    expected = line.format(", which is not installed: pip install")
    assert (done.returncode, done.stderr) == (2, f"fracslice: {expected}\n")
    assert list(ball_xml.parent.iterdir()) == [ball_xml]


def test_without_manifold3d_a_line_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    from fracslice.errors import MeshError
    from fracslice.mesh.model import to_manifold
    from tests.mesh.shapes import cube

    monkeypatch.setitem(sys.modules, "manifold3d", None)
    with pytest.raises(MeshError, match='solids need manifold3d, which is not installed: pip install "manif'):
        to_manifold(cube())


@pytest.fixture
def ball_xml(tmp_path: Path) -> Path:
    """A scene file alone in a folder."""
    path = tmp_path / "ball.xml"
    path.write_text('<scene version="1"><solid size="20mm"><sphere/></solid></scene>')
    return path


def test_no_text_names_a_module_of_another_package() -> None:
    """It would be an import past the contract of the layers."""
    for path in (ROOT / "fracslice").rglob("*.py"):
        own = path.relative_to(ROOT / "fracslice").parts[0]
        named = {*re.findall(r'["\']fracslice\.(\w+)\.', path.read_text(encoding="utf-8"))}
        assert own == "__init__.py" or named <= {own}, path
