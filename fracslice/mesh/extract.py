"""From samples to triangles."""

from __future__ import annotations

import numpy as np

from ..errors import MeshError
from ..volume.bricks import Bricks
from .model import Mesh


def extract(bricks: Bricks, threads: int = 0) -> Mesh:
    """The surface of the sampled solid, in scene units.

    The mesh is closed, an oriented 2-manifold, and does not cross itself, whatever the samples; it stays so when its
    coordinates are rounded to float32. threads: 0 for all cores; the mesh is the same for any number. Marching cubes
    (Lorensen and Cline, 1987) with a table without holes or crossings; `marching_cubes.h` has the proof.

    Raises `MeshError` if the samples are not closed, or need more than 2^31 vertices or triangles.
    """
    from .._native import marching_cubes

    x, y, z = (float(v) for v in bricks.origin)
    try:
        vertices, triangles, _, _ = marching_cubes(
            bricks.ijk, bricks.values, bricks.index, (x, y, z), bricks.voxel, clamp(bricks), threads
        )
    except ValueError as error:
        raise MeshError(f"cannot mesh the samples: {error}") from None
    return Mesh(vertices, triangles)


def clamp(bricks: Bricks) -> float:
    """How near a grid point a vertex may come, as a share of a voxel, so that no two are one in float32.

    Vertices of one cell differ by at least that share along some axis; four float32 steps survive any rounding.
    Raises `MeshError` where float32 has no such steps.
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
