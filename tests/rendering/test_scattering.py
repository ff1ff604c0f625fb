"""Scattered and reflected light: energy and reciprocity."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fracslice.formulas import Node, box, difference, mandelbulb, material, plane, sphere, transform, union
from fracslice.rendering import Renderer, materials
from fracslice.rendering.materials import glowing_bodies, reflected_shares
from fracslice.rendering.units.camera import linear
from fracslice.rendering.units.shade import glossy, highlight, lost, varied
from fracslice.scene.view import Camera, Light, Shading, View
from fracslice.work import Work
from tests.examples import stamped

pytestmark = pytest.mark.once

WHITE = (1.0, 1.0, 1.0)
FURNACE = (Light(kind="sky", colour=WHITE, horizon=WHITE, ground=WHITE),)
CAMERA = Camera(eye=(0, -4, 0), fov=20)
NORMAL = (0.0, 0.0, 1.0)
SUN = (Light(position=(1, -2, 2), shadows="no"),)


def directions(count: int, seed: int) -> np.ndarray:
    """Random unit vectors of the upper half space, [3, count]."""
    d = np.random.default_rng(seed).normal(size=(3, count))
    d[2] = abs(d[2]) + 0.05
    return np.asarray(d / np.linalg.norm(d, axis=0))


def albedo(rough: float, sine: float) -> float:
    """Share of the light that is reflected towards an angle, by quadrature over the other one."""
    z, turn = np.meshgrid((np.arange(4000) + 0.5) / 4000, (np.arange(200) + 0.5) / 200 * 2 * np.pi)
    r = np.sqrt(1 - z * z)
    ray = (sine, 0.0, -np.sqrt(1 - sine * sine))
    value, _ = highlight(*NORMAL, *ray, r * np.cos(turn), r * np.sin(turn), z, rough)
    return float(value.mean() * 2 * np.pi / np.pi)


@pytest.mark.parametrize("rough", [0.2, 0.5, 1.0])
def test_reflection_is_reciprocal(rough: float) -> None:
    light, eye = directions(500, 1), directions(500, 2)
    there, back = (highlight(*NORMAL, *(-v), *to, rough)[0] / to[2] for to, v in ((light, eye), (eye, light)))
    assert np.allclose(there, back, rtol=1e-9)


@pytest.mark.parametrize(("rough", "sine"), [(0.3, 0.0), (0.5, 0.6), (1.0, 0.9)])
def test_sampled_reflection_has_the_energy_of_its_distribution(rough: float, sine: float) -> None:
    u, v = np.random.default_rng(3).random((2, 200_000))
    ray = (sine + 0 * u, 0 * u, -np.sqrt(1 - sine * sine) + 0 * u)
    normal = (0 * u, 0 * u, 1 + 0 * u)
    *_, weight, _ = glossy(*ray, *normal, rough, u, v)
    assert weight.max() <= 1 + 1e-9
    assert weight.mean() == pytest.approx(albedo(rough, sine), abs=0.005)


def seen(
    root: Node, shading: Shading, samples: int = 64, camera: Camera = CAMERA, **view: object
) -> np.ndarray:
    """Light of the pixels that the object fills."""
    whole = View(camera=camera, shading=shading, **{"lights": FURNACE, **view})  # type: ignore[arg-type]
    *_, last = Renderer(root, whole, (16, 16), Work(1), "cpu").passes(samples, tolerance=0.0)
    return np.asarray(last.image[last.alpha == 1])


@pytest.mark.parametrize("rough", stamped([0.0, 0.5, 1.0], [0.5]))
@pytest.mark.parametrize("paths", ["no", "yes"])
def test_metal_in_a_white_furnace_returns_what_it_receives(rough: float, paths: str) -> None:
    """Between rough facets light is reflected again: one reflection returned 0.33 of it at roughness 1."""
    ball = material(sphere(), colour=WHITE, metallic=1, roughness=rough, specular=0)
    light = seen(ball, Shading(paths=paths, bounces=1), 512)
    assert light.mean() == pytest.approx(1, abs=0.005)
    middle = seen(ball, Shading(paths=paths, bounces=1), 512, camera=replace(CAMERA, fov=2))
    assert middle.mean() == pytest.approx(1, abs=0.005)


@pytest.mark.parametrize(("rough", "cosine"), [(0.5, 0.8), (0.7, 0.3), (1.0, 0.5), (1.0, 1.0)])
def test_light_that_one_reflection_loses_is_reflected_again(rough: float, cosine: float) -> None:
    again = 1 + lost(np.float64(cosine), rough, 0.0, reflected_shares().ravel())
    assert albedo(rough, np.sqrt(1 - cosine**2)) * again == pytest.approx(1, abs=0.01)
    assert lost(np.float64(cosine), 0.0, 0.0, reflected_shares().ravel()) == 0


@pytest.mark.parametrize("reflect", [0.0, 0.3])
def test_a_white_ball_vanishes_in_a_white_furnace(reflect: float) -> None:
    """What it does not reflect, it scatters."""
    ball = material(sphere(), colour=WHITE, reflect=reflect, specular=0)
    assert np.allclose(seen(ball, Shading(paths="yes", bounces=1)).mean(0), 1, atol=0.01)


def test_light_between_closed_walls_is_the_sum_of_all_reflections() -> None:
    """Glowing walls of albedo a: L = e (1 + a + a^2 + ...)."""
    albedo_, glow = linear((0.6,))[0], 0.5
    walls = material(
        difference(box(size=(4, 4, 4)), box(size=(3, 3, 3))), colour=(0.6, 0.6, 0.6), glow=glow, specular=0
    )
    camera = replace(CAMERA, eye=(0.3, -0.4, 0.2), target=(0, 1, 0.1), fov=80)
    light = seen(walls, Shading(paths="yes", bounces=12), 256, camera, lights=(Light(strength=0),))
    assert light.mean() == pytest.approx(glow * albedo_ / (1 - albedo_), rel=0.01)


def test_a_glowing_surface_lights_the_others_on_paths_only() -> None:
    lamp = material(box(size=(2, 0.1, 2)), glow=3, colour=WHITE)
    scene = lamp | material(sphere(radius=0.8), specular=0) + (0, 2, 0)
    camera = replace(CAMERA, eye=(0, 6, 2), target=(0, 2, 0))
    lights = (Light(strength=0),)
    dark, lit = (
        seen(scene, Shading(paths=paths), 16, camera, lights=lights).mean() for paths in ("no", "yes")
    )
    assert lit > dark + 0.01


BULB = material(sphere(radius=0.05), glow=50, colour=WHITE, specular=0) + (0, 0, 1)
FLOOR = material(box(size=(6, 6, 0.2)), colour=(0.5, 0.5, 0.5), specular=0) + (0, 0, -0.1)


def test_a_small_glowing_body_lights_a_floor_with_little_noise() -> None:
    """Irradiance of a ball: pi L (r / d)^2 cos. Scattered rays alone would hardly ever meet it."""
    camera = Camera(eye=(0, -1.5, 0.8), target=(0, 0, 0), fov=2)
    dark = Light(kind="sky", strength=0)  # else rays that continue meet the film's background
    whole = View(camera=camera, shading=Shading(paths="yes", bounces=1), lights=(dark,))
    *_, last = Renderer(BULB | FLOOR, whole, (24, 24), Work(1), "cpu").passes(8, tolerance=0.0)
    light = last.image[..., 0] / linear((0.5,))[0]
    expected = 50 * 0.05**2
    assert light.mean() == pytest.approx(expected, rel=0.02)
    assert light.std() < 0.3 * expected


@pytest.mark.parametrize("rough", stamped([0.0, 0.5], [0.5]))
def test_rays_to_glowing_bodies_change_no_mean(rough: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """Beside a sun and a sky, on a floor that also reflects; bodies in a row, one of them turned."""
    turned = transform(box(size=(0.6, 0.05, 0.3)), translate=(1, 0.5, 0.6), rotate=(1, 1, 0, 40))
    lamp = material(turned, glow=3, colour=(1, 0.6, 0.3), specular=0)
    floor = material(FLOOR, colour=(0.5, 0.5, 0.5), reflect=0.3, roughness=rough, specular=0)
    lights = (Light(position=(1, -2, 2), size=20), Light(kind="sky", strength=0.5))
    camera = Camera(eye=(0, -3, 1.5), target=(0.3, 0, 0), fov=25)
    root = lamp | material(sphere(radius=0.3), glow=2, colour=WHITE) + (-0.6, 0, 0.5) | floor
    shading, means = Shading(paths="yes", bounces=2), []
    for bodies in (glowing_bodies, lambda _: []):
        monkeypatch.setattr(materials, "glowing_bodies", bodies)
        means.append(seen(root, shading, 512, camera, lights=lights).mean(0))
    assert means[0] == pytest.approx(means[1], rel=0.01)


def test_a_sun_in_rough_metal_leaves_no_sparks_on_a_floor() -> None:
    """A scattered ray hardly ever meets its sharp reflection: single pixels had 8 times the floor's light."""
    metal = material(sphere(radius=0.6), colour=WHITE, metallic=1, roughness=0.15) + (0, 0, 0.9)
    camera = Camera(eye=(0, -3, 2), target=(-0.6, -0.9, 0), fov=12)
    lights, shading = (Light(position=(-1, -2, 2.5), size=8),), Shading(paths="yes", bounces=1)
    light = seen(metal | FLOOR, shading, 256, camera, lights=lights).mean(1)
    assert light.max() < 1.6 * np.median(light)


