"""Each kind of camera against its projection, by the distances to a sphere."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fracslice.errors import SceneError
from fracslice.formulas import mandelbulb, sphere
from fracslice.rendering.linking import camera_unit
from fracslice.rendering.setup import footprint, prepare
from fracslice.scene.view import Camera, View

from .rays import distances

pytestmark = pytest.mark.once

CAMERA = Camera(eye=(2.1, -1.3, 0.9), target=(0.2, 0.1, -0.1), up=(0.1, 0.0, 1.0), fov=70.0)
RIGHT, UP, FORWARD = (np.array(axis) for axis in (CAMERA.right, CAMERA.above, CAMERA.forward))
EYE, REACH = np.array(CAMERA.eye), float(np.linalg.norm(np.subtract(CAMERA.eye, CAMERA.target)))
WIDTH, HEIGHT = 48, 24
X, Y = np.meshgrid(np.arange(WIDTH) + 0.5, np.arange(HEIGHT) + 0.5)
Rays = tuple[np.ndarray, np.ndarray]


def turned(right: np.ndarray, up: np.ndarray, forward: np.ndarray) -> np.ndarray:
    """Vectors from their components along the axes of the camera."""
    return right[..., None] * RIGHT + up[..., None] * UP + forward[..., None] * FORWARD


def plane(x: np.ndarray, width: int) -> Rays:
    """Coordinates in the plane of the target, to the right and up."""
    half = REACH * np.tan(np.radians(35.0)) / (HEIGHT / 2)
    return (x - width / 2) * half, (HEIGHT / 2 - Y) * half


def orthographic() -> Rays:
    a, b = plane(X, WIDTH)
    return EYE + turned(a, b, 0 * a), turned(0 * a, 0 * a, 1 + 0 * a)


def fisheye() -> Rays:
    x, y = X - WIDTH / 2, HEIGHT / 2 - Y
    angle, around = np.hypot(x, y) / (HEIGHT / 2) * np.radians(35.0), np.arctan2(y, x)
    d = turned(np.sin(angle) * np.cos(around), np.sin(angle) * np.sin(around), np.cos(angle))
    return EYE + 0 * d, d


def panorama(x: np.ndarray, width: int) -> Rays:
    longitude, latitude = (x / width - 0.5) * 2 * np.pi, (0.5 - Y / HEIGHT) * np.pi
    level = np.cos(latitude)
    d = turned(level * np.sin(longitude), np.sin(latitude), level * np.cos(longitude))
    return turned(np.cos(longitude), 0 * longitude, -np.sin(longitude)), d


def stereo() -> Rays:
    a, b = plane(X % (WIDTH // 2), WIDTH // 2)
    origin = EYE + np.where(X < WIDTH // 2, -0.1, 0.1)[..., None] * RIGHT
    return origin, EYE + turned(a, b, REACH + 0 * a) - origin


def all_around() -> Rays:
    _, d = panorama(X, WIDTH)
    return EYE + 0 * d, d


def all_around_for_two() -> Rays:
    aside, d = panorama(X % (WIDTH // 2), WIDTH // 2)
    return EYE + np.where(X < WIDTH // 2, -0.1, 0.1)[..., None] * aside, d


CASES = {
    "orthographic": (replace(CAMERA, kind="orthographic"), orthographic),
    "fisheye": (replace(CAMERA, kind="fisheye"), fisheye),
    "equirectangular": (replace(CAMERA, kind="equirectangular"), all_around),
    "stereo": (replace(CAMERA, stereo=0.2), stereo),
    "stereo all around": (replace(CAMERA, kind="equirectangular", stereo=0.2), all_around_for_two),
}


@pytest.mark.parametrize("name", CASES)
def test_rays_are_those_of_the_projection(name: str) -> None:
    """The unit itself, as a function of NumPy arrays."""
    camera, rays = CASES[name]
    function, values = camera_unit(camera, (WIDTH, HEIGHT))
    *origin, x, y, z = function(X, Y, 0.0 * X, 0.0 * X, **values)
    wanted, d = rays()
    assert np.abs(np.stack(origin, -1) - wanted).max() < 1e-12
    assert np.abs(np.stack([x, y, z], -1) - d / np.linalg.norm(d, axis=2, keepdims=True)).max() < 1e-12


@pytest.mark.parametrize("name", CASES)
def test_distances_are_those_of_the_projection(name: str) -> None:
    """The compiled renderer: a sphere is where its rays meet it."""
    camera, rays = CASES[name]
    origin, d = rays()
    d = d / np.linalg.norm(d, axis=2, keepdims=True)
    b, c = (origin * d).sum(2), (origin**2).sum(2) - 0.81
    with np.errstate(invalid="ignore"):
        wanted = -b - np.sqrt(b * b - c)
    wanted[wanted < 0] = np.nan
    seen = distances(sphere(radius=0.9), camera, (WIDTH, HEIGHT))
    both = ~np.isnan(wanted) & ~np.isnan(seen)
    assert both.sum() > 8
    growth, base = footprint(camera, (WIDTH, HEIGHT))
    beside = np.abs(np.sqrt((origin**2).sum(2) - b * b) - 0.9)
    differ = (np.isnan(wanted) != np.isnan(seen)) & (b < 0)
    assert (beside < growth * -b + base)[differ].all()  # at the rim
    facing = np.abs(((origin + wanted[..., None] * d) * d).sum(2) / 0.9)
    assert (np.abs(seen - wanted) * facing)[both].max() < growth * np.nanmax(wanted) + base


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"fov": 180.0}, "fov=180: expected a number < 179; a fisheye sees more"),
        ({"kind": "fisheye", "aperture": 0.1}, r"aperture=0\.1: expected kind='perspective'"),
        ({"kind": "orthographic", "stereo": 0.1}, r"stereo=0\.1: expected kind='perspective' without"),
    ],
)
def test_bad_cameras(values: dict[str, object], message: str) -> None:
    with pytest.raises(SceneError, match=message):
        Camera(**values)  # type: ignore[arg-type]


def test_detail_of_parallel_rays_does_not_depend_on_the_distance() -> None:
    """A pixel has one width everywhere."""
    depths = []
    for far in (2.0, 40.0):
        fov = float(np.degrees(2 * np.arctan(1 / far)))
        camera = Camera(eye=(0.0, -far, 0.0), kind="orthographic", fov=fov)
        depths.append(prepare(mandelbulb(), View(camera=camera), (64, 64)).root["iterations"])
    assert depths[0] == depths[1]
