"""From samples to triangles."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ..errors import MeshError
from ..formulas.registry import Node
from ..volume.bricks import Bricks
from ..volume.crossings import refine_crossings
from ..volume.settling import settle
from ..work import Work
from .model import Mesh


def extract(bricks: Bricks, threads: int = 0) -> Mesh:
    """The surface of the sampled solid, in scene units, from the samples alone.

    The mesh is closed, an oriented 2-manifold, and does not cross itself, whatever the samples; it stays so
    when its coordinates are rounded to float32. threads: 0 for all cores; the mesh is the same for any
    number. Marching cubes (Lorensen and Cline, 1987) with a table without holes or crossings;
    `marching_cubes.h` has the proof.

    Raises `MeshError` if the samples are not closed, or need more than 2^31 vertices or triangles.
    """
    from .._native import marching_cubes

    vertices, triangles, *_ = _called(marching_cubes, *_arrays(bricks), *_placement(bricks), threads)
    return Mesh(vertices, triangles)


def contour(root: Node, bricks: Bricks, work: Work | None = None) -> Mesh:
    """The exact surface of a scene, in scene units, its edges and corners sharp.

    root: the scene that `bricks` were sampled from. Every vertex on a grid edge is moved along it to the zero
    set of the float64 field; where the normals in a cell differ, a vertex is put where their planes meet,
    and settled. Closed, an oriented 2-manifold, and free of crossings like `extract`; `contour.h` has the
    proof. After Ho, Wu, Chen, Chuang and Ouhyoung 2005, "Cubical Marching Squares". Raises `MeshError` as
    `extract`, and `Cancelled`.
    """
    from .._native import contour as build
    from .._native import crossed_edges

    work = work or Work()
    lower, axis = _called(crossed_edges, *_arrays(bricks), work.threads)
    exact = refine_crossings(root, bricks.origin, bricks.voxel, lower, axis, work)
    work.check()
    vertices, triangles, crossings, _ = _called(
        build, *_arrays(bricks), exact.t, exact.normals, *_placement(bricks), work.threads
    )
    work.check()
    low, high = _room(vertices[crossings:], bricks)
    vertices[crossings:] = settle(root, vertices[crossings:], low, high, bricks.voxel, work)
    return Mesh(vertices, triangles)


def _room(points: np.ndarray, bricks: Bricks) -> tuple[np.ndarray, np.ndarray]:
    """How far a vertex within a cell, or within a cell's face, may move: strictly inside it."""
    origin, voxel, margin = np.asarray(bricks.origin), bricks.voxel, clamp(bricks)
    grid = (points - origin) / voxel
    flat = np.abs(grid - np.round(grid)) < margin / 2
    low = np.where(flat, points, origin + voxel * (np.floor(grid) + margin))
    high = np.where(flat, points, origin + voxel * (np.floor(grid) + 1 - margin))
    return low, high


def clamp(bricks: Bricks) -> float:
    """How near a grid point a vertex may come, as a share of a voxel, so that no two are one in float32.

    Vertices of one cell differ by at least that share along some axis; four float32 steps survive any
    rounding. Raises `MeshError` where float32 has no such steps.
    """
    low = np.asarray(bricks.origin, dtype=np.float64)
    high = low + bricks.voxel * 8 * np.asarray(bricks.index.shape)
    extent = np.float32(max(np.abs(low).max(), np.abs(high).max()))
    share = max(1e-4, 4 * float(np.spacing(extent)) / bricks.voxel)
    if share >= 0.5:
        raise MeshError(
            f"a voxel of {bricks.voxel:g} at a distance of {extent:g} is too fine for float32 coordinates"
        )
    return share


def _arrays(bricks: Bricks) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    return bricks.ijk, bricks.values, bricks.index


def _placement(bricks: Bricks) -> tuple[tuple[float, ...], float, float]:
    return tuple(float(v) for v in bricks.origin), float(bricks.voxel), clamp(bricks)


def _called(function: Callable[..., Any], *arguments: Any) -> Any:
    try:
        return function(*arguments)
    except ValueError as error:
        raise MeshError(f"cannot mesh the samples: {error}") from None
