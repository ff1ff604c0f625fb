"""Cleaning and checking of a surface in pieces, with the same result as `clean` and `check_mesh`.

The triangles near the end of a piece wait for the next one, so that triangles have all their neighbours when
they are cleaned, checked and handed on.
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
"""Distances from the end of a piece, voxels. Triangles with a vertex beyond the first wait for the next
piece; vertices are counted up to the second; triangles are cleaned up to the third. An edit reaches three
voxels at most, so that it never meets triangles that are gone.
"""


@dataclass(frozen=True, eq=False)
class Finished:
    """Finished triangles as a file holds them, among neighbouring ones.

    Attributes
    ----------
    mesh : Mesh
        Finished triangles and neighbours, mm, quantised.
    proved : ndarray of bool, shape (m,)
        Triangles of which no two intersect.
    done : ndarray of bool, shape (m,)
        Triangles finished with this piece. Each triangle is finished once, in the order of the pieces.
    counted : ndarray of bool, shape (n,)
        Vertices with all their triangles in `mesh`. Each vertex is counted once.
    """

    mesh: Mesh
    proved: NDArray[np.bool_]
    done: NDArray[np.bool_]
    counted: NDArray[np.bool_]

    @classmethod
    def whole(cls, mesh: Mesh, proved: NDArray[np.bool_] | None = None) -> Finished:
        """A whole mesh as one piece.

        Parameters
        ----------
        mesh : Mesh
            Quantised mesh, mm.
        proved : ndarray of bool, shape (m,), optional
            Triangles of which no two intersect; none by default.

        Returns
        -------
        Finished
            All triangles and vertices of the mesh.
        """
        count = len(mesh.triangles)
        known = np.zeros(count, bool) if proved is None else proved
        return cls(mesh, known, np.ones(count, bool), np.ones(len(mesh.vertices), bool))

    @property
    def passed(self) -> Mesh:
        """The finished triangles alone; open where neighbours belong to other pieces."""
        return self.mesh if self.done.all() else self.mesh.selected(self.done)


class Window:
    """Sliding window over the pieces of a mesh along x; finished triangles keep their order.

    Parameters
    ----------
    voxel : float
        Voxel, mm.
    threads : int, optional
        Threads; 0 for all cores.
    """

    def __init__(self, voxel: float, threads: int = 0) -> None:
        self._voxel, self._threads = voxel, threads
        self._waiting, self._holds, self._end = NOTHING, np.zeros(0, bool), -np.inf

    def add(self, piece: Mesh, end: float, known: Certificate | None = None) -> Finished:
        """Add a piece.

        Parameters
        ----------
        piece : Mesh
            The piece, mm.
        end : float
            x at which it ends; infinite for the last one.
        known : Certificate, optional
            Certificate of the piece. All pieces have the same grid.

        Returns
        -------
        Finished
            Triangles that are finished with this piece.
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
        """Add a piece.

        Parameters
        ----------
        piece : Finished
            The piece.
        """
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
        """Report on the whole mesh, as `check_mesh` returns it.

        Parameters
        ----------
        bodies, cavities, misplaced : int
            Counts of shells.

        Returns
        -------
        MeshReport
            The report.
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


def tips_last(meshes: Iterable[Mesh], tips: NDArray[np.float64]) -> Iterator[Mesh]:
    """Move the triangles at tips to the end, tip after tip, in the order of a mesh in one piece.

    Parameters
    ----------
    meshes : iterable of Mesh
        Pieces, mm, quantised.
    tips : ndarray of float64, shape (k, 3)
        Tips, mm, not rounded.

    Yields
    ------
    Mesh
        The pieces without triangles at tips, then these triangles.
    """
    places = {tuple(tip): number for number, tip in enumerate(tips.astype(np.float32).tolist())}
    late: list[tuple[int, NDArray[np.float64]]] = []
    for mesh in meshes:
        if not places:
            yield mesh
            continue
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
