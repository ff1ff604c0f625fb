"""Removal of triangles that rounding to float32 flattens or turns over; the surface stays closed."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fracslice._native import touching, turned
from fracslice.formulas.algebra import dot, length
from fracslice.mesh.certificate import Certificate
from fracslice.mesh.model import Mesh
from fracslice.mesh.quantisation import quantise, welded

PASSES = 8


def clean(mesh: Mesh) -> Mesh:
    """Round a closed, oriented manifold to float32 and remove the triangles that this flattens or turns over.

    A triangle with collinear corners gives its middle corner to the neighbour across its longest edge: an
    edge flip, which does not change the shape. A triangle with two coincident corners, or without a possible
    flip, is removed by collapsing its shortest edge. Neither is done where it would pinch the surface or turn
    a neighbour over (the link condition of Dey, Edelsbrunner, Guha and Nekhayev, "Topology preserving edge
    contraction", 1999). Triangles that cannot be removed stay, and `check_mesh` reports them. Equal positions
    are welded last.

    Parameters
    ----------
    mesh : Mesh
        Closed, oriented manifold, mm.

    Returns
    -------
    Mesh
        Quantised and welded.

    Raises
    ------
    MeshError
        If a coordinate is not finite or an index is out of range.
    """
    return cleaned(mesh, Certificate.none(len(mesh.triangles))).mesh


class Cleaned(NamedTuple):
    """Result of `cleaned`.

    Attributes
    ----------
    mesh : Mesh
        Quantised and welded.
    proved : ndarray of bool, shape (m,)
        Triangles of which no two intersect.
    exact : Mesh
        The same triangles before quantisation.
    certificate : Certificate
        Certificate of `exact`.
    """

    mesh: Mesh
    proved: NDArray[np.bool_]
    exact: Mesh
    certificate: Certificate


def cleaned(
    mesh: Mesh, certificate: Certificate, low: float = -np.inf, high: float = np.inf, threads: int = 0
) -> Cleaned:
    """Clean a mesh, or a piece of one, and update its certificate.

    Parameters
    ----------
    mesh : Mesh
        The mesh, mm.
    certificate : Certificate
        Certificate of its triangles.
    low, high : float, optional
        Only triangles whose largest x is in [low, high) are removed: elsewhere the surface may be cut open.
    threads : int, optional
        Threads; 0 for all cores.

    Returns
    -------
    Cleaned
        The cleaned mesh, and the same triangles before quantisation.

    Raises
    ------
    MeshError
        If a coordinate is not finite or an index is out of range.
    """
    points, displaced = quantise(mesh, certificate.planes, threads)
    if not certificate.holds.all():
        displaced[mesh.triangles[~certificate.holds]] = True
    exact, certificate = _mended(mesh, points, certificate, low, high, threads)
    proved, final = certificate.holds, Mesh(points, exact.triangles)
    if not displaced.any():  # only displaced vertices can coincide with others
        return Cleaned(final.selected(np.ones(len(proved), bool), threads), proved, exact, certificate)
    proved = proved & ~displaced[exact.triangles].any(axis=1)
    return Cleaned(welded(final, threads), proved, exact, certificate)


def _mended(
    mesh: Mesh,
    points: NDArray[np.float64],
    certificate: Certificate,
    low: float,
    high: float,
    threads: int,
) -> tuple[Mesh, Certificate]:
    """Remove triangles that are flattened or turned over when the vertices move to `points`."""
    suspects = turned(mesh.vertices, mesh.triangles, points, threads)
    top = mesh.vertices[mesh.triangles[suspects], 0].max(axis=1, initial=-np.inf)
    bad = set(suspects[(low <= top) & (top < high)].tolist())
    if not bad:
        return mesh, certificate
    surface = _Surface(points, mesh.triangles, bad, threads)
    for _ in range(PASSES):
        for triangle in sorted(bad):
            surface.mend(triangle)
    holds = certificate.holds.copy()
    holds[list(surface.changed)] = False
    certificate = replace(certificate, holds=holds).selected(surface.alive)
    return Mesh(mesh.vertices, surface.triangles[surface.alive]), certificate


class _Surface:
    """A mesh under local edits. The triangles around a vertex are known near bad triangles only: at their
    corners and at the neighbours of these.
    """

    def __init__(
        self, points: NDArray[np.float64], triangles: NDArray[np.int32], bad: set[int], threads: int
    ) -> None:
        self.points = points
        self.bad = bad
        self.triangles = triangles.copy()
        self.alive = np.ones(len(triangles), dtype=bool)
        self.stars: dict[int, set[int]] = {}
        self.changed: set[int] = set()
        near = np.array(sorted(bad))
        for _ in range(2):
            marked = np.zeros(len(points), bool)
            marked[triangles[near]] = True
            near = touching(triangles, marked, threads)
        for triangle, corners in zip(near.tolist(), triangles[near].tolist(), strict=True):
            for vertex in corners:
                self.stars.setdefault(vertex, set()).add(triangle)

    def star(self, vertex: int) -> set[int]:
        """The triangles around a vertex."""
        return self.stars[vertex]

    def ring(self, vertex: int) -> set[int]:
        """The vertices around a vertex."""
        around = {int(v) for triangle in self.star(vertex) for v in self.triangles[triangle]}
        return around - {vertex}

    def normal(self, corners: NDArray[np.int32]) -> NDArray[np.float64]:
        """Normal of a triangle, of twice its area."""
        a, b, c = self.points[corners]
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
        self.alive[list(shared)] = False
        return True


def _third(corners: NDArray[np.int32], a: int, b: int) -> int:
    """The corner of a triangle besides a and b."""
    (vertex,) = set(corners.tolist()) - {a, b}
    return int(vertex)


def _with(corners: NDArray[np.int32], old: int, new: int) -> NDArray[np.int32]:
    """Corners of a triangle with one vertex replaced."""
    return np.where(corners == old, np.int32(new), corners)
