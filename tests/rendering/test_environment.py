"""Light from a picture of the surroundings, and the sampling of lights by surface and by light."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from fracslice.errors import SceneError
from fracslice.export.images import write_image
from fracslice.formulas import Node, material, plane, sphere
from fracslice.rendering import Pass, Renderer, lighting
from fracslice.rendering.environments import Environment, LinearImage, load_picture
from fracslice.rendering.units import shade as units
from fracslice.rendering.units.camera import linear
from fracslice.rendering.units.shade import facet_density, glossy, highlight
from fracslice.scene import reads
from fracslice.scene.view import Camera, Light, Shading, View
from fracslice.work import Work
from tests.examples import stamped

pytestmark = pytest.mark.once

SIZE = 64, 32
CAMERA = Camera(eye=(0, -3, 3), fov=15)
WHITE = (1.0, 1.0, 1.0)


def fail(message: str) -> SceneError:
    return SceneError(message)


def written(path: Path, light: np.ndarray, packed: bool = False) -> str:
    """Write a Radiance picture; packed ones hold runs and literals."""
    top = light.max(2)
    exponent = np.where(top > 0, np.ceil(np.log2(np.maximum(top, 1e-30))), -128).astype(int)
    levels = np.empty((*top.shape, 4), np.uint8)
    levels[..., :3] = np.clip(light / np.ldexp(1.0, exponent)[..., None] * 256, 0, 255)
    levels[..., 3] = exponent + 128
    data = levels.tobytes()
    if packed:
        rows = []
        for row in levels:
            rows.append(bytes([2, 2, 0, len(row)]))
            for channel in row.T:
                runs = bytes([4, *channel[:4]]) if len(set(channel[:4])) > 1 else bytes([132, channel[0]])
                rows.append(runs + bytes([len(row) - 4, *channel[4:]]))
        data = b"".join(rows)
    height, width = top.shape
    path.write_bytes(b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y %d +X %d\n" % (height, width) + data)
    return str(path)


def sky(sun: float = 0.0, row: int = 5, column: int = 20) -> np.ndarray:
    """A sky of 0.5 with one bright pixel."""
    light = np.full((*SIZE[::-1], 3), 0.5, np.float32)
    light[row, column] += sun
    return light


def rendered(
    root: Node, lights: tuple[Light, ...], samples: int, camera: Camera = CAMERA, **of: object
) -> Pass:
    view = View(camera=camera, lights=lights, shading=Shading(**of))  # type: ignore[arg-type]
    *_, last = Renderer(root, view, (8, 8), Work(1), "cpu").passes(samples, tolerance=0.0)
    return last


def directions(count: int) -> tuple[np.ndarray, ...]:
    """A Fibonacci lattice on the sphere."""
    k = np.arange(count) + 0.5
    z, turn = 1 - 2 * k / count, k * np.pi * (1 + 5**0.5)
    r = np.sqrt(1 - z * z)
    return r * np.cos(turn), r * np.sin(turn), z


def tables(light: np.ndarray) -> tuple[Environment, np.ndarray, dict[str, float]]:
    """An environment, its tables as parameters, and where they begin."""
    made = Environment(LinearImage(light))
    arrays = {"light": light, "rows": made.distribution[0], "columns": made.distribution[1]}
    starts = dict(zip(arrays, np.cumsum([0, *(a.size for a in arrays.values())]), strict=False))
    return made, np.concatenate([a.ravel() for a in arrays.values()]), starts


@pytest.mark.parametrize("packed", [False, True])
def test_radiance_pictures_are_read(tmp_path: Path, packed: bool) -> None:
    light = np.random.default_rng(1).random((3, 40, 3)) * 8
    light[0, :6] = 0.25
    path = written(tmp_path / "a.hdr", light, packed)
    assert np.allclose(load_picture(path, 1000, fail).light, light, atol=8 / 256)
    assert load_picture(path, 1000, fail) is load_picture(path, 1000, fail)
    assert load_picture(path, 30, fail).light.shape == (1, 10, 3)
    assert load_picture(path, 30, fail).light.mean() == pytest.approx(light.mean(), rel=0.5)


HEAD = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n"


def test_hostile_pictures_are_one_line(tmp_path: Path, recwarn, capfd) -> None:  # type: ignore[no-untyped-def]
    (tmp_path / "none.hdr").write_bytes(HEAD + b"-Y 0 +X 0\n")
    (tmp_path / "thin.hdr").write_bytes(HEAD + b"-Y 4 +X 0\n")
    (tmp_path / "huge.hdr").write_bytes(HEAD + b"-Y 999999 +X 999999\n\2\2\0\0")
    Image.new("1", (10_000, 10_000)).save(tmp_path / "large.png")
    Image.new("1", (20_000, 10_000)).save(tmp_path / "larger.png")
    write_image(tmp_path / "cut.exr", light := sky(), light)
    data = (tmp_path / "cut.exr").read_bytes()
    (tmp_path / "cut.exr").write_bytes(data[: len(data) * 2 // 3])
    os.mkfifo(tmp_path / "pipe.png")
    os.mkfifo(tmp_path / "pipe.exr")
    for name, message in (
        ("none.hdr", "0 x 0 pixels"),
        ("thin.hdr", "0 x 4 pixels"),
        ("huge.hdr", "999999 x 999999 pixels: expected at most 67108864"),
        ("large.png", "10000 x 10000 pixels: expected at most 67108864"),
        ("larger.png", "too many pixels: expected at most 67108864"),
        ("cut.exr", "not a picture"),
        ("pipe.png", "expected a file, found a pipe"),
        ("pipe.exr", "expected a file, found a pipe"),
    ):
        with pytest.raises(SceneError, match=f"{name}.*: {message}.*; expected a .hdr"):
            load_picture(str(tmp_path / name), 1000, fail)
    assert not recwarn.list
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("size", [(1001, 1100), (37, 30_001)])
def test_bands_of_a_picture_are_halved_as_the_whole(tmp_path: Path, size: tuple[int, int]) -> None:
    light = np.random.default_rng(2).random((*size, 3), np.float32)
    write_image(tmp_path / "a.exr", light, light)
    for most in (1 << 22, 1 << 16, 50):
        read = load_picture(str(tmp_path / "a.exr"), most, fail).light
        assert np.array_equal(read, LinearImage(light).within(most))


def test_a_picture_that_cannot_be_read_is_named(tmp_path: Path) -> None:
    (tmp_path / "a.hdr").write_bytes(b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 9\n\2\2\0\t\5")
    (tmp_path / "b.exr").write_bytes(b"nothing")
    Image.new("1", (20_000, 10_000)).save(tmp_path / "d.png")
    text = '<scene version="1"><solid size="1cm"><sphere/></solid>\n<light kind="environment" {}/></scene>'
    for name, message in (
        ("a.hdr", "it ends too early"),
        ("b.exr", ""),
        ("c.hdr", "No such file or directory"),
        ("d.png", "too many pixels: expected at most 67108864 of them"),
    ):
        read = reads(text.format(f'file="{tmp_path / name}"'))
        with pytest.raises(SceneError, match=f"(?s)^scene:2: <light> .*{name}.*{message}.*; expected a .hdr"):
            Renderer(read.root, read.view, (8, 8), Work(1), "cpu")
    with pytest.raises(SceneError, match=r'scene:2: <light> file="": expected a picture of the surroundings'):
        reads(text.format(""))
    with pytest.raises(SceneError, match=r'file="a.hdr": is only for an environment'):
        Light(file="a.hdr")


def test_files_are_relative_to_the_scene(tmp_path: Path) -> None:
    from fracslice.scene import read

    scene = tmp_path / "my.xml"
    scene.write_text(
        '<scene version="1"><solid size="1cm"><sphere/></solid>'
        '<light kind="environment" file="a.hdr"/></scene>'
    )
    assert read(scene).view.lights[0].file == str(tmp_path / "a.hdr")


def test_directions_are_sampled_in_proportion_to_the_light() -> None:
    made, P, at = tables(sky(3000))
    width, height = made.picture.size
    u, v = np.random.default_rng(2).random((2, 100_000))
    own = at["rows"], at["columns"], (width, height)
    *d, density = units.towards(u, v, *own, made.steps, made.halves, 0.1, P)
    assert np.allclose(np.linalg.norm(d, axis=0), 1)
    assert np.median(abs(units.likelihood(*d, *own, 0.1, P) / density - 1)) < 1e-6
    assert np.mean(1 / density) == pytest.approx(4 * np.pi, rel=0.03), "every direction is possible"
    seen, *_ = units.surroundings(*d, at["light"], width, height, 0.1, WHITE, P)
    grid = directions(400_000)
    uniform = units.surroundings(*grid, at["light"], width, height, 0.1, WHITE, P)[0] * 4 * np.pi
    assert (seen / density).mean() == pytest.approx(uniform.mean(), rel=0.01)
    assert (seen / density).std() < 0.05 * uniform.std()


def test_reflected_rays_have_the_density_that_weights_them() -> None:
    u, v = np.random.default_rng(3).random((2, 100_000))
    ray, normal, zero = (0.6, 0.0, -0.8), (0.0, 0.0, 1.0), 0 * u
    given = (*(a + zero for a in (*ray, *normal)),)
    *e, weight, _ = glossy(*given, 0.5, u, v)
    density = facet_density(*normal, *ray, *e, 0.5)
    value, _ = highlight(*normal, *ray, *e, 0.5)
    up = e[2] > 0
    assert np.allclose(value[up] / np.pi, weight[up] * density[up], rtol=1e-6)
    grid = directions(400_000)
    possible = facet_density(*normal, *ray, *grid, 0.5).mean() * 4 * np.pi
    assert possible == pytest.approx(up.mean(), abs=0.005)


def irradiance(light: np.ndarray, rough: float | None) -> float:
    """Light of a pixel of a plane by quadrature: what a white one scatters, or what a metal reflects."""
    made, P, at = tables(light)
    d = directions(1_000_000)
    seen = units.surroundings(*d, at["light"], *made.picture.size, 0.0, WHITE, P)[0]
    factor = np.maximum(d[2], 0)
    if rough is not None:
        eye = np.array(CAMERA.eye) / np.linalg.norm(CAMERA.eye)
        factor, _ = highlight(0.0, 0.0, 1.0, *-eye, *d, rough)
    return float((seen * factor).mean() * 4)


@pytest.mark.parametrize("paths", ["no", "yes"])
@pytest.mark.parametrize("rough", stamped([None, 0.3], [0.3]))
def test_a_plane_has_the_light_of_its_surroundings(tmp_path: Path, paths: str, rough: float | None) -> None:
    """One pixel of the picture is a quarter of its light: a path of the surface alone hardly meets it."""
    light = sky(200, 8, 32)
    file = written(tmp_path / "a.hdr", light)
    look = {"metallic": 1.0, "roughness": rough} if rough else {"specular": 0.0}
    root = material(plane(offset=0), colour=WHITE, **look)
    lamp = (Light(kind="environment", file=file),)
    camera = replace(CAMERA, fov=0.5)
    last = rendered(root, lamp, 256, camera, paths=paths, bounces=1)
    expected = irradiance(light, rough)
    tolerance = 0.1 if rough and paths == "no" else 0.02
    assert last.image.mean() == pytest.approx(expected, rel=tolerance)


@pytest.mark.parametrize("shadows", ["no", "yes"])
def test_light_that_grows_with_the_height(tmp_path: Path, shadows: str) -> None:
    """Of L = a + b z, a white plane has a + 2 b / 3."""
    z = np.cos((np.arange(SIZE[1]) + 0.5) * np.pi / SIZE[1])
    light = np.broadcast_to((1 + 0.5 * z)[:, None, None], sky().shape)
    lamp = (Light(kind="environment", file=written(tmp_path / "a.hdr", light), shadows=shadows),)
    last = rendered(material(plane(offset=0), colour=WHITE, specular=0), lamp, 64, replace(CAMERA, fov=1))
    assert last.image.mean() == pytest.approx(1 + 0.5 * 2 / 3, rel=0.01)


@pytest.mark.parametrize(
    ("paths", "shadows"), stamped([("no", "yes"), ("yes", "yes"), ("yes", "no")], [("yes", "yes")])
)
def test_a_white_ball_vanishes_in_a_white_picture(tmp_path: Path, paths: str, shadows: str) -> None:
    file = written(tmp_path / "a.hdr", 0 * sky() + 0.5)
    lamp = (Light(kind="environment", file=file, strength=2, shadows=shadows),)
    ball = material(sphere(), colour=WHITE, specular=0)
    assert rendered(ball, lamp, 256, paths=paths, bounces=2).image.mean() == pytest.approx(1, abs=0.005)


def test_a_picture_is_shown_where_it_is_and_turns(tmp_path: Path) -> None:
    """The camera of 360 degrees shows the picture; a quarter turn moves it by a quarter."""
    light = sky(9, 10, 40)
    camera = Camera(eye=(0, -9, 0), kind="equirectangular")
    shown = []
    for rotation in (0, 90):
        lamp = Light(kind="environment", file=written(tmp_path / "a.hdr", light), rotation=rotation)
        view = View(camera=camera, lights=(lamp,))
        *_, last = Renderer(sphere(radius=1e-6), view, SIZE, Work(1), "cpu").passes(1)
        shown.append(last.image)
    assert np.allclose(shown[0], light, atol=0.06)
    assert np.allclose(shown[1], np.roll(light, -SIZE[0] // 4, 1), atol=0.06), "anticlockwise from above"


def test_a_metal_reflects_in_its_own_colour_under_a_blue_sky() -> None:
    """The sky's colour once took the place of the metal's."""
    blue = (0.1, 0.2, 0.9)
    lamp = (Light(kind="sky", colour=blue, horizon=blue, ground=blue),)
    metal = material(plane(offset=0), colour=(1, 0.2, 0.1), metallic=1, roughness=0.3)
    red, _, blue_ = rendered(metal, lamp, 16, paths="no").image.mean((0, 1))
    assert red == pytest.approx(linear(blue)[0], rel=0.03)
    assert blue_ < 2 * red


def test_a_small_sun_on_a_shiny_plane_is_less_noisy_and_as_bright_as_by_the_light_alone(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    sun = (Light(kind="sun", position=(0, 3, 3), size=20, strength=0.03),)
    shiny = material(plane(offset=0), colour=WHITE, metallic=1, roughness=0.12)
    camera = replace(CAMERA, fov=0.5)
    both = rendered(shiny, sun, 256, camera, paths="yes", bounces=1)
    monkeypatch.setattr(lighting, "seen_as_disc", lambda _: False)
    alone = rendered(shiny, sun, 256, camera, paths="yes", bounces=1)
    assert both.image.mean() == pytest.approx(alone.image.mean(), rel=0.05)
    assert both.error < 0.6 * alone.error, (both.error, alone.error)
