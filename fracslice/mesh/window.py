"""A surface that passes by in pieces, cleaned and checked as a whole one is by `clean` and `check`.

What a piece leaves near its end waits for the next one, so that whatever is mended, looked at or handed on
has its surroundings with it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from .certificate import Certificate
from .clean import cleaned
from .model import Mesh

if TYPE_CHECKING:
    from .check import MeshReport

WAITS, COUNTS, MENDS = 8.0, 4.0, 3.0
"""Voxels before the end of a piece: triangles beyond wait for the next; vertices up to there are counted now;
triangles up to there mended now. What is mended reaches three voxels at most: it never meets what is gone.
"""

NOTHING = Mesh(np.empty((0, 3)), np.empty((0, 3), np.int32))


@dataclass
class Tally:
    """Sums over what has passed, as `MeshReport` has them, but of edges their ends: twice as many."""

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


class Window:
    """Pieces of a mesh in mm go in, in turn along x; the finished triangles come out."""

    def __init__(self, voxel: float, threads: int | None = None) -> None:
        self.voxel, self.threads = voxel, threads
        self.waiting, self.end, self.holds = NOTHING, -np.inf, np.zeros(0, bool)
        self.low, self.high = np.full(3, np.inf), np.full(3, -np.inf)
        self.tally = Tally()

    def add(self, piece: Mesh, end: float, certificate: Certificate | None = None) -> Mesh:
        """Takes in the piece that ends at x = `end` (infinity for the last one), and what is known of it: all
        pieces are of one grid. Returns what is finished by it, rounded to float32; its edges to what has been
        returned before and to what comes are open.
        """
        before, self.end, known = self.end, end, certificate or Certificate.none(len(piece.triangles))
        whole = _joined(self.waiting, piece, before, self.voxel / 2)
        known = replace(known, holds=np.concatenate([self.holds, known.holds]))
        low, high = before - MENDS * self.voxel, end - MENDS * self.voxel
        final, proved, whole, known = cleaned(whole, known, low, high, self.threads or 0)
        x = final.vertices[:, 0]
        done = x[final.triangles].max(axis=1, initial=-np.inf) < end - WAITS * self.voxel
        counted = (x >= before - COUNTS * self.voxel) & (x < end - COUNTS * self.voxel)
        self._count(final, proved, done, counted)
        self.waiting, self.holds = whole.selected(~done), known.holds[~done]
        return final.selected(done)

    def _count(
        self,
        mesh: Mesh,
        proved: NDArray[np.bool_],
        done: NDArray[np.bool_],
        counted: NDArray[np.bool_],
    ) -> None:
        from .check import duplicates
        from .self_intersections import self_intersecting_triangles
        from .topology import edge_ends

        a, b, c = mesh.triangles.T
        distinct = (a != b) & (b != c) & (c != a)
        ends = edge_ends(mesh.triangles[distinct], counted)
        crossing = self_intersecting_triangles(mesh, threads=self.threads, among=~proved) & done
        tally, passed = self.tally, mesh.selected(done)
        area, volume, flat = passed.measures_from((0.0, 0.0, 0.0))
        tally.triangles += int(done.sum())
        tally.vertices += int(counted.sum())
        tally.open_edges += ends.open_edges
        tally.nonmanifold_edges += ends.non_manifold_edges
        tally.misoriented_edges += ends.misoriented_edges
        tally.nonmanifold_vertices += ends.non_manifold_vertices
        tally.self_intersections += int(crossing.sum())
        tally.searched_triangles += int((done & ~proved).sum())
        tally.degenerate_triangles += flat
        tally.duplicate_triangles += duplicates(mesh.triangles[crossing])
        tally.volume += volume
        tally.area += area
        if len(passed.vertices):
            low, high = passed.bounds
            self.low, self.high = np.minimum(self.low, low), np.maximum(self.high, high)

    def report(self, bodies: int, cavities: int, misplaced: int) -> MeshReport:
        """What `check` would say of the whole; the shells are counted elsewhere."""
        from .check import MeshReport

        tally, (low, high) = self.tally, (self.low.tolist(), self.high.tolist())
        manifold = not (tally.open_edges or tally.nonmanifold_edges or tally.nonmanifold_vertices)
        shells, euler = bodies + cavities, tally.vertices - tally.triangles // 2
        return MeshReport(
            triangles=tally.triangles,
            vertices=tally.vertices,
            watertight=not tally.open_edges,
            manifold=manifold,
            oriented=not (tally.misoriented_edges or misplaced),
            self_intersections=tally.self_intersections,
            searched_triangles=tally.searched_triangles,
            degenerate_triangles=tally.degenerate_triangles,
            duplicate_triangles=tally.duplicate_triangles,
            open_edges=tally.open_edges // 2,
            nonmanifold_edges=tally.nonmanifold_edges // 2,
            nonmanifold_vertices=tally.nonmanifold_vertices,
            misoriented_edges=tally.misoriented_edges // 2,
            misplaced_shells=misplaced,
            components=bodies,
            cavities=cavities,
            genus=shells - euler // 2 if manifold and not tally.misoriented_edges else None,
            volume_mm3=tally.volume,
            area_mm2=tally.area,
            bbox_mm=(tuple(low), tuple(high)),
        )


def _joined(one: Mesh, other: Mesh, seam: float, near: float) -> Mesh:
    """Two meshes as one: vertices at the seam that are equal, bit by bit, become one."""
    vertices = np.concatenate([one.vertices, other.vertices])
    triangles = np.concatenate([one.triangles, other.triangles + np.int32(len(one.vertices))])
    close = np.flatnonzero(np.abs(vertices[:, 0] - seam) < near)
    rows = np.ascontiguousarray(vertices[close]).view("V24").ravel()
    _, first, which = np.unique(rows, return_index=True, return_inverse=True)
    number = np.arange(len(vertices), dtype=np.int32)
    number[close] = close[first[which]]
    return Mesh(vertices, number[triangles]).selected(np.ones(len(triangles), dtype=bool))
