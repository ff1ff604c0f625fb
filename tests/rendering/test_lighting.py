"""Light, fog and background as documented."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from fracslice.errors import RenderError, SceneError
from fracslice.formulas import Node, box, difference, material, plane, repeat, sphere, transform, union
from fracslice.rendering import Pass, Renderer, develop, progressive
from fracslice.rendering.units.camera import linear
from fracslice.rendering.units.shade import dielectric, goes_on, height_fog, lacquer
from fracslice.scene.lights.sky import sky
from fracslice.scene.view import Camera, Film, Fog, Light, Shading, View
from fracslice.work import Work
from tests.examples import stamped
from tests.rendering.rays import directions

pytestmark = pytest.mark.once

SIZE = (24, 18)
CAMERA = Camera(eye=(0, -4, 0), fov=40)
SKY = Light(kind="sky", colour=(0.1, 0.2, 0.9), horizon=(0.9, 0.5, 0.2), ground=(0.1, 0.1, 0.1))


def rendered(root: Node, view: View, samples: int = 1, size: tuple[int, int] = SIZE) -> Pass:
    *_, last = Renderer(root, view, size, Work(1), "cpu").passes(samples)
    return last


def test_fog_leaves_the_sky_and_hides_surfaces_in_its_colour() -> None:
    ground, view = plane(offset=-1), View(camera=CAMERA, lights=(SKY,))
    clear = rendered(ground, view)
    sky = clear.alpha == 0
    assert 0.3 < sky.mean() < 0.7
    for colour in (None, (0.2, 0.9, 0.3)):
        foggy = rendered(ground, replace(view, fog=Fog(colour=colour, density=5)))
        assert (foggy.image[sky] == clear.image[sky]).all()
        rows = foggy.image[~sky]
        if colour:
            assert np.allclose(rows, linear(colour), atol=1e-3)
        else:
            behind = rendered(sphere(radius=0.01), replace(view, fog=None))
            assert np.allclose(rows, behind.image[~sky], atol=1e-3), "the colour of the sky behind"


@pytest.mark.parametrize("distance", [2.0, 2.3, 4.0])
def test_a_ball_that_refracts_nothing_is_invisible(distance: float) -> None:
    """Its rays enter and leave once, at any distance, and meet no fog inside."""
    ball, camera = material(sphere(radius=1), clear=1, index=1), replace(CAMERA, eye=(0, -distance, 0), fov=8)
    view = View(camera=camera, lights=(SKY,))
    seen, behind = (rendered(root, view).image for root in (ball, sphere(radius=1e-6)))
    assert np.allclose(seen, behind, rtol=0.01)
    foggy = rendered(ball, replace(view, fog=Fog(colour=(1, 0, 0), density=1))).image
    air = np.exp(1 - distance)
    assert np.allclose(foggy[9, 12], air * behind[9, 12] + (1 - air) * np.array((1, 0, 0)), atol=0.02)


def test_a_glass_ball_shows_the_sky_by_the_laws_of_refraction() -> None:
    """Against the closed form, with two reflections inside: exits are roots, not up to two pixels off."""
    camera, size, index = CAMERA, (1280, 960), 1.5
    view = View(camera=camera, lights=(SKY,), shading=Shading(bounces=4))
    ball = material(sphere(radius=1), clear=1, index=index)
    *_, last = Renderer(ball, view, size, Work(1), "cpu", crop=(720, 0, 32, 960)).passes(8, tolerance=0.0)
    d = directions(camera, size)[:, 720:752]
    b = (d @ np.array(camera.eye))[..., None]
    distance = -b - np.sqrt(np.maximum(b * b - 15, 0))
    normal = np.array(camera.eye) + distance * d
    cosine = np.maximum(-(d * normal).sum(2, keepdims=True), 0)
    bent = np.sqrt(1 - (1 - cosine**2) / index**2)
    inside = d / index + (cosine / index - bent) * normal
    outer, inner = dielectric(cosine, bent**2, 1 / index), dielectric(bent, cosine**2, index)
    light = outer * seen(d + 2 * cosine * normal)
    weight = 1 - outer
    for _ in range(3):
        normal = normal + 2 * bent * inside  # where the chord ends
        light += weight * (1 - inner) * seen(index * inside - (index * bent - cosine) * normal)
        inside, weight = inside - 2 * bent * normal, weight * inner
    blocks = [
        np.where(b * b > 15.05, a, 0).reshape(30, 32, 1, 32, 3).sum((1, 3)) for a in (last.image, light)
    ]
    ratio = blocks[0][blocks[1] > 30] / blocks[1][blocks[1] > 30]
    assert ratio.size > 50
    assert abs(ratio - 1).mean() < 0.01 and abs(ratio.mean() - 1) < 0.005


@pytest.mark.parametrize(("degrees", "expected"), [(0, 0.04), (45, 0.0502), (60, 0.0892), (75, 0.2531)])
def test_glass_reflects_as_fresnel_says_from_both_sides(degrees: float, expected: float) -> None:
    cosine, index = np.cos(np.radians(degrees)), 1.5
    left = 1 - (1 - cosine**2) / index**2
    assert dielectric(cosine, left, 1 / index) == pytest.approx(expected, abs=1e-4)
    assert dielectric(np.sqrt(left), cosine**2, index) == pytest.approx(expected, abs=1e-4)
    assert lacquer(cosine, 0.5) == pytest.approx(expected / 2, abs=1e-4)


def test_of_two_panes_a_slab_passes_what_both_leave() -> None:
    """Reflections inside included: (1 - R) / (1 + R)."""
    cosine = np.cos(np.radians(75))
    part = dielectric(cosine, 1 - (1 - cosine**2) / 2.25, 1 / 1.5)
    assert (1 - part) / (1 + part) == pytest.approx(0.60, abs=0.005)


def test_total_reflection_and_a_solid_of_hardly_any_index() -> None:
    ray = np.sin(np.radians(50)), 0.0, -np.cos(np.radians(50))
    for side, index, out in ((-1.0, 1.5, 1.0), (1.0, 1.5, -1.0), (1.0, 1.0001, -1.0), (-1.0, 1.0001, -1.0)):
        *_, passed = goes_on(*ray, 0.0, 0.0, 1.0, np.float64(side), 0.0, 1.0, index, 0.2)
        assert passed == out
    assert dielectric(1e-3, 1 - (1 - 1e-6) / 1.0001**2, 1 / 1.0001) < 0.8


def test_a_thin_gap_under_glass_is_not_passed() -> None:
    """A box of glass, a twentieth of its width above a table, had black bands."""
    table = material(
        transform(box(size=(20, 20, 0.2)), translate=(0, 0, -0.7)), colour=(0.9, 0.4, 0.1), specular=0
    )
    glass = material(box(size=(2, 2, 1)), colour=(0, 0, 0), specular=0, clear=1, index=1.5)
    camera, white = Camera(eye=(3, -4, 3), target=(0, 0, 0.5), fov=20), (1.0, 1.0, 1.0)
    sky = Light(kind="sky", colour=white, horizon=white, ground=white, strength=0.7)
    view = View(camera=camera, lights=(sky,), shading=Shading(bounces=16, paths="yes"))
    image = rendered(union(table, glass), view, 32, (96, 72)).image[20:36, 30:66, 0]  # its top
    assert image.reshape(4, 4, 9, 4).mean((1, 3)).min() > 0.3


def test_an_edge_of_glass_is_no_line() -> None:
    """A block on its edge under a sky that hardly changes: an edge as wide as a pixel was 12 % darker."""
    block = material(
        transform(box(size=(2, 2, 2)), rotate=(0, 0, 1, 45)), colour=(0, 0, 0), specular=0, clear=1
    )
    half, white = (0.5, 0.5, 0.5), (1.0, 1.0, 1.0)
    sky = Light(kind="sky", colour=white, horizon=half, ground=(0, 0, 0))
    camera = Camera(eye=(0.4, -6, 0.6), target=(0, 0, 0.1), fov=12)
    view = View(camera=camera, lights=(sky,), shading=Shading(bounces=6))
    columns = rendered(block, view, 64).image.mean((0, 2))
    assert np.ptp(columns) < 0.03 * columns.mean()


@pytest.mark.parametrize("kind", ["orthographic", "perspective"])
@pytest.mark.parametrize("height", stamped([1, 2, 6, 18], [6]))
def test_a_glowing_ball_is_as_bright_at_any_size(kind: str, height: int) -> None:
    """L (r / d)^2 cos, the mean over the picture.

    Rays within half a pixel of the ball met it, and rays went on 1.5 pixels above the floor: it was three
    times as bright at 6 rows. Rays passed a ball narrower than a pixel: 6 % were lost at one row.
    """
    radius, light = 0.1, 5.0
    floor = material(transform(box(size=(40, 40, 1)), translate=(0, 0, -0.5)), colour=(1, 1, 1), specular=0)
    ball = material(
        transform(sphere(radius=radius), translate=(0, 0, 1)), colour=(1, 1, 1), glow=light, specular=0
    )
    camera = Camera(kind=kind, eye=(0, -4, 2), target=(0, -1, 0), fov=20)
    dark = Light(kind="sky", colour=(0, 0, 0), horizon=(0, 0, 0), ground=(0, 0, 0))
    view = View(camera=camera, lights=(dark,), shading=Shading(bounces=1, paths="yes"))
    of = Renderer(union(floor, ball), view, (2 * height, height), Work(1), "cpu")
    *_, last = of.passes(800_000 // height**2, tolerance=0.0)
    u, v = np.meshgrid((np.arange(256) + 0.5) / 64 - 2, 1 - (np.arange(128) + 0.5) / 64)
    film = np.tan(np.radians(10)) * (u[..., None] * camera.right + v[..., None] * camera.above)
    start, ray = np.array(camera.eye) + 0 * film, camera.forward + film
    if kind == "orthographic":
        start, ray = start + np.sqrt(13) * film, camera.forward + 0 * film
    points = start - start[..., 2:] / ray[..., 2:] * ray
    distance = np.linalg.norm(points - [0, 0, 1], axis=-1)
    expected = (light * (radius / distance) ** 2 / distance).mean()
    assert last.image[..., 0].mean() == pytest.approx(expected, rel=0.005)


def seen(d: np.ndarray) -> np.ndarray:
    """Light of the sky."""
    colours = (linear(c) for c in (SKY.colour, SKY.horizon, SKY.ground))
    return np.stack(sky(*np.moveaxis(d, -1, 0), *colours), -1)


@pytest.mark.parametrize("colour", [(1.0, 1.0, 1.0), (0.2, 0.6, 0.8)])
def test_the_background_is_shown_as_it_is(colour: tuple[float, float, float]) -> None:
    film = Film(background=colour, exposure=1.5, bloom=0.5)
    seen = rendered(sphere(radius=0.3), View(camera=CAMERA, film=film, lights=(Light(),)))
    assert (seen.shown[0, 0] == np.round(255 * np.array(colour))).all()
    assert (seen.shown[9, 12] != seen.shown[0, 0]).any()


def test_a_transparent_film_holds_the_light_of_the_object_alone() -> None:
    lights = (SKY, Light(shadows="no"))
    view = View(camera=CAMERA, film=Film(alpha="yes"), lights=lights)
    clear, plain = (rendered(sphere(), v, 16) for v in (view, View(camera=CAMERA, lights=lights)))
    empty, full = clear.alpha == 0, clear.alpha == 1
    assert empty.any() and full.any() and not clear.image[empty].any()
    assert np.allclose(clear.image[full], plain.image[full])
    shown = clear.developed
    assert shown.shape == (*SIZE[::-1], 4)
    assert np.allclose(shown[..., 3], clear.alpha)
    assert np.allclose(shown[full, :3], plain.developed[full], atol=1e-6)


def test_depth_and_distance_are_in_scene_units() -> None:
    view = View(camera=CAMERA, shading=Shading(mode="depth"))
    ball = sphere(radius=1)
    depth = rendered(ball, view, 1, (25, 19)).image[..., 0]
    assert depth[9, 12] == pytest.approx(3, abs=1e-3)
    assert depth[0, 0] == 1e10
    far = rendered(ball, replace(view, shading=Shading(mode="distance")), 1, (25, 19)).image[..., 0]
    hit = depth < 1e9
    assert (far[hit] >= depth[hit]).all() and far[hit].max() > depth[hit].max()
    place = rendered(ball, replace(view, shading=Shading(mode="position")), 1, (25, 19)).image
    assert np.allclose(np.linalg.norm(place[hit], axis=1), 1, atol=1e-3)
    assert np.allclose(np.linalg.norm(place[hit] - CAMERA.eye, axis=1), far[hit], atol=1e-3)


def test_positions_are_shown_by_their_range_wherever_the_object_is() -> None:
    for x in (0.0, 100.0):
        ball = transform(sphere(radius=1), translate=(x, 0, 0))
        done = rendered(ball, View(shading=Shading(mode="position")), 1, (25, 19))
        hit = done.alpha == 1
        assert np.ptp(done.developed[hit], axis=0) == pytest.approx([1, 1, 1], abs=1e-3)


def test_a_scene_without_end_is_lit_from_the_camera() -> None:
    lattice = repeat(sphere(radius=0.3), period=(1, 1, 1))
    camera = Camera(eye=(0.5, 0.5, 0.5), target=(2.5, 1.5, 1), fov=60)
    first = rendered(lattice, View(camera=camera), 1)
    again = rendered(lattice, View(camera=camera), 16)
    assert first.developed.mean() > 0.2
    assert np.median(abs(first.developed - again.developed)) < 0.03, "no sparkles"
    assert (rendered(box(), View()).image > 0).any()


def test_a_light_at_the_camera_has_its_strength_at_the_target() -> None:
    wall = box(size=(9, 0.2, 9))
    light = Light(kind="camera", strength=0.5)
    view = View(camera=replace(CAMERA, target=(0, -0.1, 0)), lights=(light,), film=Film(tone="none"))
    white = material(wall, colour=(1, 1, 1), specular=0)
    assert rendered(white, view, 1, (5, 5)).image[2, 2, 0] == pytest.approx(0.5, rel=1e-3)


def test_a_picture_larger_than_the_memory_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(progressive, "available_bytes", lambda: 8 << 30)
    with pytest.raises(RenderError, match="size: 1,074 million pixels need 64 GB of memory, 9 GB are free"):
        Renderer(sphere(), View(), (32768, 32768), Work(1), "cpu")


def test_a_clip_plane_opens_the_solid_to_an_eye_inside() -> None:
    """From within the wall of a hollow ball: the cut at the distance of the plane, the far wall in it."""
    wall = difference(sphere(radius=2), sphere(radius=1))
    camera = Camera(eye=(0, -1.5, 0), target=(0, 0, 0), fov=100, clip=1.0)
    with pytest.raises(SceneError, match="outside the solid"):
        Renderer(wall, View(camera=replace(camera, clip=0.0)), (9, 9), Work(1), "cpu")
    view = View(camera=camera, shading=Shading(mode="depth"))
    *_, last = Renderer(wall, view, (65, 65), Work(1), "cpu").passes(1)
    depth = last.image[32, :, 0]
    assert depth[32] == pytest.approx(2.5, abs=0.01), "the far wall"
    assert depth[:3] == pytest.approx(1.0, abs=0.01) and depth[-3:] == pytest.approx(1.0, abs=0.01)
    of = Renderer(wall, view, (9, 9), Work(1), "cpu")
    of.look(camera.moved(right=0.1))
    assert next(of.passes(1)).image.min() == pytest.approx(1.0, abs=0.01)


def test_albedo_is_the_colour_without_light() -> None:
    scene = union(material(sphere(radius=0.5), colour=(0.9, 0.2, 0.1)), plane(offset=-3))
    seen = rendered(scene, View(camera=CAMERA, shading=Shading(mode="albedo")), 1, (25, 19))
    assert np.allclose(seen.image[9, 12], linear((0.9, 0.2, 0.1)), atol=1e-6)
    assert np.allclose(develop(seen.mean, seen.view)[9, 12], (0.9, 0.2, 0.1), atol=1e-4)


@pytest.mark.parametrize("slope", [-0.6, 0.0, 1e-5, 0.8])
def test_height_fog_is_the_integral_of_its_density(slope: float) -> None:
    t, end, fog = 3.0, 0.7, {"density": 0.4, "level": 0.2, "height": 0.9}
    heights = end - slope * (np.arange(20_000) + 0.5) / 20_000 * t
    depth = (0.4 * np.exp((0.2 - heights) / 0.9)).mean() * t
    assert height_fog(t, np.float64(end), np.float64(slope), **fog) == pytest.approx(np.exp(-depth), rel=1e-6)


@pytest.mark.parametrize("height", stamped([None, 1e6], [None]))
def test_fog_scatters_the_light_that_no_surface_shadows(height: float | None) -> None:
    """Of a sun of strength 1, albedo / 4 (1 - exp(-density distance)); nothing of it under a roof."""
    wall = material(box(size=(9, 0.2, 9)), colour=(0, 0, 0), specular=0)
    roof = box(size=(20, 20, 4)) + (0, -6, 6)
    fog = Fog(colour=(0, 0, 0), density=0.3, height=height, scatter=0.8)
    view = View(camera=CAMERA, lights=(Light(position=(0, -0.01, 1)),), fog=fog)
    bright = rendered(wall, view, 64, (5, 5)).image[2, 2]
    assert bright == pytest.approx(0.8 / 4 * (1 - np.exp(-0.3 * 3.9)), rel=0.02)
    assert rendered(wall | roof, view, 64, (5, 5)).image[2, 2].max() < 0.1 * bright.max()


def test_coloured_glass_casts_a_coloured_shadow() -> None:
    """Of a pane of thickness 0.5: twice the loss at its sides, and what fades inside."""
    floor = material(plane(offset=-1), colour=(1, 1, 1), specular=0)
    pane = material(box(size=(4, 4, 0.5)), clear=0.9, absorb=(0, 1, 3)) + (0, 0, 1.5)
    camera = Camera(eye=(0, -4, -0.5), target=(0, 0, -1), fov=4)
    for kind in ({"kind": "sun", "position": (0, 0, 1)}, {"kind": "lamp", "position": (0, 0, 20)}):
        view = View(camera=camera, lights=(Light(**kind),), shading=Shading(bounces=0))  # type: ignore[arg-type]
        bare, shaded = (rendered(root, view, 1, (5, 5)).image[2, 2] for root in (floor, floor | pane))
        expected = (0.9 * 0.96) ** 2 * np.exp(-0.5 * np.array((0, 1, 3)))
        assert shaded / bare == pytest.approx(expected, rel=0.03)


def test_surroundings_are_seen_once_through_glass(tmp_path: Path) -> None:
    """A ball that refracts nothing hides nothing from the ground, on paths too."""
    file = tmp_path / "white.png"
    Image.new("RGB", (8, 4), (255, 255, 255)).save(file)
    lights = (Light(kind="environment", file=str(file)),)
    floor = material(plane(offset=-1), colour=(1, 1, 1), specular=0)
    ball = material(sphere(radius=0.9), clear=1, index=1)
    camera = Camera(eye=(0, -5, 1), target=(0, 0, -1), fov=3)
    for paths in ("no", "yes"):
        view = View(camera=camera, lights=lights, shading=Shading(paths=paths, bounces=12))
        assert rendered(floor | ball, view, 64, (5, 5)).image.mean() == pytest.approx(1, abs=0.03)
