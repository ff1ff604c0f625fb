"""Cleaning and checking of a surface in pieces, with the same result as `clean` and `check_mesh`.

The triangles near the end of a piece wait for the next one, so that triangles have all their neighbours when
they are cleaned, checked and handed on.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from .._native import bounds, touching
from ..formulas.algebra import dot
from .check import MeshReport, duplicates
from .clean import cleaned
from .model import Mesh
from .pieces import NOTHING, seamed
from .quantisation import NO_EDITS, NO_PLANES, UNMOVED, Frame

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
    suspects : ndarray of int64, shape (k,)
        Triangles that may intersect others, ascending.
    done : int
        Number of finished triangles; the first ones. Each triangle is finished once, in the
        order of the pieces.
    counted : ndarray of bool, shape (n,)
        Vertices with all their triangles in `mesh`. Each vertex is counted once.
    """

    mesh: Mesh
    suspects: NDArray[np.int64]
    done: int
    counted: NDArray[np.bool_]

    @classmethod
    def whole(cls, mesh: Mesh, suspects: NDArray[np.int64] | None = None) -> Finished:
        """A whole mesh as one piece.

        Parameters
        ----------
        mesh : Mesh
            Quantised mesh, mm.
        suspects : ndarray of int64, shape (k,), optional
            Triangles that may intersect others; all by default.

        Returns
        -------
        Finished
            All triangles and vertices of the mesh.
        """
        count = len(mesh.triangles)
        return cls(
            mesh, np.arange(count) if suspects is None else suspects, count, np.ones(len(mesh.vertices), bool)
        )

    @cached_property
    def passed(self) -> Mesh:
        """The finished triangles, among vertices of others too; open where their neighbours are."""
        mesh = self.mesh
        return mesh if self.done == len(mesh.triangles) else Mesh(mesh.vertices, mesh.triangles[: self.done])

    @cached_property
    def points(self) -> NDArray[np.float64]:
        """The counted vertices, float64 [k, 3]."""
        vertices = self.mesh.vertices
        return vertices if self.counted.all() else vertices[self.counted]