def test_bodies_have_boxes_where_they_are() -> None:
    lamp = material(sphere(radius=0.5), glow=2, colour=WHITE)
    (body,) = glowing_bodies(transform(lamp | box(), translate=(3, 0, 0)) | FLOOR)
    assert body[:6] == pytest.approx((3, 0, 0, 0.5, 0.5, 0.5))
    assert len(glowing_bodies(union(*(lamp + (3 * k, 0, 0) for k in range(20))))) == 1
    assert glowing_bodies(material(plane(), glow=1)) == []


@pytest.mark.parametrize("paths", ["no", "yes"])
def test_a_lacquered_ball_vanishes_in_a_white_furnace(paths: str) -> None:
    """What the lacquer does not reflect, the colour under it scatters."""
    ball = material(sphere(), colour=WHITE, coat=1, specular=0)
    assert np.allclose(seen(ball, Shading(paths=paths, bounces=2)).mean(0), 1, atol=0.01)


def test_a_lacquer_mirrors_the_sky_over_a_black_surface() -> None:
    black = material(sphere(), colour=(0, 0, 0), coat=1, specular=0)
    middle = seen(black, Shading(bounces=1), 256, replace(CAMERA, fov=2)).mean()
    assert middle == pytest.approx(0.04, abs=0.01)
    sun = (Light(position=CAMERA.eye, strength=1, shadows="no"),)
    shining = seen(black, Shading(bounces=1), 16, replace(CAMERA, fov=2), lights=sun).mean()
    assert shining > 0.3, "the sun's reflection"


def test_roughness_follows_the_orbit() -> None:
    tone = np.array([0.0, 0.25, 0.5, 1.0, 1.75])
    assert varied(0.2, 0.6, tone) == pytest.approx([0.2, 0.5, 0.8, 0.2, 0.5])
    assert (varied(0.9, 0.6, tone) <= 1).all() and (varied(0.1, -0.6, tone) >= 0).all()
    bulb = mandelbulb(iterations=4)
    shading, camera = Shading(bounces=1), Camera(eye=(2, -2, 1), fov=60)
    polished, varying = (
        seen(material(bulb, metallic=1, roughness=0.2, vary=v, shift=0.2), shading, 4, camera, lights=SUN)
        for v in (0, 0.7)
    )
    assert abs(polished - varying).mean() > 0.01
