"""One suite, stamped on every family of fractals and solids: what each of them promises."""

from __future__ import annotations

import re
from collections.abc import Callable
from math import pi, sqrt

import numpy as np
import pytest

from fracslice import make_mesh
from fracslice.errors import SceneError
from fracslice.formulas import (
    Node,
    apollonian,
    bristorbrot,
    cells,
    cosine_bulb,
    flake,
    frd,
    gear,
    get,
    gyroid,
    hilbert,
    honeycomb,
    iwp,
    jerusalem,
    koch,
    mandelbox,
    menger,
    names,
    neovius,
    noise,
    prism,
    quaternion_mandelbrot,
    quaternion_power,
    sphere,
    struts,
    superquadric,
    tetrabrot,
    thread,
    tree,
    voronoi,
)
from fracslice.formulas.inversions import MIDDLE, mirrors
from fracslice.kernel import compile_scene
from tests.examples import EXAMPLES

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

each_family = pytest.mark.parametrize("name", FAMILIES)


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


@each_family
def test_its_mesh_is_closed(name: str) -> None:
    mesh = make_mesh(FAMILIES[name], resolution=48)
    assert mesh.is_watertight and mesh.volume > 0
    assert mesh.report.mesh.printable


SYMMETRIES = {
    "turn": lambda x, y, z: (y, z, x),
    "swap": lambda x, y, z: (y, x, z),
    "flip": lambda x, y, z: (-x, y, z),
    "flip y": lambda x, y, z: (x, -y, z),
    "flip z": lambda x, y, z: (x, y, -z),
    "inverse": lambda x, y, z: (-x, -y, -z),
    "half turn": lambda x, y, z: (-x, -y, z),
}
SYMMETRIC: list[tuple[Node, str]] = [
    *[(flake(solid="tetrahedron"), s) for s in ("turn", "swap", "half turn")],
    *[(flake(solid="octahedron"), s) for s in ("turn", "swap", "flip")],
    *[(flake(solid=s, level=2), t) for s in ("dodecahedron", "icosahedron") for t in ("turn", "flip")],
    *[(cells(keep=(1, 3)), s) for s in ("turn", "swap", "flip")],
    *[(mandelbox(iterations=6), s) for s in ("turn", "swap", "flip")],
    (quaternion_mandelbrot(iterations=8), "flip z"),
    (prism(sides=4), "swap"),
    *[(superquadric(), s) for s in ("turn", "swap", "flip")],
    *[(f(), s) for f in (neovius, iwp, frd) for s in ("turn", "swap", "flip")],
    *[
        (get(n)(), "turn")
        for n in ("gyroid", "lidinoid", "schwarz_d", "schwarz_p", "fischer_koch_s", "split_p")
    ],
    *[
        (struts(kind=k), s)
        for k in ("cubic", "bcc", "fcc", "octet", "kelvin")
        for s in ("turn", "swap", "flip")
    ],
    *[(jerusalem(level=2), s) for s in ("turn", "swap", "flip")],
    *[(honeycomb(kind=k), s) for k in ("534", "353") for s in ("flip", "inverse")],
    *[(honeycomb(kind="435"), s) for s in ("turn", "swap", "flip")],
    *[(gear(teeth=12), s) for s in ("swap", "flip", "flip z")],
    *[(tree(branches=4), s) for s in ("swap", "flip")],
    (koch(), "flip y"),
    (tetrabrot(iterations=8), "flip z"),
    *[(quaternion_power(power=n, iterations=6), "flip z") for n in (3, 4)],
    (quaternion_power(power=3, iterations=6), "flip"),
    *[(cosine_bulb(iterations=3), s) for s in ("half turn", "flip z")],
    *[(get(n)(iterations=5), "swap") for n in ("kifs_tetrahedron", "kifs_octahedron")],
    *[(get(n)(iterations=4), s) for n in ("kifs_dodecahedron", "kifs_icosahedron") for s in ("turn", "flip")],
]


@pytest.mark.parametrize(("root", "symmetry"), SYMMETRIC)
def test_symmetries(root: Node, symmetry: str) -> None:
    p = RNG.uniform(-1, 1, (3, 4000))
    values = field(root)
    np.testing.assert_allclose(values(*SYMMETRIES[symmetry](*p)), values(*p), atol=1e-9)


