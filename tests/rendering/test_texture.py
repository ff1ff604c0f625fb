"""Textures on surfaces."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from fracslice.errors import SceneError
from fracslice.formulas import box, material
from fracslice.rendering import Renderer
from fracslice.rendering.materials import paint
from fracslice.rendering.units.camera import linear
from fracslice.scene import reads
from fracslice.scene.view import Camera, Shading, View
from fracslice.work import Work

pytestmark = pytest.mark.once

COLOURS = ((255, 0, 0), (0, 255, 0), (0, 0, 255), (255, 255, 0))


def checker(path: Path) -> str:
    """A picture of four quarters: red, green; blue, yellow."""
    pixels = np.repeat(np.repeat(np.array(COLOURS, np.uint8).reshape(2, 2, 3), 8, 0), 8, 1)
    Image.fromarray(pixels).save(path)
    return str(path)


@pytest.mark.parametrize("eye", [(0, -5, 0), (5, 0, 0), (0, 0, 5)])
def test_each_side_of_a_box_shows_the_picture_upright(
    tmp_path: Path, eye: tuple[float, float, float]
) -> None:
    """Of side 2 with tiles of 2, a wall has its corner in the middle."""
    file = checker(tmp_path / "a.png")
    root = material(box(size=(2, 2, 2)), colour=(1, 1, 1), texture=file, tile=2)
    up = (0, 1, 0) if eye[2] else (0, 0, 1)
    view = View(camera=Camera(eye=eye, up=up, fov=20), shading=Shading(mode="albedo"))
    *_, last = Renderer(root, view, (16, 16), Work(1), "cpu").passes(1)
    # The picture begins at the origin and repeats, so its lower right quarter is in the upper left.
    quarters = [last.image[r, c] for r in (3, 12) for c in (3, 12)]
    expected = np.array(COLOURS)[[3, 2, 1, 0]] / 255
    assert np.allclose(quarters, expected, atol=0.02)


def test_a_texture_multiplies_the_colour_and_changes_no_source(tmp_path: Path) -> None:
    file = checker(tmp_path / "a.png")
    view = View(camera=Camera(eye=(0, -5, 0), fov=20), shading=Shading(mode="albedo"))
    renderers = [
        Renderer(
            material(box(size=(2, 2, 2)), colour=colour, texture=file, tile=tile),
            view,
            (8, 8),
            Work(1),
            "cpu",
        )
        for colour, tile in (((0.5, 1, 1), 2), ((1, 1, 1), 1))
    ]
    *_, last = renderers[0].passes(1)
    assert last.image[1, 1] == pytest.approx((linear((0.5,))[0], 1, 0), abs=0.02)
    assert renderers[0]._frame.linked.program == renderers[1]._frame.linked.program


def test_a_texture_is_none_for_the_vertices_of_a_mesh(tmp_path: Path) -> None:
    file = checker(tmp_path / "a.png")
    with pytest.raises(SceneError, match="texture: expected none where vertices have colours"):
        paint(material(box(), texture=file), np.zeros((1, 3)), "material", Work())


def test_a_texture_that_is_missing_is_named() -> None:
    text = (
        '<scene version="1"><solid size="1cm">\n<material texture="no.png"><box/></material></solid></scene>'
    )
    scene = reads(text)
    with pytest.raises(SceneError, match=r"scene:2: <material> .*no.png.: No such file.*; expected a .hdr"):
        Renderer(scene.root, scene.view, (8, 8), Work(1), "cpu")
