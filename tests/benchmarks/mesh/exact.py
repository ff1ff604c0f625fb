"""CPU seconds of the exact surface beside marching cubes on the same samples.

The ratio is that of samples and exact surface to samples and marching cubes. |f| at the vertices in voxels.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import numpy as np

from fracslice._native import Cells, Contouring
from fracslice.fields.field import Field
from fracslice.mesh.contouring import Crossings, Refiner, contour, extract, minimum_edge_parameter
from fracslice.scene import library, read
from fracslice.volume import plan, sample_scene

from ..runner import Row, Run, Spread

SMALLEST = {"scenes": ("menger-sponge",), "resolution": 16.0}


def edge_roots(root: Field, cells: Cells, place: tuple, end: int) -> Crossings:
    """All of them, exact."""
    return Refiner(root, cells, *place).between(0, end)


def triangles(cells: Cells, last: int, known: Crossings, place: tuple, clamped: float) -> None:
    """All layers through edge roots that are known: the features alone."""
    surface = Contouring(cells, -1, last, *place, clamped)
    surface.advance(last + 1, 0, known.t, known.normals)
    surface.finish()


def rows(
    run: Run,
    scenes: tuple[str, ...] = ("mandelbulb", "quaternion-julia", "menger-sponge"),
    resolution: float = 256.0,
) -> Iterator[Row]:
    for name in scenes:
        planned = plan(read(library.path(name)).root, resolution)
        bricks = sample_scene(planned)
        signs, last = bricks.signs, len(bricks.index)
        cells, place = Cells(signs.ijk, signs.signs, signs.index), (bricks.origin, bricks.voxel)
        roots = partial(edge_roots, planned.root, cells, place, cells.crossings_before(last))
        acts = {
            "samples": partial(sample_scene, planned),
            "marching cubes": partial(extract, bricks),
            "exact": partial(contour, planned.root, bricks),
            "of it: edge roots": roots,
            "of it: features": partial(triangles, cells, last, roots(), place, minimum_edge_parameter(signs)),
        }
        measured = run.interleaved(acts)
        parts = [
            [figures["cpu_s"] for figures in measured[key]] for key in ("samples", "marching cubes", "exact")
        ]
        ratio = Spread.of([(s + e) / (s + m) for s, m, e in zip(*parts, strict=True)])
        off = np.abs(
            planned.root.kernel("cpu", "float64").points(*contour(planned.root, bricks).vertices.T)
            / planned.voxel
        )
        spent = {key: measured.spread(key, "cpu_s") for key in acts}
        yield {
            "": name,
            **spent,
            "ratio": ratio,
            "mean |f|": f"{off.mean():.1e}",
            "max |f|": f"{off.max():.1e}",
        }