class Window:
    """Sliding window over the pieces of a mesh along x; finished triangles keep their order.

    Parameters
    ----------
    voxel : float
        Voxel, in the units of the pieces.
    planes : ndarray of float64, shape (k, 3), optional
        Placed planes of the grid that the pieces were contoured on.
    frame : Frame, optional
        Placement; none by default.
    threads : int, optional
        Threads; 0 for all cores.
    """

    def __init__(
        self,
        voxel: float,
        planes: NDArray[np.float64] = NO_PLANES,
        frame: Frame = UNMOVED,
        threads: int = 0,
    ) -> None:
        self._voxel, self._planes, self._frame, self._threads = voxel, planes, frame, threads
        self._waiting, self._end = NOTHING, -np.inf
        self._fresh = self._edited = NO_EDITS[0]

    def add(
        self,
        piece: Mesh,
        end: float,
        keep: NDArray[np.bool_] | None = None,
        fresh: NDArray[np.int64] = NO_EDITS[0],
    ) -> Finished:
        """Add a piece.

        Parameters
        ----------
        piece : Mesh
            The piece.
        end : float
            x at which it ends; infinite for the last one.
        keep : ndarray of bool, shape (n,), optional
            Vertices of the connected components that stay; all by default.
        fresh : ndarray of int64, shape (k,), optional
            Triangles that were not made by contouring, ascending.

        Returns
        -------
        Finished
            Triangles that are finished with this piece.
        """
        before, self._end, voxel = self._end, end, self._voxel
        keep, waiting, whole = (
            np.ones(len(piece.vertices), bool) if keep is None else keep,
            self._waiting,
            piece,
        )
        if len(waiting.triangles):
            whole, number = seamed(waiting, piece, before, voxel / 2)
            keep = np.concatenate([keep, np.ones(len(waiting.vertices), bool)])
            keep &= number == np.arange(len(number))
            fresh = np.concatenate([self._fresh, fresh + len(waiting.triangles)])
        between = before - MENDS * voxel, end - MENDS * voxel
        final, suspects, edits = cleaned(
            whole, keep, fresh, self._edited, self._planes, self._frame, between, self._threads
        )
        if -before == end == np.inf:
            return Finished.whole(final, suspects)
        low, high, wait = (
            self._frame[0] * x + self._frame[1][0]
            for x in (before - COUNTS * voxel, end - COUNTS * voxel, end - WAITS * voxel)
        )
        x = final.vertices[:, 0]
        waits = touching(final.triangles, x >= wait, self._threads)
        done = int(waits[0]) if len(waits) else len(final.triangles)
        triangles = whole.triangles.copy()
        triangles[edits[0]] = edits[1]
        rest = np.flatnonzero(keep[triangles[:, 0]] & (triangles[:, 0] >= 0))[done:]
        self._waiting = Mesh(whole.vertices, triangles[rest]).compact()
        self._fresh, self._edited = (np.flatnonzero(np.isin(rest, some)) for some in (fresh, edits[0]))
        return Finished(final, suspects, done, (x >= low) & (x < high))


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
        ends = edge_ends(mesh.triangles, piece.counted, self.threads)
        crossing = np.empty(0, np.int64)
        if len(piece.suspects):
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
        self.duplicate_triangles += duplicates(mesh.triangles[crossing])
        self.volume += float(sizes.volumes[0] + dot(apex, sizes.vectors[0]) / 3)  # cones over the origin
        self.area += float(sizes.areas[0])
        if len(piece.points):
            low, high = bounds(piece.points, self.threads)
            self.low = tuple(np.minimum(self.low, low).tolist())
            self.high = tuple(np.maximum(self.high, high).tolist())

    def include(self, other: Tally) -> None:
        """Add the sums over other pieces.

        Parameters
        ----------
        other : Tally
            The sums.
        """
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
    late: list[tuple[int, NDArray[np.float64]]] = []
    for mesh in meshes:
        of = at_tips(mesh, tips)
        at = np.flatnonzero(of >= 0)
        late += zip(of[at].tolist(), mesh.corners[at], strict=True)
        yield mesh.selected(of < 0) if len(at) else mesh
    if late:
        yield by_tip(late)


def at_tips(mesh: Mesh, tips: NDArray[np.float64]) -> NDArray[np.int64]:
    """Find the triangles at tips.

    Parameters
    ----------
    mesh : Mesh
        A piece, mm, quantised.
    tips : ndarray of float64, shape (k, 3)
        Tips, mm, not rounded.

    Returns
    -------
    ndarray of int64, shape (m,)
        Tip of each triangle, or -1.
    """
    if not len(tips):
        return np.full(len(mesh.triangles), -1)
    places = {tuple(tip): number for number, tip in enumerate(tips.astype(np.float32).tolist())}
    near = np.flatnonzero(np.isin(mesh.vertices[:, 0], [tip[0] for tip in places]))
    of_vertex = np.full(len(mesh.vertices), -1)
    of_vertex[near] = [places.get(tuple(point), -1) for point in mesh.vertices[near].tolist()]
    of_triangle: NDArray[np.int64] = of_vertex[mesh.triangles].max(axis=1, initial=-1)
    return of_triangle


def by_tip(triangles: list[tuple[int, NDArray[np.float64]]]) -> Mesh:
    """Mesh of triangles at tips, tip after tip.

    Parameters
    ----------
    triangles : list of tuple
        Tip and corners of each triangle.

    Returns
    -------
    Mesh
        The triangles, unconnected.
    """
    corners = np.array([corners for _, corners in sorted(triangles, key=lambda pair: pair[0])])
    count = 3 * len(corners)
    return Mesh(corners.reshape(-1, 3), np.arange(count, dtype=np.int32).reshape(-1, 3))
