"""Hybrids: rounds of the steps of several escape-time fractals."""

from __future__ import annotations

import numpy as np
import pytest

from fracslice.errors import SceneError
from fracslice.fields.cpu import compile_scene
from fracslice.fields.devices import reference
from fracslice.fields.linker import link
from fracslice.fields.orbits import growth_of
from fracslice.formulas import (
    Node,
    bristorbrot,
    burning_ship,
    julia,
    mandelbox,
    mandelbulb,
    orbit,
    quaternion_mandelbrot,
    sphere,
    transform,
)
from fracslice.scene import reads, scene, to_xml
from tests.examples import stamped
from tests.stability.bounds import verdict
from tests.stability.random_hybrids import lost, random_hybrid

pytestmark = pytest.mark.once

RNG = np.random.default_rng(3)
SCENE = """<scene version="1">
  <solid size="40mm">
    <orbit iterations="3">
      {}
      <mandelbox scale="-1.5"/>
    </orbit>
  </solid>
</scene>"""


def inside(root: Node, points: np.ndarray) -> np.ndarray:
    result: np.ndarray = reference(root)(*points) < 0
    return result


@pytest.mark.parametrize(
    "one",
    [
        mandelbulb(),
        mandelbulb(power=3, julia=(0.3, 0.4, -0.5)),
        mandelbulb(power=2.5),
        bristorbrot(),
        julia(),
        mandelbox(scale=-1.5),
    ],
)
def test_an_orbit_of_one_fractal_is_that_fractal(one: Node) -> None:
    """By hand or by its step; radii of escape differ, so a few points of the surface do."""
    points = RNG.uniform(-1.3, 1.3, (3, 8000))
    a, b = inside(one.changed(iterations=8), points), inside(orbit(one, iterations=8), points)
    assert a.sum() > 20
    assert (a != b).sum() <= 0.02 * a.sum()


def test_a_transform_around_a_step_is_that_of_its_coordinates() -> None:
    moves = {"translate": (0.2, -0.1, 0.3), "rotate": (1.0, 2.0, 0.5, 50.0), "scale": 0.8}
    points = RNG.uniform(-1.5, 1.5, (3, 8000))
    a = inside(transform(orbit(mandelbulb(), iterations=7), **moves), points)
    b = inside(orbit(transform(mandelbulb(), **moves), iterations=7), points)
    assert a.sum() > 100
    assert (a != b).sum() <= 0.02 * a.sum()


def test_rounds_take_every_step_in_turn() -> None:
    root = orbit(quaternion_mandelbrot(repeat=2), mandelbulb(power=2, julia=(0.1, 0.2, 0)), iterations=2)
    points = RNG.uniform(-1, 1, (3, 4000))
    x, y, z = w = points
    for _ in range(2):
        for _ in range(2):
            w = np.array([x * x - y * y - z * z, 2 * x * y, 2 * x * z]) + points
            x, y, z = w
        r, theta, phi = np.sqrt((w**2).sum(0)), np.arctan2(np.hypot(x, y), z), np.arctan2(y, x)
        s = r * r * np.sin(2 * theta)
        x, y, z = s * np.cos(2 * phi) + 0.1, s * np.sin(2 * phi) + 0.2, r * r * np.cos(2 * theta)
    result = np.sqrt(x * x + y * y + z * z) <= growth_of(root).escape
    assert result.sum() > 50
    assert (result == inside(root, points)).all()


def test_numbers_compile_nothing() -> None:
    a, b = (orbit(transform(bristorbrot(), scale=s), mandelbox(scale=-s), iterations=2) for s in (1.3, 1.5))
    assert link(a).program == link(b).program


def test_a_scene_is_the_expression() -> None:
    read = reads(SCENE.format('<transform scale="0.9"><mandelbulb repeat="2" power="6"/></transform>'))
    made = orbit(transform(mandelbulb(power=6, repeat=2), scale=0.9), mandelbox(scale=-1.5), iterations=3)
    assert read.root == made
    assert reads(to_xml(read)) == read
    changed = read.with_values(["mandelbulb.power=5", "orbit.iterations=2"]).root
    assert changed.children[0].children[0]["power"] == 5 and changed["iterations"] == 2


@pytest.mark.parametrize(
    ("step", "message"),
    [
        ("<sphere/>", "scene:4: <sphere> has no step: expected an escape-time fractal inside <orbit>"),
        ('<mandelbulb iterations="4"/>', "scene:4: <mandelbulb> iterations=4: expected none inside <orbit>"),
        ('<mandelbulb bailout="4"/>', "scene:4: <mandelbulb> bailout=4.0: expected none inside <orbit>"),
        ('<julia c="0 0 0 1"/>', "scene:4: <julia> c: expected a last number of 0 inside <orbit>"),
        ('<mandelbox scale="0.5"/>', "scene:3: <orbit> has orbits that do not escape"),
    ],
)
def test_a_mistake_is_one_line_with_its_place(step: str, message: str) -> None:
    with pytest.raises(SceneError) as caught:
        reads(SCENE.format(step))
    assert str(caught.value).startswith(message) and "\n" not in str(caught.value)


def test_only_a_step_is_repeated() -> None:
    with pytest.raises(SceneError, match=r"<mandelbulb> repeat=2: expected it inside an <orbit>"):
        scene(mandelbulb(repeat=2), size="4cm")
    with pytest.raises(SceneError, match=r"<orbit> takes at least 1 element inside it, found 0"):
        orbit(iterations=3)
    with pytest.raises(SceneError, match=r"<sphere> has no step"):
        orbit(sphere())


@pytest.mark.parametrize("seed", stamped(range(20), [1]))
def test_a_random_hybrid_loses_no_inside_sample(seed: int) -> None:
    """`make nightly` tries hundreds."""
    assert lost(random_hybrid(seed), 64) == 0


def test_the_bound_of_a_hybrid_holds() -> None:
    """Folds leave critical points outside, where the potential is up to eight times the distance."""
    root = orbit(mandelbox(scale=1.0, inner=1.0), burning_ship(power=12, repeat=2), iterations=4)
    result = verdict(root, 20_000)
    assert result.points > 5000 and result.violations == 0


@pytest.mark.parametrize("seed", stamped([5, 12], [12]))
def test_proofs_lose_no_inside_sample(seed: int) -> None:
    assert lost(random_hybrid(seed), 48, proved=True) == 0


def test_automatic_rounds_are_resolved() -> None:
    from fracslice.fields.depth import resolve_depths

    root = resolve_depths(orbit(mandelbulb(), mandelbox(scale=-1.5)), 0.05)
    assert 1 < root["iterations"] < 10
    assert (compile_scene(root).points(*RNG.uniform(-1, 1, (3, 2000))) < 0).any()
