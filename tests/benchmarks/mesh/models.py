"""Triangle models as solids: reading, and distances a second and core, near the surface and anywhere.

The model is a ball with waves. Bricks of 8 x 8 x 8 points lie on the surface, with points 0.5, 1.5 and 5
edges apart; random points are within an edge of it, or anywhere in its box. Sides are compared with winding
numbers.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import trimesh

from fracslice.formulas import Node, model
from fracslice.mesh import Mesh, models
from fracslice.mesh.models import MeshField, read_mesh

from ..runner import Figures, Row, Run, timed

BRICKS, POINTS, APART = 100, 50_000, (0.5, 1.5, 5.0)
SMALLEST = {"levels": (2,)}
RNG = np.random.default_rng(0)


def waved(level: int) -> Mesh:
    ball = trimesh.creation.icosphere(level)
    x, y, _ = ball.vertices.T
    return Mesh(ball.vertices * (20 + 2 * np.sin(5 * x) * np.cos(4 * y))[:, None], ball.faces)


def loaded(path: str) -> Figures:
    models.solid.cache_clear()
    return timed(lambda: model(path).bounds)


def rate(count: int, ask: Callable[[], object]) -> Figures:
    """Points a second of this thread, millions."""
    start = time.thread_time()
    ask()
    seconds = time.thread_time() - start
    return {"cpu_s": seconds, "rate": count / seconds / 1e6}


def questions(root: Node, mesh: Mesh, edge: float) -> dict[str, Callable[[], Figures]]:
    kernel, asked = root.kernel(), {}
    on = mesh.vertices[RNG.integers(0, len(mesh.vertices), POINTS)]
    for apart in APART:
        corners = np.round(on[:BRICKS] / (apart * edge) - 4).astype(np.int32)
        out = np.empty((BRICKS, 512), np.float32)
        bricks = partial(kernel.bricks, corners, (0.0, 0.0, 0.0), apart * edge, out)
        asked[f"bricks, {apart:g} edges"] = partial(rate, out.size, bricks)
    near, anywhere = on + RNG.normal(size=on.shape) * edge, RNG.uniform(*mesh.bounds, on.shape)
    asked["random, near"] = partial(rate, POINTS, partial(kernel.points, *near.T))
    asked["random"] = partial(rate, POINTS, partial(kernel.points, *anywhere.T))
    return asked


def wrong(root: Node, mesh: Mesh, edge: float, points: int) -> int:
    """Points on another side than by the winding number."""
    on = mesh.vertices[RNG.integers(0, len(mesh.vertices), points // 2)]
    near, anywhere = on + RNG.normal(size=on.shape) * edge, RNG.uniform(*mesh.bounds, on.shape)
    tried = np.concatenate([near, anywhere])
    return int(
        (
            (root.distance(tried) < 0) != (MeshField(mesh).native.points(*np.ascontiguousarray(tried.T)) < 0)
        ).sum()
    )


def rows(run: Run, levels: tuple[int, ...] = (5, 8), points: int = 10**6) -> Iterator[Row]:
    with TemporaryDirectory() as folder:
        for level in levels:
            path = str(waved(level).export(Path(folder) / f"{level}.stl"))
            root, mesh = model(path), read_mesh(path)
            edge = float(np.sqrt(4 / np.sqrt(3) * mesh.area / len(mesh.triangles)))
            measured = run.interleaved({"load": partial(loaded, path), **questions(root, mesh, edge)})
            row: Row = {
                "": f"{len(mesh.triangles):,} triangles",
                "reading, CPU s": measured.spread("load", "cpu_s"),
            }
            rates = {name: measured.spread(name, "rate") for name in questions(root, mesh, edge)}
            yield {
                **row,
                **{f"M/s, {name}": one for name, one in rates.items()},
                "wrong sides": wrong(root, mesh, edge, points),
            }
