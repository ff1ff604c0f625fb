"""Where rays hit, against closed forms and against dense sampling."""

from __future__ import annotations

import numpy as np
import pytest

from fracslice.formulas import Node, menger, sphere, torus
from fracslice.kernel import reference
from fracslice.scene.view import Camera
from tests.examples import EXAMPLES
from tests.rendering.rays import directions, distances, hits_sphere, hits_sponge, hits_torus

SIZE = (56, 40)
CAMERA = Camera(eye=(1.9, -2.3, 1.2), target=(0.05, 0, 0), fov=50)
PIXEL = 2 * np.tan(np.radians(25)) / SIZE[1]

CLOSED = {
    "sphere": (sphere(radius=0.8), lambda e, d: hits_sphere(e, d, 0.8)),
    "torus": (torus(radius=0.8, tube=0.3), lambda e, d: hits_torus(e, d, 0.8, 0.3)),
    "menger": (menger(level=2), lambda e, d: hits_sponge(e, d, 2)),
}


@pytest.mark.parametrize("name", CLOSED)
def test_depth_and_silhouette_are_those_of_the_closed_form(name: str) -> None:
    root, exact = CLOSED[name]
    found = distances(root, CAMERA, SIZE)
    wanted = exact(np.array(CAMERA.eye), directions(CAMERA, SIZE))
    wrong = np.isnan(found) != np.isnan(wanted)
    assert not (np.isnan(found) & ~np.isnan(wanted)).any(), "a ray that hits was missed"
    assert wrong.mean() < 0.02, "the silhouette is more than about half a pixel too wide"
    both = ~np.isnan(found) & ~np.isnan(wanted)
    error = (wanted - found)[both]
    assert np.median(abs(error)) < PIXEL * 3
    assert error.min() > -1e-4, "a ray went through the surface"
    assert np.quantile(error, 0.9) < 10 * PIXEL


@pytest.mark.parametrize(
    "name",
    [
        "difference",
        "endless repeat",
        "julia",
        "mandelbulb",
        "mandelbulb 5",
        "smooth union",
        "twist",
        "repeat",
        "example of the documentation",
    ],
)
def test_no_ray_passes_what_dense_sampling_finds(name: str) -> None:
    root = EXAMPLES[name]
    camera = Camera(eye=(2.1, -1.6, 1.3), fov=55)
    found = distances(root, camera, SIZE)
    first = first_inside(root, np.array(camera.eye), directions(camera, SIZE))
    hit = np.isfinite(first)
    assert hit.mean() > 0.02
    assert not np.isnan(found[hit]).any(), "a ray that hits was missed"
    assert (found - first)[hit].max() < 1e-3, "a ray went through the surface"


def first_inside(root: Node, eye: np.ndarray, d: np.ndarray, step: float = 0.004) -> np.ndarray:
    """The first of many equally spaced points on each ray where the field is negative."""
    field, first = reference(root), np.full(d.shape[:2], np.inf)
    for t in np.arange(0.2, 5.0, step):
        x, y, z = (eye[k] + t * d[..., k] for k in range(3))
        first = np.where((field(x, y, z) < 0) & np.isinf(first), t, first)
    return first
