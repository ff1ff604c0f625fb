"""Time of bricks of a union, per sample, with the elements that matter there and with all.

The bricks are those near the surface of overlapping balls, with sharp seams and with seams of 0.3 radii, and
of these turned about no axis of the grid.
Ratios of the shortest of interleaved runs on one thread.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from itertools import product

import numpy as np

from fracslice.fields.cpu import CpuKernel, compile_scene
from fracslice.formulas import Node, sphere, transform, union

from ...examples import link_whole
from ..runner import Row, Run

RUNS = 10
SMALLEST = {"counts": (40,), "bricks": 20}
VOXELS = 128


def balls(count: int, seam: float, turn: float) -> Node:
    """Balls at random places, which overlap; `seam`: its width in radii; `turn`: in degrees."""
    rng, radius = np.random.default_rng(0), 1.2 * count ** (-1 / 3)
    places = rng.uniform(-1, 1, (count, 3)).tolist()
    parts = (transform(sphere(radius=radius), translate=tuple(place)) for place in places)
    return transform(union(*parts, smooth=seam * radius), rotate=(1, 2, 3, turn))


def corners(root: Node, most: int) -> np.ndarray:
    """Grid indices of bricks near the surface, int32 [n, 3]."""
    side = VOXELS // 8
    indices = 8 * (np.indices((side,) * 3).reshape(3, -1) - side // 2)
    middle = 2.4 / VOXELS * (indices + 3.5)
    near = np.abs(compile_scene(root).points(*middle)) < 2.4 * 7 / VOXELS
    return np.ascontiguousarray(np.random.default_rng(1).permutation(indices[:, near].T)[:most], np.int32)


def rows(
    run: Run,
    counts: tuple[int, ...] = (10, 100, 1000, 10000),
    seams: tuple[float, ...] = (0, 0.3),
    turns: tuple[float, ...] = (0, 50),
    bricks: int = 200,
) -> Iterator[Row]:
    for turn, seam, count in product(turns, seams, counts):
        root = balls(count, seam, turn)
        at = corners(root, bricks)
        out = np.empty((len(at), 512), np.float32)
        kernels = {"near": compile_scene(root), "all": CpuKernel(link_whole(root))}
        acts = {k: partial(one.bricks, at, (0.0,) * 3, 2.4 / VOXELS, out) for k, one in kernels.items()}
        spent = run.interleaved(acts)
        near, every = (spent.spread(k, "cpu_s").min for k in acts)
        yield {
            "": f"{count} balls, {'smooth' if seam else 'sharp'}{', turned' if turn else ''}",
            "all / near": every / near,
            "near, million samples/s": 1e-6 * out.size / near,
        }
