"""One suite, stamped on every family of fractals and solids: what each of them promises."""

from __future__ import annotations

import re
from collections.abc import Callable
from math import pi, sqrt

import numpy as np
import pytest
from PIL import Image

from fracslice import make_mesh
from fracslice.errors import SceneError
from fracslice.fields.cpu import compile_scene
from fracslice.formulas import (
    Node,
    apollonian,
    bristorbrot,
    cells,
    cosine_bulb,
    flake,
    get,
    gyroid,
    hilbert,
    mandelbox,
    names,
    noise,
    sphere,
    voronoi,
)
from fracslice.formulas.inversions import MIDDLE, mirrors
from tests.benchmarks.formulas import pictures
from tests.examples import EXAMPLES, STRUCTURES, stamped

pytestmark = pytest.mark.once

RNG = np.random.default_rng(7)
BEFORE = {
    "menger",
    "mandelbulb",
    "sphere",
    "box",
    "torus",
    "cylinder",
    "capsule",
    "cone",
    "plane",
    "octahedron",
}
"""Shapes that have suites of their own."""

FAMILIES = {
    name: root
    for name, root in EXAMPLES.items()
    if not {node.formula.name for node in root.walk() if node.formula.kind == "shape"} & BEFORE
    or "julia" in root.values
    or root.formula.name == "noise"
}
"""Examples of all families."""

each_family = pytest.mark.parametrize("name", stamped(FAMILIES))


def field(root: Node) -> Callable[..., np.ndarray]:
    return compile_scene(root, "float64").points


def points(root: Node, count: int = 20000) -> np.ndarray:
    box = root.bounds.box
    return RNG.uniform(np.array(box.lo) * 1.1, np.array(box.hi) * 1.1, (count, 3)).T


def test_every_shape_cites_its_source() -> None:
    """Author and year, but for the solids that Euclid knew."""
    known = {"sphere", "box", "torus", "cylinder", "capsule", "cone", "plane", "octahedron"}
    shapes = [get(n) for n in names() if get(n).kind == "shape" and n not in known]
    shipped = [f for f in shapes if f.function.__module__.startswith("fracslice.")]
    assert len(shipped) > 15
    assert not [
        f.name for f in shipped if not re.search(r"[A-Z]\w+,? (1[89]|20)\d\d", f.function.__doc__ or "")
    ]


@each_family
def test_nothing_is_inside_a_ball_that_the_bound_says_is_empty(name: str) -> None:
    root = FAMILIES[name]
    values, p = field(root), points(root)
    f = values(*p)
    outside = np.flatnonzero(f > 0)[:2000]
    for reach in (0.3, 0.9, 0.999):
        step = RNG.normal(size=(3, len(outside)))
        step *= reach * f[outside] / root.bounds.lipschitz / np.linalg.norm(step, axis=0)
        assert (values(*(p[:, outside] + step)) >= -1e-9).all()


@each_family
def test_the_box_holds_the_inside(name: str) -> None:
    root = FAMILIES[name]
    lo, hi = np.array(root.bounds.box.lo), np.array(root.bounds.box.hi)
    p = RNG.uniform(lo * 2, hi * 2, (40000, 3))
    beyond = ((p < lo) | (p > hi)).any(axis=1)
    assert not (field(root)(*p[beyond].T) < 0).any()


def test_every_example_has_a_picture() -> None:
    """`formulas.families --picture yes` renders the sheet of elements.md."""
    with Image.open(pictures.SHEET) as sheet:
        assert pictures.shown(sheet) == pictures.SHOWN
        shown = sheet.convert("RGB")
    contrast = {
        name: np.ptp(np.asarray(shown.crop(pictures.tile(k)), float)[28:-20, 20:-20].mean(axis=2))
        for k, name in enumerate(pictures.SHOWN)
    }
    assert min(contrast.values()) > 60, min(contrast, key=lambda name: contrast[name])


@pytest.mark.parametrize("name", stamped(FAMILIES, STRUCTURES - {"hybrid transformed"}))
def test_its_mesh_is_closed(name: str) -> None:
    mesh = make_mesh(FAMILIES[name], resolution=32)
    assert mesh.is_watertight and mesh.volume > 0
    assert mesh.report.mesh.printable


def test_levels_too_fine_for_a_voxel_are_left_out() -> None:
    assert cells(level=9).visible(2 / 28)["level"] == 3
    assert flake(solid="octahedron", level=9).visible(1 / 9)["level"] == 3


def test_the_bristorbrot_is_bounded_where_the_usual_derivative_is_not() -> None:
    """With 2 r for the derivative, values are up to 1.49 times too large."""
    root = bristorbrot(iterations=8)
    values, p = field(root), points(root, 60000)
    f = values(*p)
    inside, near = p[:, f < 0], np.flatnonzero((f > 0) & (f < 0.1))[:300]
    gap = np.sqrt(((p[:, near, None] - inside[:, None, :]) ** 2).sum(axis=0).min(axis=1))
    assert (gap > f[near] / 2).all()


