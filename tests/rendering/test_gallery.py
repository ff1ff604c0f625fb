"""Shipped pictures are what the shipped scenes show."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from fracslice.rendering import Renderer
from fracslice.scene import library, read
from fracslice.work import Work
from tests.examples import stamped

pytestmark = pytest.mark.once

PICTURES = Path(__file__).parents[2] / "examples/gallery"
SIZE = (48, 30)


def test_every_scene_has_its_picture() -> None:
    scenes = {path.stem for path in (library.folder() / "gallery").glob("*.xml")}
    assert {path.stem for path in PICTURES.glob("*.webp")} == scenes
    assert max(path.stat().st_size for path in PICTURES.glob("*.webp")) < 450_000


@pytest.mark.parametrize("name", stamped(["coral", "dusk", "tower"], ["dusk"]))
def test_a_picture_is_of_its_scene(name: str) -> None:
    scene = read(library.folder() / "gallery" / f"{name}.xml")
    *_, last = Renderer(scene.root, scene.view, SIZE, Work(2), "cpu").passes(8)
    with Image.open(PICTURES / f"{name}.webp") as picture:
        shipped = np.asarray(picture.resize(SIZE, Image.Resampling.BOX)).astype(float)
    assert abs(last.shown - shipped).mean() < 12
