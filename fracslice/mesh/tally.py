"""Sums over the finished pieces of a mesh."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from .._native import bounds
from ..formulas.algebra import dot
from .halo import Finished
from .mesh_report import MeshReport


@dataclass
class Tally:
    """Sums over finished pieces; fields as in `MeshReport`, but edges count by their ends, twice each."""

    threads: int = 0
    triangles: int = 0
    vertices: int = 0
    open_edges: int = 0
    nonmanifold_edges: int = 0
    misoriented_edges: int = 0
    nonmanifold_vertices: int = 0
    self_intersections: int = 0
    searched_triangles: int = 0
    degenerate_triangles: int = 0
    duplicate_triangles: int = 0
    volume: float = 0.0
    area: float = 0.0
    low: tuple[float, ...] = (np.inf,) * 3
    high: tuple[float, ...] = (-np.inf,) * 3

    def add(self, piece: Finished) -> None:
        """Add a piece."""
        from .self_intersections import self_intersecting_triangles
        from .topology import edge_ends

        mesh, passed = piece.mesh, piece.passed
        ends = edge_ends(mesh.triangles, piece.counted, self.threads)
        crossing = np.empty(0, np.int64)
        if len(piece.suspects):
            among = None
            if len(piece.suspects) < len(mesh.triangles):
                among = np.zeros(len(mesh.triangles), bool)
                among[piece.suspects] = True
            crosses = self_intersecting_triangles(mesh, threads=self.threads, among=among)
            crossing = np.flatnonzero(crosses[: piece.done])
        sizes = passed.sizes(self.threads)
        apex = passed.vertices[sizes.outermost[0, 0]] if len(passed.triangles) else np.zeros(3)
        self.triangles += len(passed.triangles)
        self.vertices += len(piece.points)
        self.open_edges += ends.open_edges
        self.nonmanifold_edges += ends.non_manifold_edges
        self.misoriented_edges += ends.misoriented_edges
        self.nonmanifold_vertices += ends.non_manifold_vertices
        self.self_intersections += len(crossing)
        self.searched_triangles += int(np.searchsorted(piece.suspects, piece.done))
        self.degenerate_triangles += int(sizes.flat[0])
        self.duplicate_triangles += _duplicates(mesh.triangles[crossing])
        self.volume += float(sizes.volumes[0] + dot(apex, sizes.vectors[0]) / 3)  # cones over the origin
        self.area += float(sizes.areas[0])
        if len(piece.points):
            low, high = bounds(piece.points, self.threads)
            self.low = tuple(np.minimum(self.low, low).tolist())
            self.high = tuple(np.maximum(self.high, high).tolist())

    def include(self, other: Tally) -> None:
        """Add the sums over other pieces."""
        for name in (f.name for f in fields(self)):
            if name not in ("threads", "low", "high"):
                setattr(self, name, getattr(self, name) + getattr(other, name))
        self.low = tuple(np.minimum(self.low, other.low).tolist())
        self.high = tuple(np.maximum(self.high, other.high).tolist())

    def report(self, bodies: int, cavities: int, misplaced: int) -> MeshReport:
        """Report on the whole mesh, as `check_mesh` returns it.

        Parameters
        ----------
        bodies, cavities, misplaced : int
            Counts of shells.
        """
        manifold = not (self.open_edges or self.nonmanifold_edges or self.nonmanifold_vertices)
        shells, euler = bodies + cavities, self.vertices - self.triangles // 2
        (x0, y0, z0), (x1, y1, z1) = self.low, self.high
        return MeshReport(
            triangles=self.triangles,
            vertices=self.vertices,
            watertight=not self.open_edges,
            manifold=manifold,
            oriented=not (self.misoriented_edges or misplaced),
            self_intersections=self.self_intersections,
            searched_triangles=self.searched_triangles,
            degenerate_triangles=self.degenerate_triangles,
            duplicate_triangles=self.duplicate_triangles,
            open_edges=self.open_edges // 2,
            nonmanifold_edges=self.nonmanifold_edges // 2,
            nonmanifold_vertices=self.nonmanifold_vertices,
            misoriented_edges=self.misoriented_edges // 2,
            misplaced_shells=misplaced,
            components=bodies,
            cavities=cavities,
            genus=shells - euler // 2 if manifold and not self.misoriented_edges else None,
            volume_mm3=self.volume,
            area_mm2=self.area,
            bbox_mm=((x0, y0, z0), (x1, y1, z1)),
        )


def _duplicates(triangles: NDArray[np.int32]) -> int:
    """Number of triangles with the three corners of an earlier one, in any order."""
    distinct = np.unique(np.sort(triangles, axis=1), axis=0) if len(triangles) else triangles
    return len(triangles) - len(distinct)
