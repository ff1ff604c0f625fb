"""Pictures without noise."""

from __future__ import annotations

import sys
from functools import lru_cache
from types import ModuleType

import numpy as np
import pytest

from fracslice.formulas import Node, box, material, plane, sphere
from fracslice.jobs import pictures
from fracslice.rendering import Renderer
from fracslice.scene.view import Camera, Light, View
from fracslice.work import Work

pytestmark = pytest.mark.once

SIZE = 64, 48
VIEW = View(
    camera=Camera(eye=(0, -5, 1.5), fov=36),
    lights=(
        Light(kind="lamp", position=(-2, -2, 3), size=0.9, strength=14),
        Light(kind="sky", strength=0.3),
    ),
)


def still_life() -> Node:
    red, grey = (0.9, 0.2, 0.1), (0.7, 0.7, 0.7)
    floor = material(plane(offset=-1), colour=grey, specular=0)
    return floor | material(sphere(radius=0.8), colour=red) | material(box() + (1.6, 0.6, -0.4), colour=grey)


def rendered(samples: int) -> Renderer:
    renderer = Renderer(still_life(), VIEW, SIZE, Work(2), "cpu")
    for _ in renderer.passes(samples, tolerance=0.0):
        pass
    return renderer


@lru_cache
def truth() -> np.ndarray:
    return rendered(1024).seen().developed


def error(shown: np.ndarray) -> float:
    return float(np.sqrt(((shown - truth()) ** 2).mean()))


@pytest.mark.nightly
def test_the_error_falls_without_the_library(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pictures, "advice", lambda: "missing")
    noisy = rendered(4)
    before = noisy.seen()
    after = pictures.denoise(noisy)
    errors = [error(seen.developed) for seen in (after, before)]
    assert errors[0] < 0.6 * errors[1], errors
    assert (after.alpha == before.alpha).all()
    assert (noisy.seen().image == before.image).all(), "the renderer keeps its samples"


def test_open_image_denoise_falls_further(monkeypatch: pytest.MonkeyPatch) -> None:
    if pictures.advice():
        pytest.skip("pyoidn is not there")
    noisy = rendered(4)
    errors = [error(seen.developed) for seen in (pictures.denoise(noisy), noisy.seen())]
    assert errors[0] < 0.55 * errors[1], errors


def test_the_library_is_given_linear_light_and_its_guides(monkeypatch: pytest.MonkeyPatch) -> None:
    given: dict[str, object] = {}

    def denoise(light: np.ndarray, **of: object) -> np.ndarray:
        given.update(of)
        return light * 2

    library = ModuleType("pyoidn")
    library.denoise = denoise  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "pyoidn", library)
    monkeypatch.setattr(pictures, "advice", lambda: "")
    noisy = rendered(1)
    clean = pictures.denoise(noisy)
    assert np.allclose(clean.image, 2 * noisy.seen().image)
    albedo, normal = given["albedo"], given["normal"]
    assert given["hdr"] is True
    assert isinstance(albedo, np.ndarray) and albedo.shape == (48, 64, 3) and albedo.max() <= 1
    assert isinstance(normal, np.ndarray) and normal[40, 5] == pytest.approx((0, 0, 1), abs=1e-3)
