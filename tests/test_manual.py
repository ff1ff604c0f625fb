"""What the pages say holds: links resolve, commands are understood, what they name exists."""

from __future__ import annotations

import pkgutil
import re
import shlex
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

import click
import pytest
from fracslice.cli.main import NAMES, commands, run

from fracslice.formats import write

from .mesh import shapes

for name in ("animation.film", "jobs.slices", "scene.calibration"):
    import_module(f"fracslice.{name}")  # before a test replaces what they import

pytestmark = pytest.mark.once

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
MADE = {"_build", "examples"}
PAGES = [
    *(ROOT / name for name in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md", "licenses/README.md")),
    *sorted(page for page in DOCS.rglob("*.md") if page.relative_to(DOCS).parts[0] not in MADE),
]
TEXT = {page: page.read_text(encoding="utf-8") for page in PAGES}
BARE = {
    page: re.sub(r"^```.*?^```$", "", text, flags=re.MULTILINE | re.DOTALL) for page, text in TEXT.items()
}
"""Pages without their fenced blocks."""

each_page = pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))


def anchors(page: Path) -> set[str]:
    """The names of a page's headings, as GitHub and Sphinx make them, and its own labels."""
    headings = re.findall(r"^#+ (.*)$", BARE[page], re.MULTILINE)
    slugs = {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}
    return slugs | set(re.findall(r"^\(([\w-]+)\)=$", BARE[page], re.MULTILINE))


@each_page
def test_links_and_anchors_resolve(page: Path) -> None:
    for target in re.findall(r"\]\(([^)\s]+)\)", BARE[page]):
        if target.startswith("https:"):
            continue
        path, _, anchor = target.partition("#")
        file = (page.parent / path).resolve() if path else page
        assert file.exists(), target
        assert not anchor or anchor in anchors(file), target


@each_page
def test_table_cells_hold_no_paragraphs(page: Path) -> None:
    cells = re.findall(r"(?<=\|)(?:[^|\n\\]|\\.)+(?=\|)", BARE[page])
    assert [cell for cell in cells if len(cell.strip()) > 120] == []


def test_every_page_is_in_one_table_of_contents() -> None:
    listed = []
    for page, text in TEXT.items():
        for tree in re.findall(r"```\{toctree\}\n(?::.*\n)*\n(.*?)```", text, re.DOTALL):
            listed += [(page.parent / f"{name}.md").resolve() for name in tree.split() if name[0] != "/"]
    pages = {page for page in PAGES if page.is_relative_to(DOCS)}
    assert sorted(listed) == sorted(pages - {DOCS / "index.md"})


def typed(program: str) -> list[str]:
    """The lines of all pages' shell blocks that start a program."""
    blocks = [block for text in TEXT.values() for block in re.findall(r"```sh\n(.*?)```", text, re.DOTALL)]
    lines = [line.strip() for block in blocks for line in block.splitlines()]
    return list(dict.fromkeys(line for line in lines if line.startswith(f"{program} ")))


def every_command() -> list[click.Command]:
    context = click.Context(commands)
    return [command for name in NAMES if (command := commands.get_command(context, name))]


def test_every_command_is_shown() -> None:
    assert {shlex.split(line)[1] for line in typed("fracslice")} >= {*NAMES} - {"formulas"}
    assert "`fracslice formulas`" in TEXT[DOCS / "start.md"]


class BegunError(Exception):
    """The work would begin now: the line is understood, files can be written, the scene is there."""


def begin(*_: object, **__: object) -> None:
    raise BegunError


OWN = """
from fracslice.formulas import orbit
from fracslice.fields.maps import ball, fold

@orbit()
def own(w, c):
    return -1.7 * ball(fold(w, 1.0), 0.5) + c
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where the reader is, with files of their own."""
    scene = (
        '<scene version="1"><solid size="20mm">'
        '<union><sphere/><transform translate="1.5 0 0" scale="0.4"><sphere/></transform></union>'
        "</solid></scene>"
    )
    for name in ("my.xml", "part.xml"):
        (tmp_path / name).write_text(scene)
    for name in ("my.stl", "my.3mf", "part.stl"):
        write(shapes.cube(), tmp_path / name)
    (tmp_path / "my.ini").write_text("")
    (tmp_path / "own.py").write_text(OWN)
    for name in ("fields.registry.FORMULAS", "fields.registry._FILES"):
        monkeypatch.setattr(f"fracslice.{name}", dict(pkgutil.resolve_name(f"fracslice.{name}")))
    for name in ("scenes", "examples"):
        (tmp_path / name).symlink_to(ROOT / name)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("line", typed("fracslice"))
def test_commands_are_understood(line: str, folder: Path, monkeypatch, capfd) -> None:
    words = shlex.split(line)[1:]
    if words[0] in ("scenes", "formulas") or words[-1] == "list":
        assert run(words) == 0
        return
    for work in (
        "jobs.mesh.make_mesh",
        "jobs.mesh.make_apart",
        "jobs.divided.make_parts",
        "mesh.checks.repair",
        "jobs.mesh.make_implicit",
        "slicing.orientation.orientations",
        "slicing.plan_stack",
        "jobs.slices.plan_layers",
        "jobs.pictures.make_picture",
        "rendering.Renderer",
        "animation.Timeline",
        "bench.measurements.measure",
        "scene.calibration.calibration",
        "scene.mandelbulber.import_scene",
        "viewer.fly",
        "cluster.connect",
    ):
        monkeypatch.setattr(f"fracslice.{work}", begin)
    monkeypatch.setattr("fracslice.viewer.show", begin)
    monkeypatch.setattr("fracslice.studio.session.Session", begin)
    monkeypatch.setattr("shutil.which", lambda name: name)
    monkeypatch.setattr("fracslice.export.slicer_profiles.Shipped.write", lambda *_: [])
    monkeypatch.setattr("fracslice.viewer.need_screen", lambda: None)
    with pytest.raises(BegunError):
        print(run(words), capfd.readouterr().err)


@each_page
def test_options_exist(page: Path) -> None:
    spans = re.findall(r"`([^`\n]*)`", BARE[page])
    quoted = " ".join(span for span in spans if not span.startswith("python -m tests."))
    named = set(re.findall(r"(?<!\S)--[a-z-]+", quoted))
    parameters = [p for command in every_command() for p in command.params]
    known = {option for p in parameters for option in (*p.opts, *p.secondary_opts)}
    others = {"--help", "--write", "--info"}  # click's, the benchmarks' and a slicer's
    assert named - known - others == set()


def test_modules_and_make_targets_exist() -> None:
    text = "\n".join(TEXT.values())
    modules = set(re.findall(r"python -m (tests[\w.]*\w)", text))
    assert modules == {"tests.benchmarks", "tests.budgets", "tests.outputs", "tests.structure"}
    assert {name for name in modules if find_spec(name) is None} == set()
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(), re.MULTILINE))
    assert set(re.findall(r"(?:`|^ {4}|^)make ([a-z-]+)", text, re.MULTILINE)) <= targets


def test_pages_that_the_code_names_exist() -> None:
    files = [file for folder in ("fracslice", "cli", "tests") for file in (ROOT / folder).rglob("*.[pch]*")]
    text = "\n".join(
        file.read_text(encoding="utf-8") for file in files if file.suffix in (".py", ".h", ".cpp")
    )
    named = set(re.findall(r"\bdocs/[\w/]+\.md\b", text))
    assert {name for name in named if not (ROOT / name).exists()} == set()
