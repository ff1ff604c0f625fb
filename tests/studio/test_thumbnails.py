"""Small pictures of what can be opened and added."""

from __future__ import annotations

import numpy as np
import pytest
from PIL import Image

from fracslice.scene import library
from fracslice.studio import panels
from tests import thumbnails

pytestmark = pytest.mark.once


def cell(name: str) -> np.ndarray:
    """Picture of a name, as the page shows it."""
    x, y = (-int(part.removesuffix("px")) for part in panels.places_of_pictures()[name].split())
    width, height = panels.CELL
    sheet = np.asarray(Image.open(panels.THUMBNAILS).convert("RGB"))
    return sheet[y : y + height, x : x + width]


def test_all_shipped_scenes_have_one() -> None:
    assert {*library.names(), *library.gallery()} <= panels.places_of_pictures().keys()


@pytest.mark.parametrize("name", ["sphere", "dusk"])
def test_it_is_at_its_place(name: str) -> None:
    made = thumbnails.picture(name)
    assert made is not None
    assert np.abs(made.astype(float) - cell(name)).mean() < 6


def test_a_shape_that_needs_a_file_has_none(capsys: pytest.CaptureFixture[str]) -> None:
    assert thumbnails.picture("model") is None
    assert "model" in capsys.readouterr().err
    assert "model" not in panels.places_of_pictures()
