"""Lights that are dragged in the picture."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fracslice.mesh.drawing import Projection
from fracslice.studio.handles import LightHandle

from .conftest import Begin

SCENE = """<scene version="1">
  <solid size="40mm"><sphere radius="0.5"/></solid>
  <light kind="sky"/>
  <light kind="{kind}" position="0.5 0.2 0.7"/>
  <film samples="1"/>
</scene>
"""


@pytest.mark.parametrize("kind", ["lamp", "sun"])
def test_a_light_is_dragged_in_the_picture(begin: Begin, kind: str) -> None:
    studio = begin("lit.xml", SCENE.format(kind=kind), (96, 64))
    studio.document.choose((0,))
    assert studio.handle is None
    studio.document.choose((2,))
    handle, camera, size = studio.handle, studio.live.camera, studio.live.size
    assert handle
    view = Projection.of(camera, size)
    place = view.seen(view.away(handle.mark(camera).points))[0, :2]
    assert handle.is_at((place[0] + 3, place[1]), camera, size)
    assert not handle.is_at((place[0] + 30, place[1]), camera, size)
    to = place + 0.3 * (np.array([48, 32]) - place) + [0, 4]
    studio.drag_handle((float(to[0]), float(to[1])))
    moved = studio.handle
    assert moved
    after = view.seen(view.away(moved.mark(camera).points))[0, :2]
    assert np.allclose(after, to, atol=0.2)
    assert 'kind="sky"' in studio.document.text and studio.document.undoes == 1
    if kind == "sun":
        before = np.linalg.norm(handle.light.position)
        assert math.isclose(float(np.linalg.norm(moved.light.position)), float(before), rel_tol=1e-3)


def test_a_sky_has_no_handle(begin: Begin) -> None:
    studio = begin("lit.xml", SCENE.format(kind="lamp"), (96, 64))
    studio.document.choose((1,))
    assert LightHandle.of(studio.document) is None
