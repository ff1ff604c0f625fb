"""The camera that is chosen where a scene has none."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from fracslice.formulas import Box, Node, bounds, box, mandelbulb, sphere, torus, transform
from fracslice.rendering import Renderer
from fracslice.scene import library, read
from fracslice.scene.view import Camera, Film, Shading, View
from tests.examples import stamped

pytestmark = pytest.mark.once

BACK = (0.0, 0.0, 1.0)
SHAPES: dict[str, Node] = {
    "box": box(size=(2, 2, 1)),
    "rod": box(size=(8, 0.5, 0.5)),
    "tower": transform(box(size=(1, 1, 9)), translate=(30, -20, 0)),
    "ball in a large box": bounds(sphere(), min=(-1, -1, -1), max=(1, 1, 1)),
    "torus": torus(),
    "mandelbulb": mandelbulb(),
    "tiny": transform(mandelbulb(), scale=1e-4),
}
WIDE, HIGH = (48, 27), (27, 48)
LIBRARY = ("lattice-cube", "menger-ball", "menger-sponge", "twisted-vase", "menger-tower")


@pytest.mark.parametrize(
    ("name", "size"),
    stamped(
        product((*SHAPES, *LIBRARY), (WIDE, HIGH)),
        [("rod", WIDE), ("tower", HIGH), ("mandelbulb", WIDE), ("tiny", HIGH), ("twisted-vase", HIGH)],
    ),
)
def test_the_whole_object_is_in_view_and_fills_it(name: str, size: tuple[int, int]) -> None:
    view = View(film=Film(background=BACK), shading=Shading(mode="depth"))
    root = SHAPES[name] if name in SHAPES else read(library.path(name)).root
    *_, picture = Renderer(root, view, size, device="cpu").passes(samples=1)
    seen = (picture.shown != np.array(BACK) * 255).any(axis=2)
    assert seen.any()
    assert not (seen[[0, -1]].any() or seen[:, [0, -1]].any()), "cut off at the border"
    rows, columns = (np.ptp(np.flatnonzero(seen.any(axis=k))) / seen.shape[1 - k] for k in (1, 0))
    assert max(rows, columns) > 0.6


def test_a_box_is_in_view() -> None:
    camera = Camera.around(Box((1, 2, 3), (4, 4, 4)), aspect=2.0)
    assert camera.target == (2.5, 3, 3.5)
    for corner in Box((1, 2, 3), (4, 4, 4)).corners:
        away = np.subtract(corner, camera.eye)
        depth, tangent = away @ camera.forward, np.tan(np.radians(camera.fov / 2))
        assert abs(away @ camera.right) < 2 * depth * tangent and abs(away @ camera.above) < depth * tangent
