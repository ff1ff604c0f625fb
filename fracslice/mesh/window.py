"""A surface that passes by in pieces, or in one: cleaned and counted as `clean` and `check` do.

What a piece leaves near its end waits for the next one, so that whatever is mended, looked at or handed on
has its surroundings with it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from .certificate import Certificate
from .check import MeshReport, duplicates
from .clean import cleaned
from .model import Mesh
from .pieces import NOTHING, joined

WAITS, COUNTS, MENDS = 7.5, 4.0, 3.0
"""Voxels before the end of a piece: triangles beyond wait for the next; vertices up to there are counted now;
triangles up to there mended now. What is mended reaches three voxels at most: it never meets what is gone.
"""


@dataclass(frozen=True, eq=False)
class Finished:
    """Triangles as a file holds them, mm, amid others around them.

    done: bool [m], which triangles are finished with this piece: in the order of the pieces', none of them
    twice. counted: bool [n], the vertices whose triangles are all here, each of them once. proved: bool [m],
    triangles of which no two intersect.
    """

    mesh: Mesh
    proved: NDArray[np.bool_]
    done: NDArray[np.bool_]
    counted: NDArray[np.bool_]

    @classmethod
    def whole(cls, mesh: Mesh, proved: NDArray[np.bool_] | None = None) -> Finished:
        """All of a mesh."""
        count = len(mesh.triangles)
        known = np.zeros(count, bool) if proved is None else proved
        return cls(mesh, known, np.ones(count, bool), np.ones(len(mesh.vertices), bool))

    @property
    def passed(self) -> Mesh:
        """The finished triangles; their edges to those of other pieces are open."""
        return self.mesh if self.done.all() else self.mesh.selected(self.done)


class Window:
    """Pieces of a mesh in mm go in, in turn along x; finished triangles come out, in the same order."""

    def __init__(self, voxel: float, threads: int = 0) -> None:
        self._voxel, self._threads = voxel, threads
        self._waiting, self._holds, self._end = NOTHING, np.zeros(0, bool), -np.inf

    def add(self, piece: Mesh, end: float, known: Certificate | None = None) -> Finished:
        """Take in the piece that ends at x = `end`, infinity for the last; return what is finished by it.

        known: what is certified of the piece; all pieces are of one grid.
        """
        before, self._end, voxel = self._end, end, self._voxel
        known, whole = known or Certificate.none(len(piece.triangles)), piece
        if len(self._waiting.triangles):
            whole = joined(self._waiting, piece, before, voxel / 2)
            known = replace(known, holds=np.concatenate([self._holds, known.holds]))
        low, high = before - MENDS * voxel, end - MENDS * voxel
        final, proved, whole, known = cleaned(whole, known, low, high, self._threads)
        if -before == end == np.inf:
            return Finished.whole(final, proved)
        x = final.vertices[:, 0]
        waits = x[final.triangles].max(axis=1, initial=-np.inf) >= end - WAITS * voxel
        done = np.logical_not(np.logical_or.accumulate(waits))
        counted = (x >= before - COUNTS * voxel) & (x < end - COUNTS * voxel)
        self._waiting, self._holds = whole.selected(~done), known.holds[~done]
        return Finished(final, proved, done, counted)


@dataclass
class Tally:
    """Sums over finished pieces, as `MeshReport` has them, but of edges their ends: twice as many."""

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
        """Count a piece."""
        from .self_intersections import self_intersecting_triangles
        from .topology import edge_ends

        mesh, passed = piece.mesh, piece.passed
        a, b, c = mesh.triangles.T
        distinct = (a != b) & (b != c) & (c != a)
        ends = edge_ends(mesh.triangles if distinct.all() else mesh.triangles[distinct], piece.counted)
        searched = ~piece.proved
        crossing = self_intersecting_triangles(mesh, threads=self.threads, among=searched) & piece.done
        area, volume, flat = passed.measures_from((0.0, 0.0, 0.0), self.threads)
        self.triangles += len(passed.triangles)
        self.vertices += int(piece.counted.sum())
        self.open_edges += ends.open_edges
        self.nonmanifold_edges += ends.non_manifold_edges
        self.misoriented_edges += ends.misoriented_edges
        self.nonmanifold_vertices += ends.non_manifold_vertices
        self.self_intersections += int(crossing.sum())
        self.searched_triangles += int((searched & piece.done).sum())
        self.degenerate_triangles += flat
        self.duplicate_triangles += duplicates(mesh.triangles[crossing])
        self.volume += volume
        self.area += area
        if len(passed.vertices):
            low, high = passed.bounds
            self.low = tuple(np.minimum(self.low, low).tolist())
            self.high = tuple(np.maximum(self.high, high).tolist())

    def report(self, bodies: int, cavities: int, misplaced: int) -> MeshReport:
        """What `check` would say of the whole; the shells are counted elsewhere."""
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


def tips_last(meshes: Iterable[Mesh], tips: NDArray[np.float64]) -> Iterator[Mesh]:
    """The same triangles, those at tips last, tip after tip, as they are where all is one piece.

    tips: [k, 3], mm, not rounded.
    """
    places = {tuple(tip): number for number, tip in enumerate(tips.astype(np.float32).tolist())}
    late: list[tuple[int, NDArray[np.float64]]] = []
    for mesh in meshes:
        near = np.flatnonzero(np.isin(mesh.vertices[:, 0], [tip[0] for tip in places]))
        of_vertex = np.full(len(mesh.vertices), -1)
        of_vertex[near] = [places.get(tuple(point), -1) for point in mesh.vertices[near].tolist()]
        of = of_vertex[mesh.triangles].max(axis=1, initial=-1)
        at = np.flatnonzero(of >= 0)
        late += zip(of[at].tolist(), mesh.corners[at], strict=True)
        yield mesh.selected(of < 0) if len(at) else mesh
    if late:
        corners = np.array([corners for _, corners in sorted(late, key=lambda pair: pair[0])])
        count = 3 * len(corners)
        yield Mesh(corners.reshape(-1, 3), np.arange(count, dtype=np.int32).reshape(-1, 3))
