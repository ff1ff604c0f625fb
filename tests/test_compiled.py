"""Loops that Numba compiles: their code is kept, for their text as it is, where nobody else can write."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numba
import pytest

from fracslice.common import compiled
from fracslice.errors import FracsliceWarning
from fracslice.printing import samples


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    monkeypatch.setenv("FRACSLICE_CACHE", str(tmp_path / "kernels"))
    compiled._folder.cache_clear()
    yield tmp_path / "kernels"
    compiled._folder.cache_clear()


def twice(x):  # type: ignore[no-untyped-def]
    return 2 * x


def test_code_is_kept_where_kernels_are(folder: Path) -> None:
    assert compiled.compiled(twice)(4) == 8
    assert len(list(folder.glob("loops/*/*/*.nbc"))) == 1
    assert not numba.config.CACHE_DIR
    assert compiled.compiled(twice)(4) == 8
    assert len(list(folder.glob("loops/*/*/*.nbc"))) == 1


def test_code_is_of_the_text_of_all_of_them(monkeypatch: pytest.MonkeyPatch) -> None:
    """`walls` calls `samples`, and its own file stays."""
    read, edited = Path.read_bytes, Path(samples.__file__)
    before = compiled._folder()
    compiled._folder.cache_clear()
    monkeypatch.setattr(Path, "read_bytes", lambda path: read(path) + b"#" * (path == edited))
    assert compiled._folder() != before


def test_code_that_others_can_write_is_not_taken(folder: Path) -> None:
    assert compiled.compiled(twice)(4) == 8
    before = {path: path.read_bytes() for path in folder.rglob("*.nb?")}
    folder.chmod(0o777)
    compiled._folder.cache_clear()
    with pytest.warns(FracsliceWarning, match=f"{folder}: others can write"):
        again = compiled.compiled(twice)
    assert again(4) == 8
    assert not again.stats.cache_hits and {p: p.read_bytes() for p in folder.rglob("*.nb?")} == before


def test_a_machine_where_nothing_can_be_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("FRACSLICE_CACHE", str(tmp_path / "file" / "kernels"))
    assert compiled.compiled(twice)(4) == 8
