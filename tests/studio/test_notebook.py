"""A studio as the value of a notebook's cell."""

from __future__ import annotations

import urllib.request
from collections.abc import Iterator
from pathlib import Path

import pytest

from fracslice import Scene, Studio, menger, sphere
from fracslice.errors import RenderError
from fracslice.studio import notebook
from fracslice.work import Work

pytestmark = pytest.mark.once


@pytest.fixture
def studio(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Studio]:
    monkeypatch.chdir(tmp_path)
    studio = Studio(sphere(2.0), Work(threads=1), "cpu")
    yield studio
    studio.close()


def test_its_page_is_served_beside_the_program(studio: Studio) -> None:
    with urllib.request.urlopen(studio.address, timeout=30) as answer:
        assert answer.status == 200
    assert studio._repr_html_().count(studio.address) == 1


def test_changes_are_told(studio: Studio) -> None:
    told: list[Scene] = []
    studio.on_change(told.append)
    page = studio._session
    page.set_number((0, 0), "radius", 0, 3.0)
    page.edit(page.document.set_value, (0, 0), "radius", "x")  # no scene
    page.edit(page.document.undo)
    assert [scene.root for scene in told] == [sphere(3.0), sphere(2.0)]
    assert studio.scene.root == sphere(2.0)


def test_without_the_extra_a_shape_shows_its_picture(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(notebook, "lacking", lambda *_: "the studio needs trame")
    shape = menger(1)
    assert shape.show() is shape
    with pytest.raises(RenderError, match="needs trame"):
        Studio(shape)
