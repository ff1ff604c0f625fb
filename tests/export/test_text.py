"""Rows of numbers as text."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fracslice._native import text_rows
from fracslice.common import files
from fracslice.common.files import number_rows
from fracslice.formats import write
from fracslice.work import Work
from tests.mesh.shapes import sphere

pytestmark = pytest.mark.once


def test_numbers_are_as_short_as_reads_back() -> None:
    bits = np.random.default_rng(3).integers(0, 1 << 32, 30_000, dtype=np.uint32)
    values = bits.view(np.float32)
    values = values[np.isfinite(values)][:20_000].reshape(-1, 2)
    lines = text_rows(["x ", " y "], "\n", values).decode().splitlines()
    words = [line.split()[1::2] for line in lines]
    assert np.array_equal(np.array(words, np.float32), values)
    forms = np.format_float_positional, np.format_float_scientific
    for word, value in zip(np.ravel(words), values.ravel(), strict=True):
        assert len(word) <= min(len(form(value, trim="-")) for form in forms)


def test_blocks_follow_each_other(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = np.arange(-7, 23).reshape(10, 3)
    monkeypatch.setattr(files, "ROWS", 4)
    blocks = [make() for make in number_rows(("<", ",", ","), ">", whole)]
    assert [block.count(b">") for block in blocks] == [4, 4, 2]
    assert b"".join(blocks) == b"".join(b"<%d,%d,%d>" % tuple(row) for row in whole.tolist())
    assert list(number_rows(("",), "", np.zeros((0, 1)))) == []


def test_a_text_for_each_column() -> None:
    with pytest.raises(ValueError, match="a text for each column"):
        text_rows(["x"], "\n", np.zeros((2, 3), np.float32))


@pytest.mark.parametrize("ending", [".3mf", ".obj"])
def test_same_bytes_for_any_number_of_threads(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, ending: str
) -> None:
    monkeypatch.setattr(files, "ROWS", 50)
    paths = [write(sphere(5), tmp_path / f"{n}{ending}", work=Work(n)) for n in (1, 3)]
    assert paths[0].read_bytes() == paths[1].read_bytes()
