"""The sampler against dense sampling: every sign right, every sign change within the samples, whatever the
threads.
"""

from __future__ import annotations

import threading
from dataclasses import replace

import numpy as np
import pytest

from fracslice.errors import Cancelled, SceneError, TooLargeError, VolumeError
from fracslice.fields.box import Box
from fracslice.fields.cpu import compile_scene
from fracslice.fields.field import Bounds
from fracslice.formulas import (
    Node,
    box,
    difference,
    intersection,
    mandelbulb,
    plane,
    repeat,
    shell,
    sphere,
    transform,
    union,
)
from fracslice.volume import Bricks, Lattice, extent, plan, sample, sample_scene
from fracslice.volume.bricks import INSIDE, OUTSIDE
from fracslice.volume.pruning import Proofs
from fracslice.work import Work
from tests.examples import EXAMPLES, stamped

pytestmark = pytest.mark.once

FINITE = [name for name, root in EXAMPLES.items() if root.bounds.box.finite]


def dense(root: Node, lattice: Lattice) -> np.ndarray:
    """The field on all grid points."""
    corners = np.indices(lattice.bricks, np.int32).reshape(3, -1).T * np.int32(8)
    out = np.empty((len(corners), 512), np.float32)
    compile_scene(root).bricks(np.ascontiguousarray(corners), lattice.origin, lattice.voxel, out)
    bx, by, bz = lattice.bricks
    return out.reshape(bx, by, bz, 8, 8, 8).transpose(0, 3, 1, 4, 2, 5).reshape(8 * bx, 8 * by, 8 * bz)


def unfolded(bricks: Bricks) -> tuple[np.ndarray, np.ndarray]:
    """Signs (True inside) on all grid points as the bricks tell them, and where there are samples."""
    inside = np.repeat(np.repeat(np.repeat(bricks.index == INSIDE, 8, 0), 8, 1), 8, 2)
    sampled = np.zeros_like(inside)
    for (i, j, k), values in zip(bricks.ijk, bricks.values, strict=True):
        part = np.s_[i : i + 8, j : j + 8, k : k + 8]
        inside[part], sampled[part] = values.reshape(8, 8, 8) < 0, True
    return inside, sampled


def open_edges(bricks: Bricks) -> int:
    """Sign changes along grid edges that have an end without a sample."""
    inside, sampled = unfolded(bricks)
    inside, sampled = np.pad(inside, 1), np.pad(sampled, 1)
    count = 0
    for axis in range(3):
        a, b = (inside.take(range(s, inside.shape[axis] - 1 + s), axis) for s in (0, 1))
        p, q = (sampled.take(range(s, inside.shape[axis] - 1 + s), axis) for s in (0, 1))
        count += int(((a != b) & ~(p & q)).sum())
    return count


@pytest.mark.parametrize("name", stamped(FINITE))
def test_closed_and_equal_to_dense_sampling(name: str) -> None:
    planned = plan(EXAMPLES[name], 48)
    bricks = sample_scene(planned)
    assert open_edges(bricks) == 0
    inside, sampled = unfolded(bricks)
    truth = dense(planned.root, planned.lattice) < 0
    # What differs can only be pockets sealed in the inside of an escape-time fractal, which are filled.
    differing = inside != truth
    assert not (differing & ~inside).any()
    assert not differing.any() or (
        planned.root.bounds.exterior_only and differing.sum() < 1e-3 * inside.sum()
    )


@pytest.mark.parametrize("name", ["mandelbulb", "menger", "twist"])
def test_threads_and_runs_do_not_matter(name: str) -> None:
    planned = plan(EXAMPLES[name], 96)
    first = sample_scene(planned, Work(threads=1))
    for threads in (1, 2, 7):
        again = sample_scene(planned, Work(threads=threads))
        assert again.values.tobytes() == first.values.tobytes()
        assert again.ijk.tobytes() == first.ijk.tobytes() and again.index.tobytes() == first.index.tobytes()
        assert again.evaluations == first.evaluations


