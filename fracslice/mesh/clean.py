"""Removal of triangles that rounding to float32 flattens or turns over; the surface stays closed."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._native import touching, turned
from ..formulas.algebra import dot, length
from .model import Mesh
from .quantisation import (
    NO_EDITS,
    NO_PLANES,
    UNMOVED,
    Edits,
    Frame,
    placed,
    quantise,
    welded,
)

PASSES = 8


class Cleaned(NamedTuple):
    """Result of `cleaned`.

    Attributes
    ----------
    mesh : Mesh
        Quantised and welded.
    suspects : ndarray of int64, shape (k,)
        Triangles that may intersect others, ascending: those that are not as they were contoured.
    edits : Edits
        Triangles of the original mesh that were edited or removed.
    """

    mesh: Mesh
    suspects: NDArray[np.int64]
    edits: Edits


def cleaned(
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

    Parameters
    ----------
    mesh : Mesh
        The mesh.
    keep : ndarray of bool, shape (n,)
        Vertices of the connected components that stay.
    fresh : ndarray of int64, shape (k,), optional
        Triangles that were not made by contouring, ascending.
    planes : ndarray of float64, shape (k, 3), optional
        Placed planes of the grid; see `quantise`.
    frame : Frame, optional
        Placement; none by default.
    between : tuple of float, optional
        Only triangles whose largest x is in this range are removed, low <= x < high, in the units of the
        mesh: elsewhere the surface may be cut open.
    threads : int, optional
        Threads; 0 for all cores.

    Raises
    ------
    MeshError
        If a coordinate is not finite or an index is out of range.
    """
    edits, gone = _mended(mesh, keep, frame, between, threads)
    displaced, keep = np.zeros(len(keep), bool), keep.copy()
    displaced[mesh.triangles[fresh]], keep[gone] = True, False
    final, displaced, places = quantise(mesh, keep, displaced, edits, planes, frame, threads)
    suspected = np.zeros(len(final.triangles), bool)
    suspected[touching(final.triangles, displaced, threads)] = suspected[places[places >= 0]] = True
    # Only displaced vertices can coincide with others.
    return Cleaned(welded(final) if displaced.any() else final, np.flatnonzero(suspected), edits)


def _mended(
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
        self.points = dict(zip(vertices.tolist(), placed(mesh.vertices[vertices], frame), strict=True))

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