def test_the_packings_middle_ball_is_soddys() -> None:
    """Four balls in the unit ball leave room for one of radius 5 - 2 sqrt(6) between them."""
    root = apollonian(level=1, swell=1.0)
    radius = 5 - 2 * sqrt(6)
    assert pytest.approx(radius) == MIDDLE**2
    zero = np.zeros(2)
    f = field(root)(np.array([radius * 0.999, radius * 1.001]), zero, zero)
    assert f[0] < 0 < f[1]


@pytest.mark.parametrize("name", ["neovius", "iwp", "lidinoid", "frd", "gyroid"])
@pytest.mark.parametrize("thickness", [0.02, 0.06])
def test_a_wall_is_as_thick_as_asked_at_its_thinnest(name: str, thickness: float) -> None:
    """It was up to 1.35 times as thick. Along normals, from points of its faces."""
    value = field(get(name)(period=1.0, thickness=thickness))

    def slope(p: np.ndarray) -> np.ndarray:
        steps = 1e-6 * np.eye(3)[:, :, None]
        return np.stack([value(*(p + s)) - value(*(p - s)) for s in steps]) / 2e-6

    p = np.random.default_rng(1).uniform(0, 1, (3, 20000))
    for _ in range(30):
        normal = slope(p)
        p = p - np.clip(value(*p), -0.02, 0.02) * normal / np.maximum((normal**2).sum(0), 0.1)
    p = p[:, np.abs(value(*p)) < 1e-9]
    inwards = -slope(p) / np.linalg.norm(slope(p), axis=0)
    along = thickness * np.linspace(0.5, 1.1, 121)
    outside = np.array([value(*(p + s * inwards)) > 0 for s in along])
    assert 0.98 < along[outside.any(1).argmax()] / thickness < 1.06


@pytest.mark.parametrize("symbol", [(5, 3, 4), (3, 5, 3)])
def test_mirrors_of_a_honeycomb_meet_at_its_angles(symbol: tuple[int, int, int]) -> None:
    normals = np.array(mirrors(*symbol))
    products = normals @ np.diag([1, 1, 1, -1]) @ normals.T
    assert np.diag(products) == pytest.approx(1)
    assert np.diag(products, 1) == pytest.approx([-np.cos(pi / n) for n in symbol])
    assert np.diag(products, 2) == pytest.approx(0, abs=1e-12) and products[0, 3] == pytest.approx(
        0, abs=1e-12
    )


def test_a_hilbert_curve_is_one_tube_through_all_cells() -> None:
    root = hilbert(level=2, thickness=0.5)
    centres = (np.indices((4, 4, 4)).reshape(3, -1) - 1.5) / 2
    assert field(root)(*centres) == pytest.approx(-0.125)
    mesh = make_mesh(hilbert(level=1), resolution=32)
    assert mesh.report.mesh.components == 1


@pytest.mark.parametrize("kind", ["walls", "struts"])
def test_a_foam_is_that_of_its_cells_centres(kind: str) -> None:
    """A regular foam is that of a cubic lattice: walls are planes, struts are where three cells meet."""
    f = field(voronoi(kind=kind, irregularity=0.0, thickness=0.1))
    t = np.linspace(-0.3, 0.3, 7)
    on_face = f(0 * t + 1.0, t + 0.5, 0 * t + 0.5)
    assert (on_face < 0).all() if kind == "walls" else (on_face > 0).all()
    assert (f(0 * t + 1.0, 0 * t + 2.0, t + 0.5) < 0).all() and f(*np.full((3, 1), 0.5)) > 0.1


def test_noise_displaces_by_its_amplitudes_at_most() -> None:
    p = RNG.uniform(-1.6, 1.6, (3, 20000))
    for kind in ("perlin", "simplex"):
        moved = field(noise(sphere(), kind=kind, amplitude=0.1, period=0.4, octaves=3))(*p)
        far = np.abs(moved - field(sphere())(*p))
        box = np.abs(p).max(axis=0) < 1
        assert 0.05 < far[box].max() <= 0.175 + 1e-12


def test_a_graded_wall_grows_thicker() -> None:
    p = RNG.uniform(-2, 2, (3, 100))
    plain, graded = field(gyroid(thickness=0.2))(*p), field(gyroid(thickness=0.2, grade=(0.1, 0, 0.2)))(*p)
    np.testing.assert_allclose(plain - graded, 0.05 * p[0] + 0.1 * p[2], atol=1e-12)


def test_noise_refuses_escape_time_fractals() -> None:
    with pytest.raises(SceneError, match="cannot displace an escape-time fractal"):
        noise(mandelbox(iterations=3))


def test_steps_near_both_poles_are_precise() -> None:
    """Angles counted from one pole only lose all digits of the stretch near the other."""
    z = np.linspace(-1.2, 1.2, 13)
    for root in (cosine_bulb(iterations=3), get("lambda_bulb")(iterations=4)):
        on_axis, beside = (field(root)(np.full(13, e), 0 * z, z) for e in (1e-12, 1e-9))
        np.testing.assert_allclose(on_axis, beside, rtol=1e-5, atol=1e-8)