def test_rows_are_in_order_and_numbered() -> None:
    bricks = sample_scene(plan(EXAMPLES["torus"], 64))
    assert (np.lexsort(bricks.ijk.T[::-1]) == np.arange(len(bricks))).all()
    assert (bricks.index[tuple(bricks.ijk.T // 8)] == np.arange(len(bricks))).all()
    assert (bricks.index >= OUTSIDE - 1).all() and (bricks.index >= 0).sum() == len(bricks)
    assert not np.isnan(bricks.values).any()


def test_a_wrong_lipschitz_bound_is_repaired() -> None:
    """A field that grows three times as fast as it says: the closure rule finds what pruning lost."""
    root = union(sphere(radius=0.7), box(size=(2.0, 0.2, 0.2)))
    kernel, bounds = compile_scene(transform(root)), Bounds(root.bounds.box, 1 / 3, False)
    bricks = sample(kernel, bounds, Lattice.around(root.bounds.box, 2 / 64))
    assert open_edges(bricks) == 0 and bricks.repaired > 0


def test_the_audit_finds_what_nothing_leads_to() -> None:
    """A ball that a wrong bound hides, far from all that is sampled."""
    root = union(box(size=(0.4, 0.4, 0.4)), transform(sphere(radius=0.3), translate=(2, 0, 0)))
    lattice, kernel = Lattice.around(root.bounds.box, 2.5 / 96), compile_scene(root)
    truthful = sample(kernel, root.bounds, lattice)
    lying = sample(kernel, Bounds(root.bounds.box, 0.05, False), lattice)
    assert truthful.repaired == 0 and lying.repaired > 0 and truthful.audited > 0
    assert len(lying) == len(truthful) and open_edges(lying) == 0


def test_a_pocket_breaks_no_bound() -> None:
    """Bubbles between the centres of bricks, in what cannot be recognised as inside from afar."""
    bubbles = repeat(sphere(radius=0.03), period=(0.16, 0.16, 0.16), count=(5, 5, 5))
    root, voxel = difference(box(size=(1.6, 1.6, 1.6)), bubbles), 0.02
    lattice = Lattice((-0.89, -0.89, -0.89), voxel, (11, 11, 11))
    bricks = sample(compile_scene(root), Bounds(root.bounds.box, 1.0, True), lattice)
    inside, _ = unfolded(bricks)
    assert bricks.repaired == 0 and not inside[10:78, 10:78, 10:78].all()


def test_the_voxel_is_that_of_the_object() -> None:
    """One step less and this one is 20 times as large."""
    planned = plan(mandelbulb(power=2, bailout=5e5), 64)
    own = extent(planned.root).box
    assert max(own.size) / planned.voxel == pytest.approx(64, rel=0.05)


def test_inside_is_not_filled() -> None:
    """Bricks and evaluations grow with the surface, not with the volume."""
    small, large = (sample_scene(plan(EXAMPLES["mandelbulb"], n)) for n in (64, 128))
    assert large.evaluations < 6 * small.evaluations
    assert (large.index == INSIDE).any()


def test_hollow_shells_keep_their_cavity() -> None:
    bricks = sample_scene(plan(shell(sphere(), thickness=0.1), 64))
    inside, _ = unfolded(bricks)
    middle = tuple(n // 2 for n in inside.shape)
    assert not inside[middle]


@pytest.mark.parametrize(
    ("root", "message"),
    [
        (plane(), "no end along"),
        (intersection(sphere(), transform(sphere(), translate=(5, 0, 0))), "no point in common"),
        (
            intersection(sphere(), transform(sphere(), translate=(1.99, 1, 0))),
            "the scene is empty: every point is outside; expected less cut away",
        ),
        (difference(sphere(radius=0.5), box(size=(2, 2, 2))), "every point is outside"),
        (difference(mandelbulb(), sphere(radius=2)), "every point is outside"),
        (difference(sphere(), sphere()), "no point is inside; expected thicker parts or less cut away"),
    ],
)
def test_scenes_without_a_solid(root: Node, message: str) -> None:
    with pytest.raises((SceneError, VolumeError), match=message):
        plan(root, 64)


def test_what_is_too_thin_for_any_sample_says_so() -> None:
    with pytest.raises(VolumeError, match=r"thinner than a voxel of 0\.0417; expected more voxels"):
        sample_scene(plan(shell(sphere(), thickness=1e-4), 48))


def test_too_fine_a_voxel_is_refused_before_starting() -> None:
    with pytest.raises(VolumeError, match="expected at most 8176 voxels"):
        Lattice.around(sphere().bounds.box, 1e-5)


def test_a_grid_that_needs_more_memory_than_there_is(monkeypatch: pytest.MonkeyPatch) -> None:
    cube = Box((0.0, 0.0, 0.0), (1.0, 1.0, 1.0))
    monkeypatch.setattr("fracslice.volume.bricks.available_bytes", lambda: 10**10)
    assert Lattice.around(cube, 1 / 4096).bricks == (513, 513, 513)
    with pytest.raises(TooLargeError, match=r"1025 x 1025 x 1022 bricks, which needs 12\.9 GB of memory"):
        Lattice.around(Box((0.0, 0.0, 0.0), (1.0, 1.0, 0.997)), 1 / 8190)


def test_cancelled() -> None:
    work = Work(cancel=threading.Event())
    work.cancel.set()
    with pytest.raises(Cancelled):
        sample_scene(plan(sphere(), 64), work)


def test_progress_is_reported() -> None:
    reported: list[tuple[str, float]] = []
    sample_scene(plan(sphere(), 64), Work(progress=lambda stage, done: reported.append((stage, done))))
    assert reported and all(0 <= done <= 1 for _, done in reported) and reported[-1][1] == 1.0


@pytest.mark.parametrize("name", ["menger", "many", "smooth difference"])
def test_proofs_change_no_sample(name: str) -> None:
    """Enclosures discard cells that the bound keeps, and none with a sign change."""
    planned = plan(EXAMPLES[name], 96)
    kernel, bounds = planned.root.kernel(), planned.root.bounds
    without = sample(kernel, bounds, planned.lattice)
    proofs = Proofs(planned.root.cells())
    bricks = sample(kernel, bounds, planned.lattice, proofs=proofs)
    assert bricks.values.tobytes() == without.values.tobytes() and (bricks.index == without.index).all()
    assert bricks.proved == 1


@pytest.mark.parametrize("name", ["mandelbulb 5", "mandelbox -1.5", "hybrid"])
def test_only_proofs_leave_no_pocket(name: str) -> None:
    """With proofs alone the inside of an escape-time fractal is known, too."""
    planned = replace(plan(EXAMPLES[name], 48), proved=True)
    bricks = sample_scene(planned)
    inside, _ = unfolded(bricks)
    assert (inside == (dense(planned.root, planned.lattice) < 0)).all() and bricks.proved == 1


def test_proofs_see_through_operators_to_an_orbit() -> None:
    """The sign of an orbit is enclosed where its distance is not: most of the space around it is proved."""
    root = transform(mandelbulb(power=5, iterations=4), rotate=(1, 2, 3, 40))
    planned = replace(plan(difference(root, box(size=(3.0, 3.0, 0.4))), 64), proved=True)
    strict, measured = sample_scene(planned), sample_scene(replace(planned, proved=False))
    assert strict.values.tobytes() == measured.values.tobytes()
    assert strict.evaluations < 5 * measured.evaluations and measured.proved is None


def test_wrong_bounds_lose_nothing_with_proofs() -> None:
    """A bound that is far too small hides a fractal, and nothing is skipped by it if proofs alone count."""
    root = transform(mandelbulb(power=2, iterations=6), scale=(0.5,))
    lattice, kernel = Lattice.around(root.bounds.box, 1.3 / 64), compile_scene(root)
    wrong = Bounds(root.bounds.box, 0.05, True)
    bricks = sample(kernel, wrong, lattice, proofs=Proofs(root.cells(), only=True))
    assert bricks.repaired == 0 and (unfolded(bricks)[0] == (dense(root, lattice) < 0)).all()
    assert sample(kernel, wrong, lattice).repaired > 0
