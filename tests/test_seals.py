"""Marks that only this user can make."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from fracslice.common import cache
from fracslice.errors import FracsliceWarning

pytestmark = pytest.mark.once


@pytest.fixture(autouse=True)
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    cache._secret.cache_clear()
    yield tmp_path / "fracslice"
    cache._secret.cache_clear()


def test_they_are_the_same_in_every_process_and_only_this_user_can_make_them(home: Path) -> None:
    first = cache.seal("a job")
    cache._secret.cache_clear()
    assert cache.seal("a job") == first != cache.seal("another")
    assert (home / "secret").stat().st_mode & 0o777 == 0o600
    assert home.stat().st_mode & 0o777 == 0o700
    cache._secret.cache_clear()
    (home / "secret").unlink()
    assert cache.seal("a job") != first


def test_a_secret_that_others_can_change_is_none(home: Path) -> None:
    first = cache.seal("a job")
    (home / "secret").write_bytes(bytes(cache.SIZE))
    (home / "secret").chmod(0o666)
    cache._secret.cache_clear()
    with pytest.warns(FracsliceWarning, match="others can write this file"):
        again = cache.seal("a job")
    assert again != first
    cache._secret.cache_clear()
    assert cache.seal("a job") == again


def test_without_a_place_for_it_jobs_are_this_process_own(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "file"))
    with pytest.warns(FracsliceWarning, match="interrupted jobs will not go on"):
        first = cache.seal("a job")
    assert cache.seal("a job") == first
