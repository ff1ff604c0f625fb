"""What the README and the manual tell to type is understood, up to where the work begins."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest
from fracslice.cli.main import commands, run

from fracslice.export import write

from .mesh import shapes

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]


def told() -> list[str]:
    """The command lines of all pages, as they stand in indented blocks."""
    lines = [line for page in PAGES for line in page.read_text(encoding="utf-8").splitlines()]
    found = [line.partition("#")[0].strip() for line in lines if line.startswith("    fracslice ")]
    return list(dict.fromkeys(found))


def test_there_is_something_to_try() -> None:
    assert len(told()) > 15
    assert {shlex.split(line)[1] for line in told()} >= {*commands.commands}


class BegunError(Exception):
    """The work would begin now: all that was said is understood, files can be written, the scene is there."""


def begin(*_: object, **__: object) -> None:
    raise BegunError


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
    for name in ("my.stl", "my.3mf"):
        write(shapes.cube(), tmp_path / name)
    (tmp_path / "scenes").symlink_to(ROOT / "scenes")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("line", told())
def test_what_is_told_to_type_is_understood(line: str, folder: Path, monkeypatch, capfd) -> None:
    for work in (
        "job.make_mesh",
        "slicing.plan_stack",
        "rendering.Renderer",
        "bench.runs.measure",
        "viewer.fly",
    ):
        monkeypatch.setattr(f"fracslice.{work}", begin)
    monkeypatch.setattr("fracslice.viewer.show", begin)
    words = shlex.split(line.replace("[NAME]", "box"))[1:]
    if words[0] in ("scenes", "formulas") or words[:2] == ["check", "my.stl"]:
        assert run(words) == 0
        return
    with pytest.raises(BegunError):
        print(run(words), capfd.readouterr().err)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_every_option_that_is_named_is_there(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    quoted = " ".join(re.findall(r"`([^`\n]*)`", text))
    named = set(re.findall(r"(?<!\S)--[a-z-]+", quoted))
    parameters = [p for command in commands.commands.values() for p in command.params]
    known = {option for p in parameters for option in (*p.opts, *p.secondary_opts)}
    ours = {"--cpp", "--write", "--info"}  # of our benchmarks, and of a slicer
    assert named - known - ours <= {"--help"}
