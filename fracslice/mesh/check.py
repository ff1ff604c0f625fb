"""Printability check of a mesh: counts of defects, and a verdict."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fracslice.errors import MeshError
from fracslice.mesh.model import Mesh
from fracslice.mesh.quantisation import quantised


@dataclass(frozen=True)
class MeshReport:
    """Result of `check_mesh`; every field is plain JSON. Counts of defects are zero for a printable solid.

    Attributes
    ----------
    triangles, vertices : int
        Triangles and vertices of the quantised mesh.
    watertight : bool
        True if every edge joins at least two triangles.
    manifold : bool
        True if every edge joins exactly two triangles and the triangles at every vertex form one fan.
    oriented : bool
        True if adjacent triangles have the same orientation and every shell faces out of the material.
    self_intersections : int
        Triangles that cut, touch or cover another one.
    searched_triangles : int
        Triangles searched for self-intersections; at the others they are excluded by construction.
    degenerate_triangles : int
        Triangles without area.
    duplicate_triangles : int
        Triangles with the corners of an earlier one.
    open_edges : int
        Edges of one triangle.
    nonmanifold_edges : int
        Edges of more than two triangles.
    nonmanifold_vertices : int
        Vertices whose triangles form more than one fan.
    misoriented_edges : int
        Edges whose triangles have opposite orientations.
    misplaced_shells : int
        Shells that are inside out or inside another body.
    components : int
        Outer bodies.
    cavities : int
        Sealed shells inside bodies.
    genus : int or None
        Sum over all shells; None if the surface is not a closed 2-manifold.
    volume_mm3 : float
        Signed volume, mm3.
    area_mm2 : float
        Surface area, mm2.
    bbox_mm : tuple
        Low and high corner of the bounding box, mm.
    """

    triangles: int
    vertices: int
    watertight: bool
    manifold: bool
    oriented: bool
    self_intersections: int
    searched_triangles: int
    degenerate_triangles: int
    duplicate_triangles: int
    open_edges: int
    nonmanifold_edges: int
    nonmanifold_vertices: int
    misoriented_edges: int
    misplaced_shells: int
    components: int
    cavities: int
    genus: int | None
    volume_mm3: float
    area_mm2: float
    bbox_mm: tuple[tuple[float, float, float], tuple[float, float, float]]

    @property
    def problems(self) -> tuple[str, ...]:
        """Descriptions of the defects, tuple of str; empty for a printable mesh."""
        counts = (
            (self.open_edges, "open edges (a hole in the surface)"),
            (self.nonmanifold_edges, "edges with more than two triangles"),
            (self.nonmanifold_vertices, "vertices where the surface touches itself"),
            (self.misoriented_edges, "edges between triangles of opposite orientation"),
            (self.misplaced_shells, "shells inside out or inside another body"),
            (self.self_intersections, "triangles that cut or touch others"),
            (self.degenerate_triangles, "triangles without area"),
            (self.duplicate_triangles, "triangles that repeat another"),
        )
        problems = tuple(f"{count} {what}" for count, what in counts if count)
        return problems if problems or self.volume_mm3 > 0 else ("it encloses no volume",)

    @property
    def printable(self) -> bool:
        """True if the mesh is a closed, oriented manifold of positive volume without self-intersections."""
        return not self.problems

    def as_dict(self) -> dict[str, Any]:
        """Report as plain JSON, with the verdict.

        Returns
        -------
        dict
            All fields, `printable` and `problems`.
        """
        return asdict(self) | {"printable": self.printable, "problems": list(self.problems)}


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
    from fracslice.mesh.self_intersections import self_intersecting_triangles
    from fracslice.mesh.topology import component_sizes, connected_components, edge_topology

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
    link = edge_topology(whole.triangles, len(whole.vertices), threads)
    labels, shells = connected_components(whole.triangles, len(whole.vertices), threads)
    volumes = component_sizes(whole.vertices, whole.triangles, labels, shells, threads).volumes
    closed = not (link.open_edges or link.misoriented_edges)
    misplaced = _misplaced(whole, labels, volumes, threads) if closed else 0
    crossing = self_intersecting_triangles(whole, threads=threads)
    cavities = int((volumes < 0).sum()) if closed else 0
    return MeshReport(
        triangles=len(mesh.triangles),
        vertices=len(mesh.vertices),
        watertight=link.open_edges == 0,
        manifold=not (link.open_edges or link.non_manifold_edges or link.non_manifold_vertices),
        oriented=not (link.misoriented_edges or misplaced),
        self_intersections=int(crossing.sum()),
        searched_triangles=len(whole.triangles),
        degenerate_triangles=flat,
        duplicate_triangles=duplicates(whole.triangles[crossing]),
        open_edges=link.open_edges,
        nonmanifold_edges=link.non_manifold_edges,
        nonmanifold_vertices=link.non_manifold_vertices,
        misoriented_edges=link.misoriented_edges,
        misplaced_shells=misplaced,
        components=shells - cavities,
        cavities=cavities,
        genus=_genus(whole, link.edges, shells)
        if closed and not (link.non_manifold_edges or link.non_manifold_vertices)
        else None,
        volume_mm3=float(volumes.sum()),
        area_mm2=area,
        bbox_mm=_box(mesh),
    )


def _misplaced(mesh: Mesh, labels: NDArray[np.int32], volumes: NDArray[np.float64], threads: int) -> int:
    """Shells whose outside is neither empty space nor, for a cavity, the material of one body."""
    from fracslice.mesh.nesting import nesting

    return int((nesting(mesh, labels, volumes, threads=threads).winding != (volumes < 0)).sum())


def duplicates(triangles: NDArray[np.int32]) -> int:
    """Count triangles with the three corners of an earlier one, in any order.

    Parameters
    ----------
    triangles : ndarray of int32, shape (m, 3)
        Triangles.

    Returns
    -------
    int
        Duplicates.
    """
    distinct = np.unique(np.sort(triangles, axis=1), axis=0) if len(triangles) else triangles
    return len(triangles) - len(distinct)


def _genus(mesh: Mesh, edges: int, shells: int) -> int:
    """Sum of the genera of all shells, by Euler's formula."""
    return shells - (len(mesh.vertices) - edges + len(mesh.triangles)) // 2


def _box(mesh: Mesh) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
    """Low and high corner of the bounding box, as tuples."""
    (x0, y0, z0), (x1, y1, z1) = mesh.bounds.tolist()
    return (x0, y0, z0), (x1, y1, z1)
