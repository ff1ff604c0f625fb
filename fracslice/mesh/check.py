"""Would this mesh print? A verdict with the numbers that prove it."""

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
    """What `check` found; every field is plain JSON. Counts of defects are zero on a good solid.

    watertight: every edge has two or more triangles; manifold: exactly two, and each vertex one fan;
    oriented: neighbours run the same way round and every shell looks out of the material. self_intersections
    counts the triangles that cut, touch or cover another; it was looked for at `searched_triangles`, and at
    the others it is excluded by construction. components counts outer bodies, cavities sealed shells inside
    them. genus is the sum over all shells, None where the surface is not a closed 2-manifold. bbox_mm is (low
    corner, high corner).
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
        """What is wrong, in plain words; empty for a mesh that prints."""
        counts = (
            (self.open_edges, "open edges (a hole in the surface)"),
            (self.nonmanifold_edges, "edges with more than two triangles"),
            (self.nonmanifold_vertices, "vertices where the surface touches itself"),
            (self.misoriented_edges, "edges between triangles that face opposite ways"),
            (self.misplaced_shells, "shells inside out or inside another body"),
            (self.self_intersections, "triangles that cut or touch others"),
            (self.degenerate_triangles, "triangles without area"),
            (self.duplicate_triangles, "triangles that repeat another"),
        )
        found = tuple(f"{count} {what}" for count, what in counts if count)
        return found if found or self.volume_mm3 > 0 else ("it encloses no volume",)

    @property
    def printable(self) -> bool:
        """Whether slicers take it as it is: closed, manifold, oriented, no crossings, positive volume."""
        return not self.problems

    def as_dict(self) -> dict[str, Any]:
        """The report for JSON, verdict included."""
        return asdict(self) | {"printable": self.printable, "problems": list(self.problems)}


def check_mesh(mesh: Mesh, *, threads: int | None = None) -> MeshReport:
    """Examine a mesh as its file will be read: rounded to float32, equal positions welded, nothing repaired.

    All counts are exact. Self-intersections take most of the time. Raises MeshError for a mesh without
    triangles, with an index out of range or a coordinate that is not finite.
    """
    if not len(mesh.triangles):
        raise MeshError("the mesh has no triangles")
    return check_quantised(quantised(mesh, threads or 0), None, threads or 0)


def check_quantised(mesh: Mesh, proved: NDArray[np.bool_] | None = None, threads: int = 0) -> MeshReport:
    """Examine a mesh that is quantised and welded, as `clean` makes it.

    proved: triangles of which no two intersect, bool [m]; none if nothing is known. Self-intersections are
    searched for at the others. Raises MeshError if no triangle has an area.
    """
    from fracslice.mesh.self_intersections import self_intersecting_triangles
    from fracslice.mesh.topology import component_sizes, connected_components, edge_topology

    area, _, flat = mesh.measured(threads)
    whole, searched = mesh, None if proved is None else ~proved
    if flat:
        a, b, c = mesh.triangles.T
        distinct = (a != b) & (b != c) & (c != a)
        whole = mesh.selected(distinct, threads)
        searched = None if searched is None else searched[distinct]
    if not len(whole.triangles):
        raise MeshError("the mesh has only triangles without area")
    link = edge_topology(whole.triangles, len(whole.vertices), threads)
    labels, shells = connected_components(whole.triangles, len(whole.vertices), threads)
    volumes, _ = component_sizes(whole.vertices, whole.triangles, labels, shells, threads)
    closed = not (link.open_edges or link.misoriented_edges)
    misplaced = _misplaced(whole, labels, volumes, threads) if closed else 0
    crossing = self_intersecting_triangles(whole, threads=threads, among=searched)
    cavities = int((volumes < 0).sum()) if closed else 0
    return MeshReport(
        triangles=len(mesh.triangles),
        vertices=len(mesh.vertices),
        watertight=link.open_edges == 0,
        manifold=not (link.open_edges or link.non_manifold_edges or link.non_manifold_vertices),
        oriented=not (link.misoriented_edges or misplaced),
        self_intersections=int(crossing.sum()),
        searched_triangles=len(whole.triangles) if searched is None else int(searched.sum()),
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
    """Shells whose outside is not empty space, or, for a cavity, not the material of one body."""
    from fracslice.mesh.nesting import nesting

    return int((nesting(mesh, labels, volumes, threads=threads).winding != (volumes < 0)).sum())


def duplicates(triangles: NDArray[np.int32]) -> int:
    """How many triangles have the three corners of an earlier one, in whatever order."""
    return len(triangles) - len(np.unique(np.sort(triangles, axis=1), axis=0))


def _genus(mesh: Mesh, edges: int, shells: int) -> int:
    """Handles of all shells together, by Euler's formula."""
    return shells - (len(mesh.vertices) - edges + len(mesh.triangles)) // 2


def _box(mesh: Mesh) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
    (x0, y0, z0), (x1, y1, z1) = mesh.bounds.tolist()
    return (x0, y0, z0), (x1, y1, z1)
