"""Cells kept in vain by bounds and by proofs, and evaluations of sampling with each.

Of n^3 cells, those kept although all points tried in them are outside, or inside: by the Lipschitz bound, by
intervals of the field, and by intervals of its sign, with cells split in eight from 8^3 on. Then evaluations
of the sampler with the bound, with the bound and intervals, and with proofs alone, and its CPU time in units
of the first.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator

import numpy as np

from fracslice.expr.loops import enclosures
from fracslice.fields.cpu import compile_loops, compile_scene
from fracslice.fields.devices import Enclosures
from fracslice.fields.field import Cells
from fracslice.fields.linker import link
from fracslice.formulas import (
    Node,
    bounds,
    box,
    burning_ship,
    gyroid,
    julia,
    kifs_icosahedron,
    mandelbox,
    mandelbulb,
    menger,
    orbit,
    quaternion_mandelbrot,
    transform,
)
from fracslice.volume import Plan, plan
from fracslice.volume.pruning import Proofs
from fracslice.volume.sampler import sample_signs
from fracslice.work import Work
from tests.examples import EXAMPLES

from ..runner import Row, Run

SCENES: dict[str, Node] = {
    "Menger sponge 3": menger(level=3),
    "gyroid": bounds(gyroid(thickness=0.12), min=(-1, -1, -1), max=(1, 1, 1)),
    "Mandelbox -1.5": mandelbox(scale=-1.5, iterations=8),
    "Mandelbulb 10": mandelbulb(iterations=10),
    "Julia 12": julia(iterations=12),
    "Julia 12, by its step": quaternion_mandelbrot(julia=(-0.2, 0.8, 0), iterations=12),
    "kaleidoscope, 5 rounds": kifs_icosahedron(iterations=5),
    "bulb and box, 2 rounds": orbit(mandelbulb(), mandelbox(scale=-1.5), iterations=2),
    "kaleidoscope and ship, 2 rounds": orbit(
        kifs_icosahedron(),
        transform(burning_ship(power=4), rotate=(-0.2, -1, -1.5, 292), scale=1.3),
        iterations=2,
    ),
    "CSG of 240": EXAMPLES["many"] - box((0.3, 9, 9)),
}
SMALLEST = {"cells": 16, "voxels": 32, "names": ("gyroid",)}
CHUNK, ALONG = 1 << 14, 3

Test = Callable[[np.ndarray, float], tuple[np.ndarray, np.ndarray]]


def by_bound(root: Node) -> Test:
    field, known = compile_scene(root.conservative(), "float64"), root.conservative().bounds

    def test(centres: np.ndarray, half: float) -> tuple[np.ndarray, np.ndarray]:
        f, reach = field.points(*centres), known.lipschitz * np.sqrt(3) * half
        return f > reach, (f < -reach) & (not known.exterior_only)

    return test


def by_field(root: Node) -> Cells:
    return Enclosures(compile_loops(link(root), (enclosures,), "float32"), np.dtype("float32"))


def kept(test: Test, middle: np.ndarray, half: float, finest: int) -> np.ndarray:
    """Cells that a test does not decide, int [3, n]."""
    n, cells = 8, np.indices((8, 8, 8)).reshape(3, -1)
    while True:
        centres = middle[:, None] + half * ((2 * cells + 1) / n - 1)
        decided = np.concatenate(
            [
                np.logical_or(*test(centres[:, k : k + CHUNK], half / n))
                for k in range(0, cells.shape[1], CHUNK)
            ]
        )
        cells = cells[:, ~decided]
        if n == finest:
            return cells
        cells = (2 * cells[:, :, None] + np.indices((2, 2, 2)).reshape(3, 1, 8)).reshape(3, -1)
        n *= 2


def figures(root: Node, tests: dict[str, Test], n: int) -> Row:
    """Cells that each test keeps in vain, outside / inside; lost ones if there are any."""
    half, middle = max(root.bounds.box.size) / 2 * 1.05, np.array(root.bounds.box.centre)
    undecided = {name: np.zeros((n,) * 3, bool) for name in tests}
    for name, test in tests.items():
        undecided[name][tuple(kept(test, middle, half, n))] = True
    field, offsets = compile_scene(root), (np.indices((ALONG,) * 3).reshape(3, 1, -1) / (ALONG - 1)) * 2 - 1
    count = {name: np.zeros(3, int) for name in tests}
    for x in range(n):
        slab = np.stack(np.meshgrid([x], range(n), range(n), indexing="ij")).reshape(3, -1)
        points = middle[:, None] + half * ((2 * slab + 1) / n - 1)
        within = field.points(*(points[:, :, None] + 0.999 * half / n * offsets)) < 0
        some, full = within.any(1), within.all(1)
        for name in tests:
            left = undecided[name][tuple(slab)]
            count[name] += [(left & ~some).sum(), (left & full).sum(), (~left & some & ~full).sum()]
    return {
        name: f"{outside:,} / {inside:,}" + (f", {lost} lost" if lost else "")
        for name, (outside, inside, lost) in count.items()
    }


def sampled(planned: Plan, proofs: Proofs | None) -> tuple[int, float]:
    """Evaluations, and CPU seconds."""
    root = planned.root
    kernel, own = root.kernel(), root.conservative()
    begun = time.process_time()
    signs = sample_signs(kernel, own.bounds, planned.lattice, Work(threads=1), own.kernel(), proofs)
    return signs.evaluations, time.process_time() - begun


def rows(
    run: Run, cells: int = 128, voxels: int = 512, names: tuple[str, ...] = tuple(SCENES)
) -> Iterator[Row]:
    for name in names:
        planned = plan(SCENES[name], voxels)
        root = planned.root
        proofs = root.cells()
        tests: dict[str, Test] = {"L": by_bound(root), "field": by_field(root), "sign": proofs}
        row: Row = {"": name, **figures(root, tests, cells)}
        methods = {"by L": None, "by both": Proofs(proofs), "by proofs": Proofs(proofs, True)}
        spent = {method: [sampled(planned, how) for _ in range(run.runs)] for method, how in methods.items()}
        first = min(seconds for _, seconds in spent["by L"])
        for method, all_of in spent.items():
            share = min(seconds for _, seconds in all_of) / first
            row[method] = f"{all_of[0][0] / 1e6:.1f} M, {share:.2f}"
        yield row
