"""Time of fields that follow from a step, in units of the same fields written by hand.

Ratios of the shortest of interleaved runs, for the centres of n^3 cells of the box ("grid"), and for the same
number of points within four cells of the surface ("band"). Evaluations are those of sampling.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from math import cos, radians, sin

import numpy as np

from fracslice.fields.cpu import compile_scene
from fracslice.fields.definitions import Definition, formula
from fracslice.formulas import (
    Node,
    bristorbrot,
    kifs_tetrahedron,
    mandelbox,
    mandelbulb,
    quaternion_mandelbrot,
)
from fracslice.volume import plan
from fracslice.volume.sampler import sample_signs
from fracslice.work import Work

from ..runner import Row, Run
from . import by_hand
from .by_hand import made

C, ANGLE = (-0.2, 0.8, 0.0), radians(20)
BOX, THIN_BOX = mandelbox(iterations=10), mandelbox(scale=-1.5, iterations=10)
BULB = mandelbulb(iterations=8)
KIFS, BRISTOR = kifs_tetrahedron(angle=20, iterations=6), bristorbrot(iterations=8)
JULIA = quaternion_mandelbrot(julia=C, iterations=12)
SQUARE = """\
x, y, z = w
return (x * x - y * y - z * z, 2 * x * y, 2 * x * z) + c
"""
BARE = formula(Definition("square", (), SQUARE))(julia=C, iterations=12)
SCENES: dict[str, tuple[str, Node, Node]] = {
    "Mandelbox 2": ("verbs", BOX, made(by_hand.mandelbox, BOX, scale=2.0, size=2.0, inner2=0.25)),
    "Mandelbox -1.5": (
        "verbs",
        THIN_BOX,
        made(by_hand.mandelbox, THIN_BOX, scale=-1.5, size=1.5, inner2=0.25),
    ),
    "KIFS tetrahedron": (
        "verbs",
        KIFS,
        made(by_hand.kifs, KIFS, scale=2.0, cosine=cos(ANGLE), sine=sin(ANGLE)),
    ),
    "Mandelbulb 8": ("verbs", BULB, made(by_hand.mandelbulb, BULB)),
    "Julia": ("its stretch returned", JULIA, made(by_hand.julia, JULIA, constant=C)),
    "Julia, differentiated": ("its text", BARE, made(by_hand.julia, BARE, constant=C)),
    "Bristorbrot": ("its text", BRISTOR, made(by_hand.bristorbrot, BRISTOR)),
}
"""What the stretch follows from, the solid of the step, and the same by hand."""
RUNS = 50
SMALLEST = {"n": 16, "voxels": 32, "names": ("Mandelbox 2",)}


def points(root: Node, n: int) -> dict[str, np.ndarray]:
    """Centres of cells of the box, and the same number of those near the surface."""
    lo, hi = np.array(root.bounds.box.lo), np.array(root.bounds.box.hi)
    cells = (np.indices((n, n, n)).reshape(3, -1) + 0.5) / n
    grid = (lo[:, None] + (hi - lo)[:, None] * cells).astype("float32")
    near = np.abs(compile_scene(root).points(*grid)) < 4 * max(hi - lo) / n
    return {"grid": grid, "band": np.resize(grid[:, near].T, grid.T.shape).T.copy()}


def evaluations(root: Node, voxels: int) -> int:
    """Evaluations of sampling."""
    planned = plan(root, voxels)
    own = planned.root.conservative()
    work = Work(threads=1)
    signs = sample_signs(planned.root.kernel(), own.bounds, planned.lattice, work, own.kernel())
    return signs.evaluations


def rows(run: Run, n: int = 48, voxels: int = 128, names: tuple[str, ...] = tuple(SCENES)) -> Iterator[Row]:
    for name in names:
        how, step, hand = SCENES[name]
        row: Row = {"": name, "stretch from": how}
        for where, at in points(hand, n).items():
            acts = {
                k: partial(compile_scene(root).points, *at) for k, root in (("step", step), ("hand", hand))
            }
            spent = run.interleaved(acts)
            row[f"time, {where}"] = spent.spread("step", "cpu_s").min / spent.spread("hand", "cpu_s").min
        yield {**row, "evaluations": evaluations(step, voxels) / evaluations(hand, voxels)}
