"""Radii of escape: proved by intervals, enlarged until they are, and the bound that follows from them."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from fracslice.fields import growth as growth_module
from fracslice.fields.growth import (
    _prove_growth,
    compose_steps,
    constant_stretch,
    escape_radius,
    image,
    least_size,
    norm,
    numbers,
)
from fracslice.fields.maps import modulo
from fracslice.fields.orbit_code import Code
from fracslice.fields.orbits import growth_of, orbit_select, steps
from fracslice.formulas import (
    Node,
    abox,
    benesi,
    burning_ship,
    cosine_bulb,
    kifs_octahedron,
    kifs_tetrahedron,
    lambda_bulb,
    mandelbox,
    mandelbulb,
    orbit,
    quaternion_mandelbrot,
    quaternion_power,
    sphere,
    transform,
    union,
)
from fracslice.scene.layout import formulas
from tests.stability.bounds import verdict
from tests.stability.random_hybrids import random_hybrid

pytestmark = pytest.mark.once

ORBITS = [f for f in formulas() if f.hooks.get("select") is orbit_select and f.name != "orbit"]
TURNED = transform(abox(angle=20), rotate=(1, 2, 3, 40), scale=0.9, translate=(0.1, 0.2, 0))
RNG = np.random.default_rng(5)


@pytest.mark.parametrize("formula", ORBITS, ids=lambda f: f.name)
def test_the_radius_of_every_orbit_is_proved(formula: Any) -> None:
    assert growth_of(formula()).proved


@pytest.mark.parametrize(
    ("root", "radius"),
    [
        (quaternion_mandelbrot(), 2.0),
        (quaternion_power(power=3), 2**0.5),
        (lambda_bulb(power=12), (1 + 1 / 1.1) ** (1 / 11)),
        (lambda_bulb(power=5, factor=3.0), (1 + 1 / 3) ** (1 / 4)),
    ],
)
def test_a_radius_that_is_too_small_grows(root: Node, radius: float) -> None:
    """Known radii: |w|^n - |w| = |w|, and factor (|w|^n - |w|) = |w|."""
    code, given = steps(root, alone=False)
    bound = replace(growth_of(root), escapes=(0.9 * radius,), proved=False)
    fixed = code[0].stage.is_fixed
    result = _prove_growth(code, bound, given, 0.0 if fixed else bound.escape)
    assert result.proved and radius < result.escape < 1.5 * radius


def test_a_radius_that_cannot_be_proved_is_the_sampled_one() -> None:
    """A constant of the size of the solid leads back: 1.2 |w| - |c| < |w|."""
    assert not growth_of(mandelbox(scale=1.2)).proved


@pytest.mark.parametrize(
    ("root", "radius"),
    [
        (orbit(lambda_bulb(power=12, factor=2.0, repeat=2), iterations=1), 1.0),
        (lambda_bulb(power=13, factor=2.0, iterations=2), (1 + 1 / 2) ** (1 / 12)),
    ],
)
def test_no_orbit_comes_back_between_the_samples(root: Node, radius: float) -> None:
    """Few directions and radii missed the fixed points of high powers: the radius was 0.0129, and the box."""
    assert radius < growth_of(root).escape < 1.5 * radius
    assert max(root.bounds.box.hi) > 0.95


@pytest.mark.parametrize(
    "root",
    [
        orbit(burning_ship(power=15), iterations=2),
        pytest.param(
            orbit(benesi(repeat=2), iterations=2, julia=(-0.18, -0.29, 0.25)), marks=pytest.mark.nightly
        ),
        orbit(transform(mandelbulb(power=26), rotate=(1, 2, 3, 7), scale=0.9, translate=(-0.1, 0.04, 0.1))),
    ],
)
def test_known_lengths_prove_the_radius_of_hybrids(root: Node) -> None:
    """|w^n| is |w|^n: by intervals of products alone, none of these is proved."""
    assert growth_of(root).proved


@pytest.mark.parametrize("seed", [1, 40, 58])
def test_denser_samples_find_no_orbit_that_comes_back(seed: int) -> None:
    """From beyond the radius at the end of a round, for constants as long as points of the solid."""
    root = random_hybrid(seed)
    bound, rng = growth_of(root), np.random.default_rng(seed)
    code, given = steps(root)
    whole = compose_steps([image(code, k, given) for k in range(len(code))])
    w, c = rng.normal(size=(2, 3, 1 << 15))
    w *= bound.escape * rng.uniform(1, 3, 1 << 15) / np.linalg.norm(w, axis=0)
    c *= max(root.bounds.box.hi) * rng.uniform(0, 1, 1 << 15) / np.linalg.norm(c, axis=0)
    assert (norm(whole(w, c)) > bound.surface).all()


@pytest.mark.parametrize(
    "root",
    [
        orbit(mandelbox(scale=-1.5)),
        orbit(cosine_bulb(power=5)),
        orbit(lambda_bulb(power=4.5)),
        pytest.param(orbit(benesi(), TURNED), marks=pytest.mark.nightly),
        pytest.param(
            orbit(quaternion_mandelbrot(julia=(0.1, 0.2, 0.3)), TURNED, kifs_octahedron()),
            marks=pytest.mark.nightly,
        ),
    ],
)
def test_the_least_size_is_a_lower_bound(root: Node) -> None:
    """Of |w| at the end of a round, for points of cells and constants of a size."""
    code, given = steps(root)
    stops = [own[0] for own in numbers(growth_of(root))]
    half, size, tight = 0.02, 1.5, 0
    centres = RNG.uniform(-2, 2, (3, 300))
    centres[:, :40] = half * np.round(centres[:, :40])
    lo, hi = centres - half, centres + half
    bound = least_size(code, 0, given, stops, size)(lo, hi, np.linalg.norm(np.maximum(-lo, hi), axis=0))
    for _ in range(20):
        w, c = RNG.uniform(lo, hi), RNG.normal(size=centres.shape)
        c *= size / np.linalg.norm(c, axis=0)
        stopped = np.zeros(300, bool)
        for k, stop in enumerate(stops[:-1]):
            between = compose_steps([image(code, i, given) for i in range(k + 1)])(w, c)
            stopped |= (between**2).sum(0) >= stop
        last = np.linalg.norm(compose_steps([image(code, k, given) for k in range(len(code))])(w, c), axis=0)
        assert (stopped | (last >= bound * (1 - 1e-9))).all()
        tight += int((last < 2 * bound).sum())
    assert tight > 100


def test_a_constant_stretch_makes_the_bound_a_theorem() -> None:
    """L = 1 for a step, at most 4 / 3 for several; other steps, and tears, have a measured bound."""
    assert kifs_tetrahedron(iterations=3).bounds.lipschitz == 1
    hybrid = orbit(
        transform(kifs_octahedron(scale=1.5), scale=0.5, translate=(0.3, 0, 0)),
        kifs_tetrahedron(),
        iterations=3,
    )
    assert 1 <= hybrid.bounds.lipschitz <= 4 / 3
    assert verdict(hybrid, 1 << 13).violations == 0
    assert (
        mandelbox(iterations=3).bounds.lipschitz == 2
        and orbit(mandelbox()).changed(iterations=3).bounds.lipschitz == 3
    )

    def torn(w, c):  # type: ignore[no-untyped-def]
        return 2.0 * modulo(w, 1.0)

    assert constant_stretch((Code(torn, ()),), [((), (), ())]) is None


def test_a_report_can_name_the_formulas_whose_bound_is_measured() -> None:
    proved = orbit(kifs_octahedron(), kifs_tetrahedron(), iterations=2)
    root = union(proved, transform(mandelbox(iterations=3)), benesi(iterations=3), mandelbox(iterations=2))
    assert proved.bounds.measured == () and sphere().bounds.measured == ()
    assert root.bounds.measured == ("mandelbox", "benesi")


def test_search_of_a_hybrid_is_made_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Another process finds the radius in the cache, to the last bit."""
    hybrid = orbit(mandelbox(scale=1.7), mandelbox(scale=-1.6), iterations=3)
    first = growth_of(hybrid)
    monkeypatch.setattr(growth_module, "_search", None)
    growth_module.growth.cache_clear()
    assert growth_of(hybrid) == first


def test_a_search_ends_where_the_radius_is_too_large() -> None:
    """What comes back from everywhere is known to be too large before its cells are small."""
    levels = []

    def comes_back(lo: np.ndarray, hi: np.ndarray, far: np.ndarray) -> np.ndarray:
        levels.append(len(far))
        return np.zeros_like(far)

    assert escape_radius(comes_back, 1.0, 4.0, None) > 3.9
    cells = sum(levels)
    levels.clear()
    assert escape_radius(comes_back, 1.0, 4.0, None, 1.5) > 1.5
    assert sum(levels) < cells / 2
