"""Errors against closed forms, ours with and without exact contouring:
`python -m tests.benchmarks.mesh.accuracy`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fracslice.formulas import Node, box, julia, menger, sphere, torus, transform
from fracslice.kernel import reference
from fracslice.mesh import Mesh
from fracslice.mesh.extract import contour, extract
from fracslice.mesh.refine import refine
from fracslice.volume import plan, sample_scene

CHORD = 1e-3
"""Voxels."""


@dataclass(frozen=True)
class Truth:
    name: str
    root: Node
    resolution: float
    volume: float
    area: float


def ball(radius: float) -> tuple[float, float]:
    return 4 / 3 * math.pi * radius**3, 4 * math.pi * radius**2


TRUTHS = [
    Truth("unit sphere, 256", sphere(), 256, *ball(1)),
    Truth("torus 1 / 0.3, 192", torus(radius=1, tube=0.3), 192, 2 * math.pi**2 * 0.09, 4 * math.pi**2 * 0.3),
    Truth("box 1 x 2 x 0.7, 100", box(size=(1, 2, 0.7)), 100, 1.4, 8.2),
    Truth("turned box, 100", transform(box(size=(1, 1.3, 0.8)), rotate=(1, 2, 3, 37)), 100, 1.04, 6.28),
    Truth(
        "Menger level 3, 101.3",
        menger(level=3),
        101.3,
        8 * (20 / 27) ** 3,
        8 * (20 / 9) ** 3 + 16 * (8 / 9) ** 3,
    ),
    Truth(
        "Menger level 4, 213.3",
        menger(level=4),
        213.3,
        8 * (20 / 27) ** 4,
        8 * (20 / 9) ** 4 + 16 * (8 / 9) ** 4,
    ),
    Truth("Julia c = 0, 128", julia(c=(0, 0, 0, 0), iterations=12), 128, *ball(2 ** (1 / 4096))),
]


def errors(mesh: Mesh, truth: Truth, voxel: float) -> str:
    distance = np.abs(reference(truth.root)(*mesh.vertices.T)) / voxel
    volume, area = mesh.volume / truth.volume - 1, mesh.area / truth.area - 1
    return f"{volume:11.1e}{area:11.1e}{distance.mean():11.1e}{distance.max():11.1e}"


def main() -> None:
    print(
        f"{'':24}{'':16}{'volume':>11}{'area':>11}{'mean |f|':>11}{'max |f|':>11}"
        "   (|f| in voxels at the vertices)"
    )
    for truth in TRUTHS:
        planned = plan(truth.root, truth.resolution)
        bricks = sample_scene(planned)
        exact = contour(planned.root, bricks)
        bent, _ = refine(planned.root, exact, CHORD * planned.voxel, planned.voxel)
        for how, mesh in (("samples alone", extract(bricks)), ("exact", exact), ("exact, chord", bent)):
            print(f"{truth.name:24}{how:16}{errors(mesh, truth, planned.voxel)}")


if __name__ == "__main__":
    main()
