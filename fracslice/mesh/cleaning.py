"""Rounding of coordinates to float32, welding, and removal of the triangles that it flattens or turns over,
piece by piece; the surface stays closed.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .. import _native
from .._native import touching, turned
from ..common.arrays import dot, length
from ..errors import MeshError
from ..volume.bricks import BRICK, SignBricks
from .model import Mesh
from .shells import concatenate_at_seam, strip

Frame = tuple[float, tuple[float, float, float], float]
"""Placement of vertices: scale, translation, and height below which they are moved to the bed, z = 0."""

UNMOVED: Frame = (1.0, (0.0, 0.0, 0.0), -np.inf)

NO_PLANES = np.empty((0, 3))

Edits = tuple[NDArray[np.int64], NDArray[np.int32]]
"""Edited triangles, ascending, and their corners, [k, 3]; -1 for removed ones."""

NO_EDITS: Edits = np.empty(0, np.int64), np.empty((0, 3), np.int32)


def grid_planes(signs: SignBricks) -> NDArray[np.float64]:
    """Planes of the grid that a mesh was contoured on.

    Contoured triangles do not intersect (`fracslice/native/mesh/contour.h`), nor do quantised ones if no
    vertex changes its position relative to these planes (`quantise.h`).

    Returns float64 (k, 3), scene units.
    """
    steps = np.arange(-BRICK, BRICK * (max(signs.index.shape) + 1) + 1)
    return np.array(signs.origin) + signs.voxel * steps[:, None]


class Quantised(NamedTuple):
    """Result of `quantise`."""

    mesh: Mesh  # quantised mesh
    displaced: NDArray[np.bool_]  # true for each displaced vertex: only these can coincide with others
    places: NDArray[np.int64]  # indices of the edited triangles; -1 for removed ones


def quantise_mesh(mesh: Mesh, threads: int = 0) -> Mesh:
    """Quantise and weld a mesh, as a reader of its STL does.

    Every triangle is kept, in order; unused vertices are removed. Quantise once, before the check and the
    export, so that both treat the same mesh.

    The coordinates are rounded to float32.
    """
    return weld(quantise(mesh, used_vertices(mesh), threads=threads).mesh)


def used_vertices(mesh: Mesh) -> NDArray[np.bool_]:
    """Vertices of triangles.

    Returns bool (n,).
    """
    if len(mesh.triangles) and not 0 <= mesh.triangles.min() <= mesh.triangles.max() < len(mesh.vertices):
        raise MeshError("a triangle names a vertex that does not exist")
    result = np.zeros(len(mesh.vertices), bool)
    result[mesh.triangles] = True
    return result


def quantise(
    mesh: Mesh,
    keep: NDArray[np.bool_],
    displaced: NDArray[np.bool_] | None = None,
    edits: Edits = NO_EDITS,
    planes: NDArray[np.float64] = NO_PLANES,
    frame: Frame = UNMOVED,
    threads: int = 0,
) -> Quantised:
    """Place the vertices of a mesh and round them to float32, without negative zeros.

    `keep`, `displaced`: bool (n,); `planes`: float64 (k, 3).
    """
    if displaced is None:
        displaced = np.zeros(len(keep), bool)
    try:
        vertices, triangles, moved, places = _native.quantise(
            mesh.vertices, mesh.triangles, keep, displaced, *edits, planes, frame, threads
        )
    except ValueError as error:
        raise MeshError(str(error)) from None
    return Quantised(Mesh(vertices, triangles), moved, places)


def place_and_round(points: NDArray[np.float64], frame: Frame) -> NDArray[np.float64]:
    """Place points and round them, as `quantise` does.

    `points`: float64 (n, 3). Returns float64 (n, 3).
    """
    scale, offset, bed = frame
    result = points * scale + np.array(offset)
    result[result[:, 2] < bed, 2] = 0
    rounded: NDArray[np.float64] = result.astype(np.float32).astype(np.float64) + 0.0
    return rounded


def weld(mesh: Mesh) -> Mesh:
    """Weld equal positions.

    `mesh`: mesh with float32 coordinates.
    """
    first, labels = _native.weld(mesh.vertices.astype(np.float32))
    return Mesh(mesh.vertices[first], labels[mesh.triangles]) if len(first) < len(mesh.vertices) else mesh


PASSES = 8


class Cleaned(NamedTuple):
    """Result of `clean`."""

    mesh: Mesh  # quantised and welded
    # triangles that may intersect others, ascending: those that are not as they were contoured
    suspects: NDArray[np.int64]
    edits: Edits  # triangles of the original mesh that were edited or removed


def clean(
    mesh: Mesh,
    keep: NDArray[np.bool_],
    fresh: NDArray[np.int64] = NO_EDITS[0],
    planes: NDArray[np.float64] = NO_PLANES,
    frame: Frame = UNMOVED,
    between: tuple[float, float] = (-np.inf, np.inf),
    threads: int = 0,
) -> Cleaned:
    """Place, clean and quantise a mesh, or a piece of one.

    A triangle with collinear corners gives its middle corner to the neighbour across its longest edge: an
    edge flip, which does not change the shape. A triangle with two coincident corners, or without a possible
    flip, is removed by collapsing its shortest edge. Neither is done where it would pinch the surface or turn
    a neighbour over (the link condition of Dey, Edelsbrunner, Guha and Nekhayev, "Topology preserving edge
    contraction", 1999). Triangles that cannot be removed stay, and `check_mesh` reports them. Equal positions
    are welded last.

    `keep`: bool (n,); `fresh`: int64 (k,); `planes`: float64 (k, 3).
    """
    edits, gone = _removal_edits(mesh, keep, frame, between, threads)
    displaced, keep = np.zeros(len(keep), bool), keep.copy()
    displaced[mesh.triangles[fresh]], keep[gone] = True, False
    final, displaced, places = quantise(mesh, keep, displaced, edits, planes, frame, threads)
    suspected = np.zeros(len(final.triangles), bool)
    suspected[touching(final.triangles, displaced, threads)] = suspected[places[places >= 0]] = True
    # Only displaced vertices can coincide with others.
    return Cleaned(weld(final) if displaced.any() else final, np.flatnonzero(suspected), edits)


def _removal_edits(
    mesh: Mesh, keep: NDArray[np.bool_], frame: Frame, between: tuple[float, float], threads: int
) -> tuple[Edits, list[int]]:
    """Edits that remove triangles which quantisation flattens or turns over, and the vertices removed."""
    suspects = turned(mesh.vertices, mesh.triangles, frame, threads)
    suspects = suspects[keep[mesh.triangles[suspects, 0]]]
    top = mesh.vertices[mesh.triangles[suspects], 0].max(axis=1, initial=-np.inf)
    bad = set(suspects[(between[0] <= top) & (top < between[1])].tolist())
    if not bad:
        return NO_EDITS, []
    surface = _Surface(mesh, frame, bad, threads)
    for _ in range(PASSES):
        for triangle in sorted(bad):
            surface.mend(triangle)
    return surface.edits, surface.gone


class _Surface:
    """The surface around bad triangles under local edits: the triangles at their corners, and those at the
    corners of these.
    """

    def __init__(self, mesh: Mesh, frame: Frame, bad: set[int], threads: int) -> None:
        self.bad = bad
        self.stars: dict[int, set[int]] = {}
        self.changed, self.removed, self.gone = set[int](), set[int](), list[int]()
        near = np.array(sorted(bad))
        for _ in range(2):
            marked = np.zeros(len(mesh.vertices), bool)
            marked[mesh.triangles[near]] = True
            near = touching(mesh.triangles, marked, threads)
        self.triangles = dict(zip(near.tolist(), mesh.triangles[near], strict=True))
        for triangle, corners in self.triangles.items():
            for vertex in corners.tolist():
                self.stars.setdefault(vertex, set()).add(triangle)
        vertices = np.array(list(self.stars))
        self.points = dict(
            zip(vertices.tolist(), place_and_round(mesh.vertices[vertices], frame), strict=True)
        )

    @property
    def edits(self) -> Edits:
        """Changed and removed triangles."""
        rows = sorted(self.changed | self.removed)
        corners = [(-1, -1, -1) if row in self.removed else self.triangles[row] for row in rows]
        return np.array(rows, np.int64), np.array(corners, np.int32).reshape(-1, 3)

    def star(self, vertex: int) -> set[int]:
        """The triangles around a vertex."""
        return self.stars[vertex]

    def ring(self, vertex: int) -> set[int]:
        """The vertices around a vertex."""
        around = {int(v) for triangle in self.star(vertex) for v in self.triangles[triangle]}
        return around - {vertex}

    def normal(self, corners: NDArray[np.int32]) -> NDArray[np.float64]:
        """Normal of a triangle, of twice its area."""
        a, b, c = (self.points[vertex] for vertex in corners.tolist())
        return np.cross(b - a, c - a)

    def mend(self, triangle: int) -> None:
        """Remove a bad triangle if it is still bad and an edit is possible."""
        if triangle not in self.bad:
            return
        a, b, c = (int(v) for v in self.triangles[triangle])
        by_length = sorted(((a, b), (b, c), (c, a)), key=lambda edge: self.length(*edge))
        if self.length(*by_length[0]) > 0 and self.flip(triangle, *by_length[2]):
            return
        any(self.collapse(*edge) or self.collapse(*edge[::-1]) for edge in by_length)

    def length(self, a: int, b: int) -> float:
        """Length of an edge."""
        return length(self.points[a] - self.points[b])

    def flip(self, triangle: int, a: int, c: int) -> bool:
        """Replace the triangle (a, b, c) and its neighbour (a, c, d) by two that share the edge (b, d)."""
        shared = self.star(a) & self.star(c)
        if len(shared) != 2:
            return False
        (other,) = shared - {triangle}
        b = _third(self.triangles[triangle], a, c)
        d = _third(self.triangles[other], a, c)
        if b == d or d in self.ring(b):
            return False
        old = self.normal(self.triangles[other])
        first = _with(self.triangles[other], c, b)  # a, b, d in the neighbour's orientation
        second = _with(self.triangles[other], a, b)
        if min(dot(self.normal(first), old), dot(self.normal(second), old)) <= 0:
            return False
        self.triangles[triangle], self.triangles[other] = first, second
        self.changed |= {triangle, other}
        self.bad -= {triangle, other}
        self.star(c).discard(triangle)
        self.star(a).discard(other)
        self.star(b).add(other)
        self.star(d).add(triangle)
        return True

    def collapse(self, kept: int, gone: int) -> bool:
        """Collapse an edge: merge the vertex `gone` into `kept`."""
        shared = self.star(kept) & self.star(gone)
        common = self.ring(kept) & self.ring(gone)
        if len(shared) != 2 or len(common) != 2:
            return False
        moved = self.star(gone) - shared
        new = {triangle: _with(self.triangles[triangle], gone, kept) for triangle in moved}
        if any(common <= set(corners.tolist()) for corners in new.values()):
            return False  # the rest of a tetrahedron
        opened = set()
        for triangle, corners in new.items():
            normal, old = self.normal(corners), self.normal(self.triangles[triangle])
            if old.any() and dot(normal, old) <= 0:
                return False
            if normal.any() and not old.any():
                opened.add(triangle)
        self.bad -= shared | opened
        self.changed |= moved
        for triangle, corners in new.items():
            self.triangles[triangle] = corners
        for vertex in common:
            self.star(vertex).difference_update(shared)
        self.star(kept).difference_update(shared)
        self.star(kept).update(moved)
        self.stars[gone] = set()
        self.removed |= shared
        self.gone.append(gone)
        return True


def _third(corners: NDArray[np.int32], a: int, b: int) -> int:
    """The corner of a triangle besides a and b."""
    (vertex,) = set(corners.tolist()) - {a, b}
    return int(vertex)


def _with(corners: NDArray[np.int32], old: int, new: int) -> NDArray[np.int32]:
    """Corners of a triangle with one vertex replaced."""
    return np.where(corners == old, np.int32(new), corners)


WAITS, MENDS = 7.5, 3.0
"""Distances from a seam, voxels. Triangles with a vertex nearer than the first are those of the halo;
triangles are cleaned up to the second. An edit reaches three voxels at most, so that it never meets triangles
beyond the halo.
"""

HALO = WAITS + 0.5
"""Width of the strips at the seams, voxels: wider than the halo that a neighbour takes of them."""


@dataclass(frozen=True, eq=False)
class Finished:
    """Finished triangles as a file holds them, among neighbouring ones."""

    mesh: Mesh  # finished triangles and neighbours, mm, quantised
    suspects: NDArray[np.int64]  # triangles that may intersect others, ascending
    # number of finished triangles; the first ones. Each triangle is finished once, in the order of the pieces
    done: int
    counted: NDArray[np.bool_]  # vertices with all their triangles in `mesh`. Each vertex is counted once

    @classmethod
    def whole(cls, mesh: Mesh, suspects: NDArray[np.int64] | None = None) -> Finished:
        """A whole mesh as one piece.

        `mesh` in mm; `suspects`: int64 (k,).
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


@dataclass(frozen=True, eq=False)
class SelectedPiece:
    """A piece with the choice of its bodies."""

    mesh: Mesh  # the piece, scene units
    keep: NDArray[np.bool_]  # vertices of the connected components that stay
    fresh: NDArray[np.int64]  # triangles that were not made by contouring, ascending

    def near(self, vertices: NDArray[np.bool_], threads: int) -> SelectedPiece:
        """Triangles that use some vertices.

        `vertices`: bool (n,).
        """
        part = strip(self.mesh, vertices, threads)
        fresh = np.flatnonzero(np.isin(part.rows, self.fresh))
        return SelectedPiece(part.mesh, self.keep[part.numbers], fresh)

    def then(self, other: SelectedPiece, seam: float, near: float) -> SelectedPiece:
        """Join the next piece; the triangles of this one come first."""
        mesh, number = concatenate_at_seam(self.mesh, other.mesh, seam, near)
        keep = np.concatenate([other.keep, self.keep])
        keep[number] |= keep  # a vertex of the seam may be unused in one of the pieces
        keep &= number == np.arange(len(number))
        return SelectedPiece(mesh, keep, np.concatenate([self.fresh, other.fresh + len(self.mesh.triangles)]))


def finished_piece(
    piece: SelectedPiece,
    before: SelectedPiece | None,
    after: SelectedPiece | None,
    ends: tuple[float, float],
    voxel: float,
    planes: NDArray[np.float64] = NO_PLANES,
    frame: Frame = UNMOVED,
    threads: int = 0,
) -> Finished:
    """Clean a piece.

    Every edit that changes a triangle of the piece is made, with all triangles that it depends on, in the
    order of the whole mesh. The neighbours make the same edits at the seams.

    `voxel` in scene units; `planes`: float64 (k, 3). Returns `Finished` in mm.
    """
    (start, end), whole, first, last = ends, piece, 0, len(piece.mesh.triangles)
    if before is not None:
        beside = before.near(before.mesh.vertices[:, 0] > start - WAITS * voxel, threads)
        first, last = (n + len(beside.mesh.triangles) for n in (first, last))
        whole = beside.then(whole, start, voxel / 2)
    if after is not None:
        beside = after.near(after.mesh.vertices[:, 0] < end + WAITS * voxel, threads)
        whole = whole.then(beside, end, voxel / 2)
    between = start - MENDS * voxel, end + MENDS * voxel
    mesh, keep = whole.mesh, whole.keep
    final, suspects, edits = clean(
        mesh, keep, whole.fresh, planes=planes, frame=frame, between=between, threads=threads
    )
    if before is None and after is None:
        return Finished.whole(final, suspects)
    triangles = mesh.triangles.copy()
    triangles[edits[0]] = edits[1]
    stays = keep[triangles[:, 0]] & (triangles[:, 0] >= 0)
    first, done = int(stays[:first].sum()), int(stays[first:last].sum())
    low, high = (frame[0] * x + frame[1][0] for x in ends)
    x = final.vertices[:, 0]
    own_first = Mesh(final.vertices, np.roll(final.triangles, -first, axis=0))
    moved = np.sort((suspects - first) % max(len(final.triangles), 1))
    return Finished(own_first, moved, done, (x >= low) & (x < high))
