"""Where rays hit, against closed forms and against dense sampling."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fracslice.fields.cpu import compile_scene
from fracslice.fields.devices import reference
from fracslice.formulas import (
    Node,
    box,
    get,
    mandelbox,
    mandelbulb,
    menger,
    plane,
    sphere,
    torus,
    transform,
    union,
)
from fracslice.rendering import Renderer
from fracslice.rendering import setup as optics
from fracslice.rendering.units import march
from fracslice.scene import library, read
from fracslice.scene.view import Camera, Film, Light, Shading, View
from fracslice.work import Work
from tests.examples import EXAMPLES, stamped
from tests.rendering.rays import directions, distances, hits_sphere, hits_sponge, hits_torus

pytestmark = pytest.mark.once

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
    result = distances(root, CAMERA, SIZE)
    wanted = exact(np.array(CAMERA.eye), directions(CAMERA, SIZE))
    wrong = np.isnan(result) != np.isnan(wanted)
    assert not (np.isnan(result) & ~np.isnan(wanted)).any(), "a ray that hits was missed"
    assert wrong.mean() < 0.002, "the silhouette is too wide"
    both = ~np.isnan(result) & ~np.isnan(wanted)
    error = abs(wanted - result)[both] / (PIXEL * wanted[both])
    assert np.median(error) < 0.2
    assert np.quantile(error, 0.99) < 0.5


def test_cones_are_free_for_every_ray_of_their_pixels() -> None:
    """Of a block after the first prepass, of a pixel after the second, which goes on from there."""
    root, fine = mandelbulb(iterations=4), 4
    view = View(camera=CAMERA, lights=(Light(shadows="no"),), shading=Shading(mode="distance"))
    renderer, (width, height) = Renderer(root, view, SIZE, Work(1), "cpu"), SIZE
    hits = distances(root, CAMERA, (fine * width, fine * height))
    nearest = np.nan_to_num(hits, nan=np.inf).reshape(height, fine, width, fine).min((1, 3))
    gaps = []
    for prepasses in (1, 2):
        renderer.prepare(prepasses)
        shift, starts = renderer.tracer._shift, renderer.tracer._starts.reshape(-1, renderer.tracer._blocks)
        started = starts.repeat(1 << shift, 0).repeat(1 << shift, 1)[:height, :width]
        hit = np.isfinite(nearest)
        assert (started[hit] <= nearest[hit]).all(), "a ray hits inside a cone that is said to be free"
        gaps.append(np.median((nearest - started)[hit] / (PIXEL * nearest[hit])))
    assert gaps[1] < 0.4 * gaps[0]


def test_rays_step_by_the_estimate_of_an_escape_time_fractal(monkeypatch: pytest.MonkeyPatch) -> None:
    """With fewer steps to the same roots; other fields have no such half."""

    def steps(root: Node, estimate: float) -> float:
        monkeypatch.setattr(optics, "ESTIMATE", estimate)
        view = View(camera=CAMERA, lights=(Light(shadows="no"),), shading=Shading(mode="steps"))
        *_, last = Renderer(root, view, SIZE, Work(1), "cpu").passes(samples=1)
        return float(last.image[last.alpha > 0, 0].mean())

    chosen = optics.ESTIMATE
    assert steps(mandelbulb(iterations=6), chosen) < 0.75 * steps(mandelbulb(iterations=6), 1.0)
    assert steps(menger(level=2), chosen) == steps(menger(level=2), 1.0)
    for other in (mandelbox(), union(mandelbulb(), sphere())):
        assert optics.ray_bound(other) == other.bounds.lipschitz


FAR = 50.0
"""Distance up to which roots are compared: a ground has no end."""
SQUEEZED = transform(mandelbulb(iterations=3), matrix=(1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0.01, 0))


def seen_from(name: str) -> tuple[Node, Camera]:
    """A gallery scene at the depth of a small picture, and its camera without a lens."""
    path = library.folder() / "gallery" / f"{name}.xml"
    scene = read(path if path.exists() else library.path(name))
    setup = Renderer(scene.root, scene.view, SIZE, Work(1), "cpu").setup
    return setup.root, replace(setup.camera, aperture=0.0)


@pytest.mark.parametrize(
    "name",
    stamped(
        ["abyss", "canyon", "dusk", "moon", "tower", "quaternion-julia", "squeezed bulb"],
        ["dusk", "tower", "squeezed bulb"],
    ),
)
def test_depth_is_within_half_a_pixel_of_the_root(name: str) -> None:
    """Of the first root on each ray in float64; the shape of a squeezed field, too."""
    if name == "squeezed bulb":
        root, camera = SQUEEZED, Camera(eye=(1.5, -1.5, 0.7), fov=40)
    else:
        root, camera = seen_from(name)
    size = (21, 15) if name == "abyss" else SIZE  # its rays take hundreds of steps
    result, wanted = distances(root, camera, size), first_root(root, camera, size)
    result[result > FAR] = np.nan
    assert (np.isnan(result) != np.isnan(wanted)).mean() < 0.003
    both = ~np.isnan(result) & ~np.isnan(wanted)
    pixel = 2 * np.tan(np.radians(camera.fov) / 2) / size[1] * wanted[both]
    assert both.mean() > 0.05
    assert (abs(result - wanted)[both] < 0.5 * pixel).mean() >= 0.99


def first_root(root: Node, camera: Camera, size: tuple[int, int]) -> np.ndarray:
    """By steps of the guaranteed bound in float64, to a ten-thousandth of a pixel or less."""
    kernel, d = compile_scene(root, "float64"), directions(camera, size).reshape(-1, 3)
    eye, box = np.array(camera.eye), root.bounds.box
    pixel = 2 * np.tan(np.radians(camera.fov) / 2) / size[1]
    with np.errstate(divide="ignore"):
        a, b = (np.array(box.lo) - eye) / d, (np.array(box.hi) - eye) / d
    t, leave = np.maximum(np.minimum(a, b).max(1), 0), np.maximum(a, b).min(1)
    result, left = np.full(len(d), np.nan), np.flatnonzero(t < leave)
    while left.size:
        clear = kernel.points(*(eye + t[left, None] * d[left]).T) / root.bounds.lipschitz
        least = 3e-5 * pixel * t[left]
        result[left] = np.where(clear < least, t[left], np.nan)
        t[left] += np.maximum(clear, least)
        left = left[(clear >= least) & (t[left] < np.minimum(leave[left], FAR))]
    return result.reshape(size[::-1])


def test_a_wire_covers_its_own_width() -> None:
    """Of a pixel's width or a hundredth of it: hits are roots, not places near a surface."""
    camera, size = Camera(eye=(0, -3, 0), target=(0, 0, 0), fov=30), (24, 16)
    pixel = 2 * 3 * np.tan(np.radians(15)) / size[1]
    for width in (1.0, 0.1, 0.01):
        wire = {"from": (0.31, 0, -3), "to": (0.37, 0, 3), "radius": width * pixel / 2}
        view = View(
            camera=camera,
            film=Film(background=(0, 0, 0)),
            lights=(Light(kind="lamp", strength=0),),
            shading=Shading(ambient=1),
        )
        shape = get("material")(get("capsule")(**wire), colour=(1, 1, 1), specular=0)
        *_, last = Renderer(shape, view, size, Work(2), "cpu").passes(4096, tolerance=0.0)
        assert last.image[..., 0].sum() == pytest.approx(width * size[1], rel=0.1)


