"""The bounds that formulas state, at few points; `tests.benchmarks stability.bounds` tries 10^7."""

from __future__ import annotations

import numpy as np
import pytest

from fracslice.fields.cpu import compile_scene
from fracslice.formulas import (
    Node,
    difference,
    get,
    intersection,
    julia,
    mandelbulb,
    names,
    offset,
    plane,
    shell,
    sphere,
    union,
)
from tests.examples import EXAMPLES, STRUCTURES, stamped

from .bounds import verdict
from .draws import drawn
from .seams import SEAMS

pytestmark = pytest.mark.once

HARD: dict[str, Node] = {
    "Julia set in pieces": julia(iterations=12, c=(0.3, 0.5, 0.4, 0)),
    "shipped Julia set": julia(iterations=12, c=(-0.291, -0.399, 0.339, 0.437)),
    "shipped top": mandelbulb(iterations=6, julia=(0, 0, 0.75)),
    "Mandelbulb Julia set in pieces": mandelbulb(iterations=6, julia=(1, 0, 0)),
    "power 5": mandelbulb(iterations=6, power=5, julia=(0.62, 0.33, 0.2)),
    "power 32": mandelbulb(iterations=6, power=32),
    "offset": offset(mandelbulb(iterations=5), distance=0.05),
    "hollow offset": shell(offset(mandelbulb(iterations=5), distance=0.1), thickness=0.05),
    "seam of two": union(mandelbulb(iterations=5), julia(iterations=8), smooth=0.3),
    "wide seam": union(mandelbulb(iterations=5), sphere(radius=0.95), smooth=0.5),
    "seam of power 31": union(mandelbulb(iterations=2, power=31), sphere(), smooth=0.1),
    "dust of power 27": mandelbulb(iterations=1, power=27, bailout=2.26, julia=(3, 0.03, -1.36)),
    "dust of power 12": mandelbulb(iterations=2, power=12, bailout=2.75, julia=(1.27, 0.13, 2.28)),
    "torn": mandelbulb(iterations=3, power=10.6, bailout=1.58, julia=(0.85, 0.32, 0.16)),
    "torn dust": mandelbulb(iterations=3, power=5.68, bailout=17, julia=(-0.09, 0.15, 1)),
    "torn seam": union(mandelbulb(iterations=4, power=6.4), sphere(radius=0.95), smooth=0.1),
    "cut out seamlessly": intersection(
        mandelbulb(iterations=7, power=27.66, bailout=2.68), plane(normal=(0.39, 1.83, 0.03)), smooth=0.47
    ),
    "cut off by a deep one": difference(
        sphere(radius=1.207), mandelbulb(iterations=6, power=27, bailout=2.557)
    ),
    "shrunk": offset(mandelbulb(iterations=14, power=27), distance=-0.018),
    "torn and shrunk": offset(mandelbulb(iterations=6, power=25.2), distance=-0.0015),
    "torn and grown": shell(offset(mandelbulb(iterations=13, power=25.7), distance=0.1), thickness=0.07),
}
"""Where bounds were once exceeded."""
WHOLE = [name for name in EXAMPLES if not name.startswith("hybrid")]
"""Examples whose elements are solids of their own, as steps of hybrids (`test_hybrids`) are not."""
OFTEN = {
    "Julia set in pieces", "hollow offset", "seam of two", "dust of power 12", "torn seam",
    "cut off by a deep one", "torn and grown", "seam, power 24", "seam of folds", "wall, power 7.5",
}  # fmt: skip
"""Those below of every run; the others in a night."""


@pytest.mark.parametrize("name", stamped(WHOLE))
def test_the_bound_holds(name: str) -> None:
    assert verdict(EXAMPLES[name], 50_000).violations == 0


@pytest.mark.parametrize("name", stamped(WHOLE, STRUCTURES))
def test_the_bound_holds_with_other_numbers(name: str) -> None:
    root = drawn(EXAMPLES[name], np.random.default_rng(2), 0.5)
    assert verdict(root, 50_000).violations == 0


@pytest.mark.parametrize("name", stamped(SEAMS, OFTEN))
def test_seams_cuts_walls_and_folds_of_fractals(name: str) -> None:
    result = verdict(SEAMS[name], 100_000)
    assert result.violations == 0 and result.points > 50_000


@pytest.mark.parametrize("name", stamped(HARD, OFTEN))
def test_the_bound_holds_where_it_did_not(name: str) -> None:
    result = verdict(HARD[name], 200_000, seed=1)
    assert result.violations == 0 and result.points > 100_000


@pytest.mark.parametrize(
    ("power", "bailout", "point"),
    [
        (21, 1.5653262568878086, (0.2835015297720734, -0.28350168124467423, -0.7676105501439598)),
        (25, 1.4471935185939413, (0.18696972825606856, 0.1869688908965394, 0.8477419649182849)),
        (25, 1.4471935185939413, (-0.2970785318283784, 0.00016299669530456357, 0.870277545354547)),
    ],
)
def test_many_steps_near_the_poles(power: float, bailout: float, point: tuple[float, ...]) -> None:
    """Circles of latitude stretch more than meridians in most steps: dr multiplies what is forgotten."""
    field = compile_scene(mandelbulb(power=power, iterations=11, bailout=bailout), "float64").points
    centre, way = np.array(point)[:, None], np.random.default_rng(0).normal(size=(3, 20_000))
    ball = field(*centre) / 2 * np.random.default_rng(1).uniform(0, 1, 20_000) / np.linalg.norm(way, axis=0)
    assert field(*centre) > 0 and (field(*(centre + ball * way)) > 0).all()


def test_a_bound_that_is_too_small_is_found() -> None:
    for root, bound in ((sphere(), 0.999), (julia(iterations=10), 0.6)):
        result = verdict(root, 200_000, bound=bound)
        assert result.violations > 0 and result.worst > 1 and len(result.where) == 3


def test_every_formula_says_where_its_bound_is_from() -> None:
    silent = [name for name in names() if "L = " not in get(name).doc]
    assert silent == []