GOLDEN, CUBE = (1 + sqrt(5)) / 2, (sqrt(2) - 1) ** 3
CORE = 0.5 - 5 / 16 * sqrt(3) * 0.3
FLANK = (0.25 + 0.5 * CORE + CORE**2) / 3
"""Radius of the thread's roots, and mean square of the radius along a flank."""
VOLUMES: list[tuple[Node, float]] = [
    (flake(solid="tetrahedron", level=2), 8 / (9 * sqrt(3)) / 4),
    (flake(solid="octahedron", level=2), 4 / 3 * (3 / 4) ** 2),
    (flake(solid="dodecahedron", level=1), 2.785163863 * 20 / (2 + GOLDEN) ** 3),
    (flake(solid="icosahedron", level=2), 2.536150710 * (12 / (1 + GOLDEN) ** 3) ** 2),
    *[
        (cells(keep=k, level=2), 8 * (n / 27) ** 2)
        for k, n in (((0,), 8), ((2, 3), 7), ((1, 2), 18), ((0, 2), 14))
    ],
    (prism(sides=5, radius=1, height=0.5), 2.5 * np.sin(2 * pi / 5) * 0.5),
    (superquadric(size=(1, 2, 0.5), exponent=2), pi / 6),
    (koch(level=3, height=0.5), 0.5 * 3 * sqrt(3) / 4 * (1 + 0.6 * (1 - (4 / 9) ** 3))),
    (jerusalem(level=1), 8 * (8 * CUBE + 12 * CUBE**2)),
    (jerusalem(level=2), 8 * (8 * CUBE * (8 * CUBE + 12 * CUBE**2) + 12 * CUBE**2)),
    (thread(radius=0.5, pitch=0.3, height=0.9), 0.9 * pi * (0.125 * 0.25 + 0.25 * CORE**2 + 0.625 * FLANK)),
]


@pytest.mark.parametrize(("root", "volume"), VOLUMES)
def test_volumes(root: Node, volume: float) -> None:
    """By 400,000 random points, within four standard deviations."""
    box, count = root.bounds.box, 400_000
    p = RNG.uniform(box.lo, box.hi, (count, 3)).T
    whole, share = float(np.prod(box.size)), float((field(root)(*p) < 0).mean())
    assert share * whole == pytest.approx(volume, abs=4 * whole * sqrt(share * (1 - share) / count))


def test_cells_at_corners_and_edges_are_the_menger_sponge() -> None:
    p = RNG.uniform(-1.1, 1.1, (3, 20000))
    sponge, kept = (field(root)(*p) for root in (menger(level=3), cells(keep=(0, 1), level=3)))
    assert ((sponge < 0) == (kept < 0)).all()


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
    assert pytest.approx(5 - 2 * sqrt(6)) == MIDDLE
    zero = np.zeros(2)
    f = field(root)(np.array([MIDDLE * 0.999, MIDDLE * 1.001]), zero, zero)
    assert f[0] < 0 < f[1]


@pytest.mark.parametrize("symbol", [(5, 3, 4), (3, 5, 3)])
def test_mirrors_of_a_honeycomb_meet_at_its_angles(symbol: tuple[int, int, int]) -> None:
    normals = np.array(mirrors(*symbol))
    products = normals @ np.diag([1, 1, 1, -1]) @ normals.T
    assert np.diag(products) == pytest.approx(1)
    assert np.diag(products, 1) == pytest.approx([-np.cos(pi / n) for n in symbol])
    assert np.diag(products, 2) == pytest.approx(0, abs=1e-12) and products[0, 3] == pytest.approx(
        0, abs=1e-12
    )


def test_the_tetrabrot_is_two_mandelbrot_sets() -> None:
    x, y, z = RNG.uniform(-2, 2, (3, 4000))
    inside = np.ones(4000, bool)
    for c in (x + 1j * (y - z), x + 1j * (y + z)):
        w = c
        for _ in range(9):
            w = np.where(abs(w) < 1e6, w * w + c, w)
        inside &= abs(w) <= 2
    assert inside.sum() > 20
    assert ((field(tetrabrot(iterations=9))(x, y, z) < 0) == inside).all()


def test_the_square_of_a_quaternion_is_its_second_power() -> None:
    p = RNG.uniform(-1.5, 1.5, (3, 4000))
    a, b = (
        field(root)(*p)
        for root in (quaternion_power(power=2, iterations=8), quaternion_mandelbrot(iterations=8))
    )
    np.testing.assert_allclose(a, b, rtol=1e-9, atol=1e-12)


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
