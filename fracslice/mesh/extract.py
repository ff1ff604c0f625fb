"""Extraction of triangle meshes from samples."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..kernel import Field
from ..store import Arrays, stored
from ..volume.bricks import Bricks, SignBricks
from ..work import Work
from .contouring import Piece, SurfaceContours, call_native, layers, placement
from .model import Mesh


def extract(bricks: Bricks, threads: int = 0) -> Mesh:
    """Marching cubes of the samples, in scene units, without the field.

    The mesh is a closed, oriented 2-manifold without self-intersections for any samples, also after its
    coordinates are rounded to float32. Marching cubes (Lorensen and Cline, 1987) with a table without holes
    or self-intersections; `marching_cubes.h` has the proof.

    `bricks` in scene units. Returns `Mesh` in scene units.
    """
    from .._native import marching_cubes

    vertices, triangles = call_native(
        marching_cubes, bricks.ijk, bricks.values, bricks.index, *placement(bricks), threads
    )
    return Mesh(vertices, triangles)


def contour(root: Field, bricks: Bricks | SignBricks, work: Work | None = None) -> Mesh:
    """Exact surface of a scene, with sharp edges and corners.

    Each vertex on a grid edge is moved along it to the zero set of the float64 field. Where the normals in a
    cell differ, a vertex is placed at the intersection of the tangent planes and projected to the surface.
    The mesh is a closed, oriented 2-manifold without self-intersections, like that of `extract`; `contour.h`
    has the proof. After Ho, Wu, Chen, Chuang and Ouhyoung 2005, "Cubical Marching Squares".

    `bricks` in scene units. Returns `Mesh` in scene units.
    """
    return contour_whole(root, bricks, work).mesh


def contour_whole(root: Field, bricks: Bricks | SignBricks, work: Work | None = None) -> Piece:
    """Exact surface of a scene as one piece; see `contour`."""
    work, signs = work or Work(), bricks.signs if isinstance(bricks, Bricks) else bricks

    def made() -> Arrays:
        (piece,) = contour_pieces(root, signs, work, len(bricks))
        return {"vertices": piece.mesh.vertices, "triangles": piece.mesh.triangles, "blunt": piece.blunt}

    parts = ("contours", work.device, bricks.origin, bricks.voxel, bricks.index, bricks.ijk, signs.signs)
    arrays = stored(work.store, parts, root, made)
    return Piece(Mesh(arrays["vertices"], arrays["triangles"]), np.inf, arrays["blunt"])


def contour_pieces(
    root: Field, bricks: Bricks | SignBricks, work: Work | None = None, most: int = 1 << 14
) -> Iterator[Piece]:
    """Exact surface of a scene in pieces along x, with memory for one piece at a time.

    `bricks` in scene units.
    """
    work = work or Work()
    made = SurfaceContours(root, bricks.signs if isinstance(bricks, Bricks) else bricks, work.threads)
    refiner = made.refiner(work)
    for first, last in layers(made.signs, most):
        yield made.piece(first, last, refiner, work)
