"""Printability check of a mesh: counts of defects, and a verdict."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..errors import MeshError
from .mesh_report import MeshReport
from .model import Mesh
from .quantisation import quantised


def check_mesh(mesh: Mesh, *, threads: int | None = None) -> MeshReport:
    """Check a mesh as a slicer reads its file: rounded to float32, equal positions welded, nothing repaired.

    All counts are exact. The search for self-intersections takes most of the time.

    Parameters
    ----------
    mesh : Mesh
        The mesh, mm.
    threads : int, optional
        Threads; all cores by default.

    Returns
    -------
    MeshReport
        Counts of defects, and measures.

    Raises
    ------
    MeshError
        For a mesh without triangles of an area, an index out of range or a coordinate that is not finite.
    """
    from .._native import connected_components
    from .halo import Finished
    from .tally import Tally
    from .topology import component_sizes

    if not len(mesh.triangles):
        raise MeshError("the mesh has no triangles")
    threads = threads or 0
    mesh = quantised(mesh, threads)
    sizes = mesh.sizes(threads)
    area, flat = float(sizes.areas[0]), int(sizes.flat[0])
    whole = mesh
    if flat:
        a, b, c = mesh.triangles.T
        whole = mesh.selected((a != b) & (b != c) & (c != a), threads)
    if not len(whole.triangles):
        raise MeshError("the mesh has only triangles without area")
    tally = Tally(threads)
    tally.add(Finished.whole(whole))
    labels, shells = connected_components(whole.triangles, len(whole.vertices), threads)
    volumes = component_sizes(whole.vertices, whole.triangles, labels, shells, threads).volumes
    closed = not (tally.open_edges or tally.misoriented_edges)
    cavities = int((volumes < 0).sum()) if closed else 0
    misplaced = _misplaced(whole, labels, volumes, threads) if closed else 0
    return replace(
        tally.report(shells - cavities, cavities, misplaced),
        triangles=len(mesh.triangles),
        vertices=len(mesh.vertices),
        degenerate_triangles=flat,
        volume_mm3=float(volumes.sum()),
        area_mm2=area,
        bbox_mm=_box(mesh),
    )


def _misplaced(mesh: Mesh, labels: NDArray[np.int32], volumes: NDArray[np.float64], threads: int) -> int:
    """Shells whose outside is neither empty space nor, for a cavity, the material of one body."""
    from .nesting import nesting

    return int((nesting(mesh, labels, volumes, threads=threads).winding != (volumes < 0)).sum())


def _box(mesh: Mesh) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
    """Low and high corner of the bounding box, as tuples."""
    (x0, y0, z0), (x1, y1, z1) = mesh.bounds.tolist()
    return (x0, y0, z0), (x1, y1, z1)
