"""CPU time of a mesh, layers and a picture of the same surface, of ten times as many elements.

A cube of overlapping blocks, with sharp seams, and a ball under bumps, with seams of 0.3 of their radii, on
one thread, each time of a tree that was not made before. Ratios are those of the shortest of interleaved runs
to those of the row above.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import partial
from itertools import count as count_from
from itertools import product

import numpy as np

from fracslice import make_mesh, render, slice_layers
from fracslice.formulas import Node, box, sphere, transform, union

from ..runner import Figures, Row, Run, timed

RUNS = 3
SMALLEST = {"counts": (40,), "solids": ("cube",), "resolution": 8}


def cube(count: int, width: float = 2.0) -> Node:
    """About so many blocks, each 1.2 times as wide as their distance, that fill a cube."""
    side = round(count ** (1 / 3))
    step = width / (side + 0.2)
    places = (np.arange(side) - (side - 1) / 2) * step
    block = box(size=(1.2 * step,) * 3)
    return union(*(transform(block, translate=place) for place in product(places.tolist(), repeat=3)))


def bumps(count: int, width: float = 2.0) -> Node:
    """So many balls, evenly spread on a ball, that cover it."""
    k = np.arange(count) + 0.5
    z, turn, radius = 1 - 2 * k / count, math.pi * (1 + math.sqrt(5)) * k, 1.5 * width / math.sqrt(count)
    across = np.sqrt(1 - z * z)
    places = width / 2 * np.stack([across * np.cos(turn), across * np.sin(turn), z], axis=1)
    balls = (transform(sphere(radius=radius), translate=tuple(place)) for place in places.tolist())
    return union(sphere(radius=width / 2), *balls, smooth=0.3 * radius)


SOLIDS = {"cube": cube, "bumps": bumps}

JOBS = {
    "mesh": lambda root, n: make_mesh(root, size="30mm", resolution=n, threads=1),
    "layers": lambda root, n: list(slice_layers(root, 30 / n, size="30mm", pixel=7.5 / n, threads=1)),
    "picture": lambda root, n: render(root, size=(3 * n, 2 * n), samples=2, threads=1),
}


TURNS = count_from(1)


def on_a_new_tree(job: str, solid: str, count: int, resolution: int) -> Figures:
    """Figures of a job on a tree of which nothing is known: one that was not made before."""
    root = SOLIDS[solid](count, 2 + 1e-6 * next(TURNS))
    return timed(partial(JOBS[job], root, resolution))


def rows(
    run: Run,
    counts: tuple[int, ...] = (100, 1000, 10000),
    solids: tuple[str, ...] = (*SOLIDS,),
    resolution: int = 128,
) -> Iterator[Row]:
    for solid in solids:
        pairs = [*product(JOBS, counts)]
        acts = {
            f"{job} {count}": partial(on_a_new_tree, job, solid, count, resolution) for job, count in pairs
        }
        spent = run.interleaved(acts)
        least = {pair: spent.spread(f"{pair[0]} {pair[1]}", "cpu_s").min for pair in pairs}
        for count, fewer in zip(counts, (0, *counts), strict=False):
            row: Row = {"": f"{solid} of {count:,}"}
            for job in JOBS:
                row[f"{job}, CPU s"] = least[job, count]
                row[f"{job} / above"] = least[job, count] / least[job, fewer] if fewer else None
            yield row
