"""Formulas from outside the package."""

from __future__ import annotations

from pathlib import Path

import pytest
from fracslice.cli.main import run

from fracslice.errors import FracsliceWarning
from fracslice.fields import registry
from fracslice.fields.node import FORMULAS

OWN = '''
from fracslice.formulas import Number, orbit, shape
from fracslice.fields.maps import ball, fold

@orbit(scale=Number(-1.7, "enlarges"))
def own_box(w, c, scale):
    """My own box."""
    return scale * ball(fold(w, 1.0), 0.5) + c

@shape(radius=Number(1.0, "the radius", above=0))
def egg(x, y, z, radius):
    """An egg."""
    return (x * x + y * y + z * z) ** 0.5 - radius
'''
TWICE = "from fracslice.formulas import shape\n@shape()\ndef sphere(x, y, z):\n    return x\n"
SCENE = '<scene version="1"><solid size="40mm"><own_box iterations="4"/></solid></scene>'


@pytest.fixture(autouse=True)
def forgotten():  # type: ignore[no-untyped-def]
    known, files = dict(FORMULAS), dict(registry._FILES)
    yield
    FORMULAS.clear()
    FORMULAS.update(known)
    registry._FILES.clear()
    registry._FILES.update(files)


@pytest.fixture
def files(tmp_path: Path) -> tuple[str, str]:
    own, scene = tmp_path / "own.py", tmp_path / "own.xml"
    own.write_text(OWN)
    scene.write_text(SCENE)
    return str(own), str(scene)


def test_a_command_takes_a_file_of_formulas(files: tuple[str, str], tmp_path: Path) -> None:
    own, scene = files
    target = tmp_path / "own.stl"
    assert run(["mesh", scene, "-o", str(target), "--resolution", "24"]) == 2
    assert run(["mesh", scene, "-o", str(target), "--resolution", "24", "--formulas", own]) == 0
    assert target.stat().st_size > 1000


def test_the_list_says_where_formulas_are_from(files: tuple[str, str], capsys: pytest.CaptureFixture) -> None:
    assert run(["formulas", "--formulas", files[0]]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.strip() for line in lines if "own_box" in line] == [
        f"own_box               My own box. [{files[0]}]"
    ]
    assert any(line.strip().startswith("mandelbox") and "[" not in line for line in lines)


def test_a_check_examines_the_formulas_of_a_file(
    files: tuple[str, str], capsys: pytest.CaptureFixture
) -> None:
    assert run(["formulas", "--check", files[0]]) == 0
    out = capsys.readouterr().out
    assert (
        out.count("ok ") == 12
        and "derivative of the step: too small at 0.0%" in out
        and ": proved; L = 2: measured" in out
        and "egg:" in out
        and "own_box:" in out
    )
    steep = Path(files[0]).with_name("steep.py")
    steep.write_text(OWN.replace("own_box", "steep_box").replace("egg", "steep").replace("** 0.5 -", "-"))
    assert run(["formulas", "--check", str(steep)]) == 1
    out = capsys.readouterr().out
    assert out.count("FAULT bound L = 1: broken") == 1 and "; slopes up to " in out


def test_a_check_finds_a_derivative_that_is_too_small(
    files: tuple[str, str], tmp_path: Path, capsys: pytest.CaptureFixture
) -> None:
    picture = tmp_path / "own.png"
    Path(files[0]).write_text(OWN.replace("0.5) + c", "0.5) + c, 1.5").replace("@shape", "# @shape"))
    assert run(["formulas", "--check", files[0], "--picture", str(picture)]) == 1
    assert "FAULT derivative of the step: too small at" in capsys.readouterr().out
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert run(["formulas", "--picture", str(picture)]) == 2
    for refused in ("own.jpg", "none/own.png"):
        before = sorted(tmp_path.iterdir())
        assert run(["formulas", "--check", files[0], "--picture", str(tmp_path / refused)]) == 2
        assert capsys.readouterr().out == "" and sorted(tmp_path.iterdir()) == before


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("\nx = 1 / 0\n", "own.py:2: ZeroDivisionError: division by zero"),
        ("\n\ndef (:\n", "own.py:3: SyntaxError"),
        (
            "from fracslice.formulas import shape\n@shape()\ndef sphere(x, y, z):\n    return x\n",
            "own.py:2: formula 'sphere'",
        ),
    ],
)
def test_a_file_that_cannot_be_run_is_one_line(
    files: tuple[str, str], text: str, message: str, capsys: pytest.CaptureFixture
) -> None:
    Path(files[0]).write_text(text)
    assert run(["mesh", files[1], "-o", "x.stl", "--formulas", files[0]]) == 2
    assert message in capsys.readouterr().err


class _Entry:
    value = "own.shapes"

    def __init__(self, path: str) -> None:
        self.load = lambda: registry.run_file(path)


def test_installed_packages_are_loaded(files: tuple[str, str], monkeypatch: pytest.MonkeyPatch) -> None:
    """One that cannot be loaded is left out with a warning."""
    from fracslice.scene import read

    entries = [_Entry("none.py"), _Entry(files[0])]
    monkeypatch.setattr(
        "importlib.metadata.entry_points", lambda group: entries if group == registry.GROUP else []
    )
    registry.load_installed.cache_clear()
    try:
        with pytest.warns(
            FracsliceWarning, match=r"formulas of own\.shapes are left out: SceneError: none\.py"
        ):
            assert read(files[1]).root.formula.name == "own_box"
    finally:
        registry.load_installed.cache_clear()
