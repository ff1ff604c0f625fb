"""Time of bricks of a union, per sample, with the elements near to them and with all.

The bricks are those near the surface of overlapping balls. Ratios of the shortest of interleaved runs on one
thread.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import numpy as np

from fracslice.fields.cpu import CpuKernel, compile_scene
from fracslice.formulas import Node, sphere, transform, union

from ..runner import Row, Run

RUNS = 10
SMALLEST = {"counts": (40,), "bricks": 20}
VOXELS = 128


def balls(count: int) -> Node:
    """Balls at random places, which overlap."""
    rng, radius = np.random.default_rng(0), 1.2 * count ** (-1 / 3)
    places = rng.uniform(-1, 1, (count, 3)).tolist()
    return union(*(transform(sphere(radius=radius), translate=tuple(place)) for place in places))


def corners(root: Node, most: int) -> np.ndarray:
    """Grid indices of bricks near the surface, int32 [n, 3]."""
    side = VOXELS // 8
    indices = 8 * (np.indices((side,) * 3).reshape(3, -1) - side // 2)
    middle = 2.4 / VOXELS * (indices + 3.5)
    near = np.abs(compile_scene(root).points(*middle)) < 2.4 * 7 / VOXELS
    return np.ascontiguousarray(np.random.default_rng(1).permutation(indices[:, near].T)[:most], np.int32)


def rows(run: Run, counts: tuple[int, ...] = (10, 100, 1000, 10000), bricks: int = 500) -> Iterator[Row]:
    for count in counts:
        root = balls(count)
        at = corners(root, bricks)
        out = np.empty((len(at), 512), np.float32)
        kernels = {"near": compile_scene(root), "all": CpuKernel(root.linked)}
        acts = {k: partial(one.bricks, at, (0.0,) * 3, 2.4 / VOXELS, out) for k, one in kernels.items()}
        spent = run.interleaved(acts)
        near, every = (spent.spread(k, "cpu_s").min for k in acts)
        yield {
            "": f"{count} balls",
            "all / near": every / near,
            "near, million samples/s": 1e-6 * out.size / near,
        }
