"""Intervals against extended precision and the kernels: every value on a cell lies within its bounds."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from fracslice.expr.graph import ON_ARRAYS, Evaluator
from fracslice.expr.intervals import ARRAYS, Interval
from fracslice.expr.loops import enclosures
from fracslice.fields.box import Box
from fracslice.fields.cpu import compile_loops, compile_scene
from fracslice.fields.depth import resolve_depths
from fracslice.fields.devices import Enclosures, enclosure
from fracslice.fields.field import Precision
from fracslice.fields.linker import FIELD, link
from fracslice.formulas import Node, gyroid, mandelbox, mandelbulb, menger, sphere
from tests.examples import EXAMPLES, OF_FILES, stamped

pytestmark = pytest.mark.once

CELLS, POINTS = 96, 12
KINDS = {
    "menger": menger(level=3),
    "wall": gyroid(),
    "orbit": mandelbox(iterations=3),
    "bulb": mandelbulb(power=7.5, iterations=2),
}


def exact(root: Node) -> Any:
    """The field in extended precision."""
    linked = link(root)
    named = linked.program.functions
    return lambda x, y, z: Evaluator(ON_ARRAYS, named)(named[FIELD], x, y, z, linked.parameters)


def cells(half: float) -> tuple[np.ndarray, np.ndarray]:
    """Centres of cells, and points in them: their centres, corners, and others; axes and planes included."""
    rng = np.random.default_rng(1)
    centres = rng.uniform(-1.3, 1.3, (3, CELLS))
    centres[:, :8] = np.round(centres[:, :8])
    offsets = rng.uniform(-half, half, (3, CELLS, POINTS))
    offsets[:, :, 0], offsets[:, :, 1:9] = 0, half * (2 * np.indices((2, 2, 2)).reshape(3, 1, 8) - 1)
    return centres, centres[:, :, None] + offsets


@pytest.mark.parametrize("name", stamped(sorted(EXAMPLES.keys() - OF_FILES)))  # see tests.mesh
def test_bounds_enclose_the_exact_field(name: str) -> None:
    root = resolve_depths(EXAMPLES[name], 0.1)
    enclosed, field = enclosure(root), exact(root)
    for half in (1e-9, 0.02):
        centres, points = cells(half)
        x, y, z = (Interval(c - half, c + half, ARRAYS).outward() for c in centres)
        bounds = enclosed(x, y, z)
        with np.errstate(all="ignore"):
            f = field(*points.astype(np.longdouble))
        assert not (f < np.broadcast_to(bounds.lo, CELLS)[:, None]).any()
        assert not (f > np.broadcast_to(bounds.hi, CELLS)[:, None]).any()
        assert half > 1e-9 or (bounds.hi - bounds.lo < 1e-4).mean() > 0.2  # no bound is trivial


@pytest.mark.parametrize(
    ("name", "precision"), [*((name, "float32") for name in KINDS), ("menger", "float64")]
)
def test_bounds_on_lanes_enclose_the_exact_field_and_the_kernel(name: str, precision: Precision) -> None:
    """Rounding is outward: cells of a few units in the last place show it."""
    root, dtype = KINDS[name], np.dtype(precision)
    proofs = Enclosures(compile_loops(link(root), (enclosures,), precision), dtype)
    kernel, field = compile_scene(root, precision), exact(root)
    for half in (2 * float(np.finfo(dtype).eps), 1e-3, 0.1):
        centres, points = cells(half)
        low, high = proofs.bounds(centres, half)
        points = np.clip(points.astype(dtype), (centres - half)[:, :, None], (centres + half)[:, :, None])
        for f in (kernel.points(*points.astype(dtype)), field(*points.astype(np.longdouble))):
            assert (low[:, None] <= f).all() and (f <= high[:, None]).all()


def test_a_sphere_is_enclosed_to_rounding() -> None:
    proofs = Enclosures(compile_loops(link(sphere(0.5)), (enclosures,), "float64"), np.dtype("float64"))
    low, high = proofs.bounds(np.array([[1.0], [0.0], [0.0]]), 0.0)
    assert high - low < 1e-14 and low < 0.5 < high


def test_cells_are_empty_full_or_unknown() -> None:
    empty, full = sphere(0.5).cells()(np.array([[0.0, 0.5, 1.0], [0.0] * 3, [0.0] * 3]), 0.1)
    assert empty.tolist() == [False, False, True] and full.tolist() == [True, False, False]


@pytest.mark.parametrize("name", stamped(sorted(EXAMPLES)))
def test_no_cell_is_lost(name: str) -> None:
    """Cells against a dense grid of 64^3 points."""
    root = resolve_depths(EXAMPLES[name], 0.1)
    box = root.bounds.box & Box.centred(1.5)
    half, n = max(box.size) / 2 * 1.05, 16
    centres = np.array(box.centre)[:, None] + half / n * (2 * np.indices((n,) * 3).reshape(3, -1) + 1 - n)
    x, y, z = (Interval(c - half / n, c + half / n, ARRAYS).outward() for c in centres)
    within = half / n * (2 * np.indices((4,) * 3).reshape(3, 1, -1) / 3 - 1)
    inside = compile_scene(root).points(*(centres[:, :, None] + within)) < 0
    for tree in (root, root.signs()):
        bounds = enclosure(tree)(x, y, z)
        assert not (inside.any(1) & (bounds.lo > 0)).any()
        assert not (~inside.all(1) & (bounds.hi < 0)).any()
