"""Errors of volume, area and vertices against closed forms: samples alone, exact, and with a chord tolerance.

Relative errors; |f| at the vertices in voxels.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from fracslice.fields.devices import reference
from fracslice.formulas import Node, box, julia, menger, sphere, torus, transform
from fracslice.mesh.contouring import contour, extract
from fracslice.mesh.refine import refine
from fracslice.volume import plan, sample_scene

from ..runner import Row, Run

CHORD = 1e-3
"""Voxels."""


@dataclass(frozen=True)
class Truth:
    root: Node
    resolution: float
    volume: float
    area: float


def ball(radius: float) -> tuple[float, float]:
    return 4 / 3 * math.pi * radius**3, 4 * math.pi * radius**2


def sponge(level: int) -> tuple[float, float]:
    return 8 * (20 / 27) ** level, 8 * (20 / 9) ** level + 16 * (8 / 9) ** level


TRUTHS = {
    "unit sphere": Truth(sphere(), 256, *ball(1)),
    "torus 1 / 0.3": Truth(torus(radius=1, tube=0.3), 192, 2 * math.pi**2 * 0.09, 4 * math.pi**2 * 0.3),
    "box 1 x 2 x 0.7": Truth(box(size=(1, 2, 0.7)), 100, 1.4, 8.2),
    "turned box": Truth(transform(box(size=(1, 1.3, 0.8)), rotate=(1, 2, 3, 37)), 100, 1.04, 6.28),
    "Menger level 3": Truth(menger(level=3), 101.3, *sponge(3)),
    "Menger level 4": Truth(menger(level=4), 213.3, *sponge(4)),
    "Julia c = 0, a sphere": Truth(julia(c=(0, 0, 0, 0), iterations=12), 128, *ball(2 ** (1 / 4096))),
}
SMALLEST = {"solids": ("box 1 x 2 x 0.7",), "share": 0.1}


def rows(run: Run, solids: tuple[str, ...] = tuple(TRUTHS), share: float = 1.0) -> Iterator[Row]:
    for name in solids:
        truth = TRUTHS[name]
        planned = plan(truth.root, share * truth.resolution)
        bricks = sample_scene(planned)
        exact = contour(planned.root, bricks)
        bent, _ = refine(planned.root, exact, CHORD * planned.voxel, planned.voxel)
        made = {"marching cubes": extract(bricks), "exact": exact, f"exact, chord {CHORD:g} voxel": bent}
        for how, mesh in made.items():
            off = np.abs(reference(truth.root)(*mesh.vertices.T)) / planned.voxel
            errors = {"volume": mesh.volume / truth.volume - 1, "area": mesh.area / truth.area - 1}
            figures = {**errors, "mean |f|": off.mean(), "max |f|": off.max()}
            row = {"": name, "voxels": share * truth.resolution, "surface": how}
            yield {**row, **{key: f"{value:.1e}" for key, value in figures.items()}}
