"""A picture as an array."""

from __future__ import annotations

import io
import threading
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from fracslice import (
    Camera,
    Light,
    Mesh,
    Picture,
    RenderJob,
    box,
    cylinder,
    make_mesh,
    render,
    slice_layers,
    sphere,
)
from fracslice.api.options import RenderKeywords, WorkKeywords
from fracslice.errors import Cancelled, RenderError, SceneError
from fracslice.scene import scene
from fracslice.scene.view import Film, View

SHAPE = (box() - sphere(0.6)).material(colour=(0.9, 0.1, 0.1))
SMALL = {"size": (48, 32), "samples": 1, "device": "cpu"}


@pytest.fixture(scope="module")
def picture() -> Picture:
    return render(SHAPE, **SMALL)


def test_a_picture_is_an_array_that_notebooks_show(picture: Picture) -> None:
    assert (picture.shape, picture.dtype.name) == ((32, 48, 3), "uint8")
    shown = Image.open(io.BytesIO(picture._repr_png_() or b""))
    assert np.array_equal(np.asarray(shown), picture)
    assert picture[8:24]._repr_png_() is not None and picture[..., 0]._repr_png_() is None
    assert not picture.flags.writeable and picture.copy().flags.writeable


def test_it_shows_the_shape(picture: Picture) -> None:
    red = picture[..., 0].astype(int) - picture[..., 2]
    assert red[12:20, 20:28].mean() > 40 and red[:, 0].max() < 20


def test_the_scene_and_the_keywords_say_how() -> None:
    view = View(film=Film(width=20, height=10, samples=1), camera=Camera(eye=(0, -5, 1)))
    by_scene = render(scene(SHAPE, size=10, view=view), device="cpu")
    assert by_scene.shape == (10, 20, 3)
    dark = render(SHAPE, size=(20, 10), samples=1, lights=[Light(strength=0.0)], device="cpu")
    assert dark[3:7, 8:12].max() < by_scene[3:7, 8:12].mean()
    assert np.array_equal(by_scene, render(SHAPE, size=(20, 10), samples=1, camera=view.camera, device="cpu"))


def test_an_array_is_a_size(picture: Picture) -> None:
    assert np.array_equal(render(SHAPE, **{**SMALL, "size": np.array([48, 32])}), picture)


def test_progress_is_reported_and_work_is_cancelled() -> None:
    reported: list[tuple[str, float]] = []
    render(SHAPE, size=(16, 16), samples=2, progress=lambda stage, share: reported.append((stage, share)))
    assert reported[-1] == ("rendering", 1.0)
    stop = threading.Event()
    stop.set()
    with pytest.raises(Cancelled):
        render(SHAPE, cancel=stop, **SMALL)


@pytest.mark.parametrize(
    ("options", "error", "message"),
    [
        ({"sample": 1}, TypeError, r"render\(\) has no argument 'sample'; did you mean samples\?"),
        ({"size": (0, 10)}, RenderError, r"size=\(0, 10\): expected pixels across and down"),
        ({"camera": (3, 3, 2)}, TypeError, r"camera=\(3, 3, 2\): expected a Camera"),
        ({"lights": Light()}, TypeError, "expected a sequence of Light"),
        ({"samples": 0}, RenderError, "samples=0: expected a whole number"),
        ({"camera": Camera(eye=(0.1, 0, 0.4))}, SceneError, "eye: expected a place outside"),
    ],
)
def test_values_that_cannot_be_are_named(options: dict, error: type, message: str) -> None:
    with pytest.raises(error, match=message):
        render(box(), **{"size": (16, 16), **options})


def shown(what: object) -> np.ndarray:
    return np.asarray(Image.open(io.BytesIO(what._repr_png_())))  # type: ignore[attr-defined]


def test_a_notebook_shows_a_mesh_and_layers() -> None:
    mesh = make_mesh(box((3, 1, 1)), size=30, resolution=16)
    picture = shown(mesh)
    rows, columns = np.nonzero(picture[..., 3] == 255)
    assert picture.shape == (360, 480, 4) and 400 < np.ptp(columns) < 480 and np.ptp(rows) > 250
    faces = {tuple(colour) for colour in picture[rows, columns][::7].tolist()}
    assert 3 <= len(faces) < 12  # three faces, each with its light
    assert Mesh(mesh.vertices, mesh.triangles[:0])._repr_png_() is None
    layers = slice_layers(cylinder(2, 5), layer=0.5, pixel=0.1)
    assert shown(layers).shape[1] > shown(layers[3:5]).shape[1] > 200
    assert layers[:0]._repr_png_() is None


def test_the_picture_of_a_mesh_has_its_colours() -> None:
    mesh = make_mesh(sphere().material(colour=(1, 0, 0)), resolution=16, colour="material")
    picture = shown(mesh)
    red, green, _ = picture[picture[..., 3] == 255][:, :3].max(0)
    assert red > 200 and green < 40


def test_a_part_without_noise_in_a_file(picture: Picture, tmp_path: Path) -> None:
    """What the command can, Python can: a crop has the pixels of the whole, a file those of the array."""
    part = render(SHAPE, **SMALL, crop=(12, 8, 16, 10))
    assert np.array_equal(part, picture[8:18, 12:28])
    path = tmp_path / "part.png"
    clean = render(SHAPE, RenderJob(crop="12,8,16,10", denoise=True), path=path, time="1min", **SMALL)
    assert clean.shape == part.shape and (clean != part).any()
    assert abs(np.asarray(Image.open(path)).astype(int) - clean).max() <= 1
    other = render(SHAPE, **SMALL, seed=1)
    assert (other != picture).any() and abs(other.mean() - picture.mean()) < 5


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"bits": 16}, "bits 16: expected a .png file"),
        ({"bits": 9}, "bits=9: expected 8 or 16"),
        ({"layers": True}, "layers: expected an .exr file"),
        ({"time": "soon"}, "time='soon': expected a time above zero"),
        ({"crop": "1,2,3"}, "crop='1,2,3': expected left, top, width and height"),
        ({"crop": (40, 0, 20, 20)}, "expected a part of 48 x 32 pixels"),
    ],
)
def test_settings_that_cannot_be_are_named(options: dict, message: str) -> None:
    with pytest.raises(RenderError, match=message):
        render(SHAPE, **SMALL, **options)


def test_keywords_are_the_fields_of_the_record() -> None:
    assert {*RenderJob.kinds(), *WorkKeywords.__annotations__} == {*RenderKeywords.__annotations__}
