"""What every field promises, whatever it is made of."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest

from fracslice.expr.loops import points as points_loop
from fracslice.fields.devices import reference
from fracslice.fields.field import Field, Precision
from fracslice.formulas import mandelbulb, sphere, transform, union
from fracslice.printing.edits import Does, EditedField, edited_field
from fracslice.printing.thin_features import OffsetField
from fracslice.printing.walls import Samples
from fracslice.volume import Bricks, Lattice, sample

pytestmark = pytest.mark.once

Values = Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]

BALL, ASIDE = sphere(radius=0.8), transform(sphere(radius=0.4), translate=(0.6, 0.1, 0))
TORN = mandelbulb(iterations=4, power=7.5)
ORIGIN, VOXEL = (-1.4, -1.4, -1.4), 0.1
RANDOM = np.random.default_rng(0)
POINTS_HERE = RANDOM.uniform(-1.3, 1.3, (3, 4001))


@dataclass(frozen=True)
class Case:
    """A field, its values, how near the field comes to them, and fields that differ from it in one thing."""

    field: Field
    values: Values
    within: float
    others: tuple[Field, ...]


def sampled(root: Field, voxel: float = 0.05) -> Bricks:
    return sample(root.kernel(), root.bounds, Lattice.around(root.bounds.box.grown(0.1), voxel))


def changed(does: Does) -> Values:
    f, g = reference(BALL), reference(ASIDE)
    fold = {
        "add": lambda a, b: np.minimum(a, b),
        "cut": lambda a, b: np.maximum(a, -b),
        "keep": np.maximum,
    }[does]
    return lambda x, y, z: fold(f(x, y, z), g(x, y, z))


def edit(does: Does) -> Case:
    other: Does = "keep" if does == "add" else "add"
    others = EditedField(BALL, other, ASIDE), EditedField(ASIDE, does, ASIDE), EditedField(BALL, does, BALL)
    return Case(EditedField(BALL, does, ASIDE), changed(does), 1e-6, others)


NEAR = sampled(BALL)
CASES = {
    "tree": Case(BALL, reference(BALL), 1e-6, (sphere(radius=0.81), sphere())),
    "union": Case(union(BALL, ASIDE), changed("add"), 1e-6, (union(BALL, ASIDE, smooth=0.1), BALL)),
    "torn": Case(TORN, reference(TORN), 1e-3, (TORN.changed(iterations=5), TORN.changed(bailout=2.1))),
    "samples": Case(
        Samples(NEAR),
        reference(BALL),
        0.005,
        (
            Samples(sampled(ASIDE)),
            Samples(sampled(BALL, 0.06)),
            Samples(Bricks(NEAR.origin, NEAR.voxel, NEAR.ijk, NEAR.values * np.float32(1.01), NEAR.index)),
            Samples(Bricks((0.0, 0.0, 0.0), NEAR.voxel, NEAR.ijk, NEAR.values, NEAR.index)),
        ),
    ),
    "grown": Case(
        OffsetField(BALL, 0.1),
        lambda x, y, z: reference(BALL)(x, y, z) - 0.1,
        1e-6,
        (OffsetField(BALL, 0.11), OffsetField(ASIDE, 0.1)),
    ),
    "shrunk": Case(
        OffsetField(BALL, -0.1),
        lambda x, y, z: reference(BALL)(x, y, z) + 0.1,
        1e-6,
        (OffsetField(BALL, 0.1),),
    ),
    "add": edit("add"),
    "cut": edit("cut"),
    "keep": edit("keep"),
    "torn and cut": Case(
        EditedField(TORN, "cut", Samples(sampled(ASIDE))),
        lambda x, y, z: np.maximum(reference(TORN)(x, y, z), -reference(ASIDE)(x, y, z)),
        0.005,
        (EditedField(TORN, "cut", ASIDE),),
    ),
}
EVERY = pytest.mark.parametrize("name", CASES)


def near(case: Case) -> np.ndarray:
    """Points beside the surface: farther away samples are bounds."""
    return POINTS_HERE[:, np.abs(case.values(*POINTS_HERE)) < 0.05]


@EVERY
@pytest.mark.parametrize("precision", ["float32", "float64"])
def test_values_are_those_of_the_reference(name: str, precision: Precision) -> None:
    case = CASES[name]
    points, kernel = near(case), case.field.kernel("cpu", precision)
    got = kernel.points(*points)
    assert got.dtype == kernel.dtype == precision and points.shape[1] > 30
    np.testing.assert_allclose(got, case.values(*points), rtol=0, atol=case.within)
    assert kernel.points(*np.zeros((3, 2, 5))).shape == (2, 5)


@EVERY
@pytest.mark.parametrize("precision", ["float32", "float64"])
def test_every_way_to_evaluate_gives_the_same(name: str, precision: Precision) -> None:
    """Points, bricks, and what loops call."""
    field = CASES[name].field
    kernel = field.kernel("cpu", precision)
    corners = np.array([(0, 8, 0), (16, 16, 8)], np.int32)
    out = np.empty((2, 512), precision)
    kernel.bricks(corners, ORIGIN, VOXEL, out)
    grid = corners[:, :, None] + np.indices((8, 8, 8)).reshape(3, 512)
    places = (np.array(ORIGIN)[:, None] + VOXEL * grid).transpose(1, 0, 2).reshape(3, -1)
    np.testing.assert_allclose(out.ravel(), kernel.points(*places), rtol=0, atol=2e-6)
    loops = field.loops([points_loop], precision)
    rows = np.ascontiguousarray(places, precision)
    assert rows.shape[1] % loops.width == 0 < loops.batch
    values = np.empty((1, rows.shape[1]), precision)
    native = loops.runs["points"].native(rows[0])
    if callable(kernel.entry):
        kernel.entry(rows, values)
        assert callable(native)
    else:
        function, parameters = kernel.entry
        function(parameters, *rows, values[0], rows.shape[1])
    np.testing.assert_array_equal(values[0], kernel.points(*rows))


@EVERY
def test_bounds_hold(name: str) -> None:
    """Nothing is inside beyond the box, and no point of the surface nearer than the bound says."""
    case = CASES[name]
    points = 1.5 * POINTS_HERE
    f, bounds = case.field.kernel("cpu", "float64").points(*points), case.field.bounds
    inside, box = f < 0, bounds.box.grown(1e-9)
    held = (points >= np.array(box.lo)[:, None]) & (points <= np.array(box.hi)[:, None])
    assert inside.any() and held.all(0)[inside].all()
    conservative = case.field.conservative()
    g = conservative.kernel("cpu", "float64").points(*points)
    balls = np.maximum(g, 0) / conservative.bounds.lipschitz
    if not bounds.exterior_only:
        balls = np.where(inside, -f / bounds.lipschitz, balls)
    for sign in (True, False) if not bounds.exterior_only else (False,):
        some, other = points[:, inside == sign][:, :800], points[:, inside != sign][:, :800]
        gap = np.linalg.norm(some[:, :, None] - other[:, None], axis=0).min(1)
        assert (gap >= balls[inside == sign][:800] - 1e-9).all()


@EVERY
def test_the_key_is_of_all_that_matters(name: str) -> None:
    case = CASES[name]
    keys = [case.field.key, *(other.key for other in case.others)]
    assert len(set(keys)) == len(keys) and keys[0] == case.field.key


def test_formulas_beside_formulas_are_one_tree() -> None:
    whole = edited_field(edited_field(BALL, "add", ASIDE), "cut", TORN)
    assert whole.tree is whole and not whole.escape_time_only and TORN.escape_time_only
    mixed = edited_field(edited_field(BALL, "cut", Samples(NEAR)), "add", ASIDE)
    assert mixed.tree is None and not mixed.escape_time_only
