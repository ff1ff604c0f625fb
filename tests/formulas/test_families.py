"""One suite, stamped on every family of fractals and solids: what each of them promises."""

from __future__ import annotations

import re
from collections.abc import Callable
from math import pi, sqrt

import numpy as np
import pytest

from fracslice import make_mesh
from fracslice.formulas import (
    Node,
    bristorbrot,
    cells,
    flake,
    get,
    iwp,
    mandelbox,
    menger,
    names,
    neovius,
    prism,
    quaternion_mandelbrot,
    superquadric,
)
from fracslice.kernel import compile_scene
from tests.examples import EXAMPLES

RNG = np.random.default_rng(7)
FAMILIES = {
    name: root
    for name, root in EXAMPLES.items()
    if {"flake", "cells", "prism", "superquadric"} & {root.formula.name}
    or name.endswith(" wall")
    or "julia" in root.values
}
"""Examples of all families; the Mandelbulb's, which have suites of their own, too."""

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
    mesh = make_mesh(FAMILIES[name], resolution=96)
    assert mesh.is_watertight and mesh.volume > 0
    assert mesh.report.mesh.printable


SYMMETRIES = {
    "turn": lambda x, y, z: (y, z, x),
    "swap": lambda x, y, z: (y, x, z),
    "flip": lambda x, y, z: (-x, y, z),
    "flip z": lambda x, y, z: (x, y, -z),
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
    *[(f(), s) for f in (neovius, iwp) for s in ("turn", "swap", "flip")],
    *[(get(n)(), "turn") for n in ("gyroid", "lidinoid", "schwarz_d", "schwarz_p")],
]


@pytest.mark.parametrize(("root", "symmetry"), SYMMETRIC)
def test_symmetries(root: Node, symmetry: str) -> None:
    p = RNG.uniform(-1, 1, (3, 4000))
    values = field(root)
    np.testing.assert_allclose(values(*SYMMETRIES[symmetry](*p)), values(*p), atol=1e-9)


GOLDEN = (1 + sqrt(5)) / 2
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
