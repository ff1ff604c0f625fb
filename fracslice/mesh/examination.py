"""Verification of a simplification: distances, self-intersections and orientation of shells."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .._native import connected_components
from ..work import Work
from .collapse import Collapsed
from .model import Mesh
from .nearest import Nearest
from .self_intersections import self_intersecting_triangles
from .topology import component_sizes
from .tree import build


class Examination:
    """Verify a simplification of a mesh within a tolerance.

    Results are stored per triangle of the original mesh and stay valid until something they depend on
    changes.

    Parameters
    ----------
    mesh : Mesh
        Original mesh: a closed, oriented 2-manifold.
    tolerance : float
        Maximum distance, mm.
    work : Work
        Threads and cancellation.

    Attributes
    ----------
    bound : ndarray of float64, shape (m,)
        Proved bound on the distance of each original triangle from the simplified surface.
    beyond : ndarray of int32, shape (k, 2)
        Pairs of an original triangle and a simplified one that its bound depends on, besides those near its
        corners.
    back : ndarray of float64, shape (m,)
        Greatest distance of the samples of each simplified triangle from the original mesh.
    crossing : ndarray of bool, shape (m,)
        True for each simplified triangle that intersects another one.
    """

    def __init__(self, mesh: Mesh, tolerance: float, work: Work) -> None:
        self.mesh, self.tolerance, self.work = mesh, tolerance, work
        self.spacing, self.shells = _edge(mesh) / 2, _Shells(mesh)
        work.check()
        tree = build(mesh)
        work.check()
        self.original = Nearest(mesh, tree, closed=True)
        self.bound, self.back = np.zeros(len(mesh.triangles)), np.zeros(len(mesh.triangles))
        self.crossing, self.beyond = np.zeros(len(mesh.triangles), dtype=bool), np.empty((0, 2), np.int32)

    def faults(self, collapsed: Collapsed) -> NDArray[np.bool_]:
        """Triangles whose last collapse has to be undone.

        Parameters
        ----------
        collapsed : Collapsed
            Current state.

        Returns
        -------
        ndarray of bool, shape (m,)
            True for each faulty triangle.

        Raises
        ------
        Cancelled
            If the work is cancelled.
        """
        left = _Left(self.mesh, collapsed)
        faulty = self._there(left, collapsed) | self._back(collapsed)
        self.work.check()
        self.crossing = left.crossing(collapsed.fresh | self.crossing, self.work)
        faulty |= (self.crossing | left.all(self.shells.turned(left.mesh))) & collapsed.changed
        return faulty

    def distances(self, collapsed: Collapsed) -> tuple[float, float]:
        """Greatest distances between the two surfaces.

        Parameters
        ----------
        collapsed : Collapsed
            Current state.

        Returns
        -------
        float
            Proved bound on the distance from the original surface to the simplified one, mm.
        float
            Greatest sampled distance back, mm.
        """
        there, back = self.bound[collapsed.changed], self.back[collapsed.changed & ~collapsed.gone]
        return float(there.max(initial=0.0)), float(back.max(initial=0.0))

    def _there(self, left: _Left, collapsed: Collapsed) -> NDArray[np.bool_]:
        """Faulty triangles by the distance from the original: of the triangles near one that is too far off,
        the one that changed last.
        """
        lost = collapsed.fresh | collapsed.fresh[collapsed.owner][self.mesh.triangles].any(axis=1)
        lost[self.beyond[collapsed.fresh[self.beyond[:, 1]], 0]] = True
        which = np.flatnonzero(lost & collapsed.changed)
        these = Mesh(self.mesh.vertices, self.mesh.triangles[which])
        hints = left.number[collapsed.owner[these.triangles]]
        self.bound[which], pairs = left.nearest.bounds(these, self.tolerance, self.work, hints)
        beyond = np.column_stack([which[pairs[:, 0]], left.old[pairs[:, 1]]]).astype(np.int32)
        self.beyond = np.concatenate([self.beyond[~lost[self.beyond[:, 0]]], beyond])
        far = np.flatnonzero(np.isinf(self.bound) & collapsed.changed)
        suspects = np.column_stack([collapsed.owner[self.mesh.triangles[far]], far])
        latest = collapsed.step[suspects].argmax(axis=1)
        faulty = np.zeros(len(lost), dtype=bool)
        faulty[suspects[np.arange(len(suspects)), latest]] = True
        return faulty

    def _back(self, collapsed: Collapsed) -> NDArray[np.bool_]:
        """Changed triangles with samples too far from the original."""
        new = collapsed.changed & ~collapsed.gone
        fresh = new & collapsed.fresh
        these = Mesh(self.mesh.vertices, collapsed.triangles[fresh])
        self.back[fresh] = self.original.samples(these, self.spacing, self.work, self.tolerance)
        return new & (self.back > self.tolerance)


class _Left:
    """The remaining triangles as a mesh. `number`, int32 [m], has their indices in it."""

    def __init__(self, mesh: Mesh, collapsed: Collapsed) -> None:
        self.old = np.flatnonzero(~collapsed.gone)
        self.number = np.cumsum(~collapsed.gone, dtype=np.int32) - np.int32(1)
        self.mesh = Mesh(mesh.vertices, collapsed.triangles[self.old])
        self.tree = build(self.mesh)
        self.nearest = Nearest(self.mesh, self.tree)

    def crossing(self, among: NDArray[np.bool_], work: Work) -> NDArray[np.bool_]:
        """Triangles that intersect another one; one triangle of each pair is in `among`. Bool [m], over the
        original triangles.
        """
        return self.all(self_intersecting_triangles(self.mesh, self.tree, work.threads, among[self.old]))

    def all(self, marks: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Marks of the remaining triangles as marks of the original ones."""
        result = np.zeros(len(self.number), dtype=bool)
        result[self.old] = marks
        return result


class _Shells:
    """Shells of the original mesh, to compare with the simplified one."""

    def __init__(self, mesh: Mesh) -> None:
        self.of, self.count = connected_components(mesh.triangles, len(mesh.vertices))
        self.outside = self._volumes(mesh) >= 0

    def turned(self, mesh: Mesh) -> NDArray[np.bool_]:
        """Triangles of shells that are inside out: crumbs that fewer triangles cannot represent."""
        result: NDArray[np.bool_] = (self.outside != (self._volumes(mesh) >= 0))[
            self.of[mesh.triangles[:, 0]]
        ]
        return result

    def _volumes(self, mesh: Mesh) -> NDArray[np.float64]:
        """Signed volumes of the shells."""
        return component_sizes(mesh.vertices, mesh.triangles, self.of, self.count).volumes


def _edge(mesh: Mesh) -> float:
    """Median edge length."""
    a, b = mesh.vertices[mesh.triangles[:, 0]], mesh.vertices[mesh.triangles[:, 1]]
    return float(np.median(np.linalg.norm(a - b, axis=1)))