@pytest.mark.parametrize(
    "root",
    [
        get("twist")(box(size=(1, 1, 2)), degrees=240),
        get("bend")(box(size=(1.5, 0.2, 0.2)), degrees=40),
        transform(box(size=(0.3, 1, 1)), matrix=(7, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0)),
    ],
    ids=["twisted", "bent", "stretched"],
)
def test_surfaces_near_which_the_field_grows_slowly_are_lit(root: Node) -> None:
    """Shadow rays leave them: all that the camera sees faces the light."""
    view = View(camera=Camera(eye=(0, -5, 0)), lights=(Light(position=(0.1, -1, 0.1)),))
    *_, last = Renderer(root, view, (32, 24), Work(1), "cpu").passes(1)
    assert (last.image.sum(2) < 0.02)[last.alpha == 1].mean() < 0.1


def test_shadow_rays_end_at_the_box(monkeypatch: pytest.MonkeyPatch) -> None:
    """Beyond it a long union would be asked for all of its elements."""
    asked = []

    def ball(x, y, z, _):  # type: ignore[no-untyped-def]
        asked.append(np.stack([x, y, z]))
        return np.sqrt(x * x + y * y + z * z) - 1

    monkeypatch.setattr(march, "blocker", ball)
    rng = np.random.default_rng(4)
    start, towards = (v / np.linalg.norm(v, axis=0) for v in rng.normal(size=(2, 3, 500)))
    box = (-1.01,) * 3, (1.01,) * 3
    seen = march.visible(*(1.001 * start), *towards, 100.0, 1e-4, None, 1.0, 800, False, *box)
    away = (start * towards).sum(0)
    clear = abs(away) > 0.1  # of rays that graze
    np.testing.assert_array_equal(seen[clear] > 0.5, away[clear] > 0)
    assert len(asked) > 10 and np.max(np.abs(asked)) < 1.02


