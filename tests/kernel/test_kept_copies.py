"""Copies of formulas are made once and read by later processes, and never for another text or number."""

from __future__ import annotations

from collections.abc import Callable
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from fracslice.expr import emitter, host, language
from fracslice.fields import depth, growth, linker, orbit_code, source, steps
from fracslice.fields.source import Copy, shared_copy

TEXT = """
SCALE = 2.0

def twice(x):
    return SCALE * x

def formula(x, y, z):
    return twice(x) - {}
"""


def module(path: Path, number: float) -> ModuleType:
    path.write_text(TEXT.format(number))
    spec = spec_from_file_location("kept", path)
    assert spec and spec.loader
    made = module_from_spec(spec)
    spec.loader.exec_module(made)
    return made


def copied(function: Callable[..., Any]) -> Copy:
    """Copy as a later process has it."""
    source._cached_shared_copy.cache_clear()
    return shared_copy(function, (), frozenset())


@pytest.fixture
def makes(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> list[str]:
    """Cache of its own; names of the functions whose copies are made."""
    monkeypatch.setenv("FRACSLICE_CACHE", str(tmp_path / "cache"))
    names, make = list[str](), source.copy_text

    def counted(tree: Any, function: Callable[..., Any], *given: Any) -> Copy:
        names.append(function.__name__)
        return make(tree, function, *given)

    monkeypatch.setattr(source, "copy_text", counted)
    return names


def test_a_copy_is_made_once(makes: list[str], tmp_path: Path) -> None:
    first = module(tmp_path / "kept.py", 1.0)
    whole = copied(first.formula)
    later = module(tmp_path / "kept.py", 1.0)
    again = copied(later.formula)
    assert makes == ["formula"]
    assert (again.name, again.text) == (whole.name, whole.text) and "1.0" in again.text
    assert again.calls == {"twice": later.twice}  # the functions of this process


def test_another_text_or_number_is_another_copy(makes: list[str], tmp_path: Path) -> None:
    own = module(tmp_path / "kept.py", 1.0)
    assert "2.0" in copied(own.twice).text
    own.SCALE = 3.0
    assert "3.0" in copied(own.twice).text
    assert "5.5" in copied(module(tmp_path / "kept.py", 5.5).formula).text
    assert makes == ["twice", "twice", "formula"]


def test_a_damaged_copy_is_made_again(makes: list[str], tmp_path: Path) -> None:
    own = module(tmp_path / "kept.py", 1.0)
    whole = copied(own.formula)
    (kept,) = (tmp_path / "cache" / "copies").glob("*.txt")
    kept.write_bytes(kept.read_bytes()[:-2])
    assert copied(own.formula) == whole and makes == ["formula"] * 2


@pytest.mark.parametrize("module", [source, linker, steps, orbit_code, growth, depth, language, emitter])
def test_what_makes_texts_is_in_their_key(module: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    """Another version of it must not read what this one has kept."""
    read = list[Path]()
    monkeypatch.setattr(host, "texts", lambda *files: read.extend(files) or "")
    host.toolchain.__wrapped__()
    assert module.__file__ and Path(module.__file__) in read