def test_glass_casts_no_opaque_shadow() -> None:
    ground = plane(offset=-1)
    ball = get("material")(sphere(radius=0.8), clear=0.95)
    camera = Camera(eye=(0, -6, 3), target=(0, 0, -1))
    view = View(camera=camera, lights=(Light(position=(1, 0, 1)),))
    pictures = [
        list(Renderer(root, view, (48, 36), Work(1), "cpu").passes(8))[-1].image
        for root in (union(ground, ball), ground, union(ground, sphere(radius=0.8)))
    ]
    left = np.s_[8:30, :14]  # the ground in the ball's shadow
    passed = (pictures[0] / pictures[1])[left]
    assert passed.min() == pytest.approx((0.95 * 0.96) ** 2, rel=0.02), "what its two sides reflect"
    assert passed.max() == pytest.approx(1, abs=1e-4)
    assert pictures[2][left].min() < 0.5 * pictures[1][left].min()


@pytest.mark.parametrize(
    "name",
    stamped(
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
        ["difference", "mandelbulb", "smooth union", "twist"],
    ),
)
def test_no_ray_passes_what_dense_sampling_finds(name: str) -> None:
    root = EXAMPLES[name]
    camera = Camera(eye=(2.1, -1.6, 1.3), fov=55)
    result = distances(root, camera, SIZE)
    first = first_inside(root, np.array(camera.eye), directions(camera, SIZE))
    hit = np.isfinite(first)
    assert hit.mean() > 0.02
    assert not np.isnan(result[hit]).any(), "a ray that hits was missed"
    pixel = 2 * np.tan(np.radians(camera.fov) / 2) / SIZE[1] * first[hit]
    assert ((result - first)[hit] < pixel).all(), "a ray went through the surface"


def first_inside(root: Node, eye: np.ndarray, d: np.ndarray, step: float = 0.004) -> np.ndarray:
    """The first of many equally spaced points on each ray where the field is negative."""
    field, first = reference(root), np.full(d.shape[:2], np.inf)
    for t in np.arange(0.2, 5.0, step):
        x, y, z = (eye[k] + t * d[..., k] for k in range(3))
        first = np.where((field(x, y, z) < 0) & np.isinf(first), t, first)
    return first
