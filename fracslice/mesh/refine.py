"""Adaptive refinement: triangles are subdivided until none is farther from the surface than a chord."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..kernel import Field
from ..work import Work
from .creases import on_creases
from .fit import Fit, Fitted
from .flips import flip
from .model import Mesh
from .projection import anywhere, project
from .self_intersections import self_intersecting_triangles
from .subdivision import Edges, cut, edges_of, with_needles

PASSES = 12
AIM = 0.9
"""Fraction of the chord that samples may reach. A second-order distance that is zero at the corners is at
most 1.07 times its maximum over `LATTICE`.
"""

ROUGH = 0.12
"""An edge is rough if the distance of its midpoint exceeds this fraction of its length; for edges shorter
than a voxel the fraction decreases. Refinement would not follow a rough edge.
"""

WORTH = 10
"""Refinement stops when fewer than one edge is split per this many triangles out of tolerance."""

UPRIGHT = np.cos(np.radians(29))
"""Minimum cosine between the normals of a new triangle and of the field."""

CREASED = 0.9
"""Maximum cosine between the field's normals on both sides of a sharp edge."""


@dataclass(frozen=True)
class Refined:
    """Result of a refinement.

    Attributes
    ----------
    chord_mm : float
        Maximum distance of a triangle from the surface.
    from_triangles : int
        Triangles before the refinement.
    off_mm : float
        Estimate of the greatest distance, from samples of the triangles a quarter of a side apart.
    left : int
        Triangles with a sample out of tolerance: in rough places, or where smaller triangles would turn over
        or intersect.
    """

    chord_mm: float
    from_triangles: int
    off_mm: float
    left: int

    @property
    def notes(self) -> tuple[str, ...]:
        """Note on triangles out of tolerance, tuple of str; empty if there are none."""
        chord = f"the chord of {self.chord_mm:.3g} mm"
        far = f"{self.left:,} triangles are farther off than {chord}, up to {self.off_mm:.2g} mm"
        return (far,) if self.left else ()

    def scaled(self, scale: float) -> Refined:
        """Convert the lengths to other units.

        Parameters
        ----------
        scale : float
            New units per old unit.

        Returns
        -------
        Refined
            Converted result.
        """
        return replace(self, chord_mm=scale * self.chord_mm, off_mm=scale * self.off_mm)


def refine(
    root: Field, mesh: Mesh, chord: float, voxel: float, work: Work | None = None
) -> tuple[Mesh, Refined]:
    """Split edges until no triangle is farther than `chord` from the surface.

    New vertices lie on the surface, and on sharp edges that a mesh edge follows or crosses. Edges are then
    flipped to improve the normals of triangles. Old vertices do not move. The surface stays closed and free
    of self-intersections: a split that would cause one is refused.

    Parameters
    ----------
    root : Field
        Field of the scene.
    mesh : Mesh
        Closed mesh with vertices on the zero set of the field, scene units.
    chord : float
        Maximum distance, scene units.
    voxel : float
        Voxel, scene units.
    work : Work, optional
        Threads, progress and cancellation.

    Returns
    -------
    Mesh
        Refined mesh, scene units.
    Refined
        Result, with lengths in scene units.

    Raises
    ------
    Cancelled
        If the work is cancelled.
    """
    work, count = work or Work(), len(mesh.triangles)
    state = Fitted.of(mesh, Fit(root, AIM * chord, voxel, work))
    latest = refused = np.empty(0, np.int64)
    for number in range(PASSES):
        work.progress("refining", number / PASSES)
        edges = edges_of(state.mesh.triangles)
        free = ~np.isin(edges.keys, np.concatenate([latest, _repeated(refused)]))
        split, there = _wanted(root, state, edges, free, voxel, work)
        if not split.any():
            break
        state, left = _split(state, edges, split, there, work)
        latest = edges.keys[left]
        refused = np.concatenate([refused, latest])
        if (split.sum() - len(latest)) * WORTH < np.count_nonzero(state.off > state.fit.reach):
            break
    far = np.count_nonzero(state.off > state.fit.reach)
    return state.mesh, Refined(chord, count, float(state.off.max()) / AIM, int(far))


def _repeated(keys: NDArray[np.int64]) -> NDArray[np.int64]:
    """Values that occur more than once."""
    result, counts = np.unique(keys, return_counts=True)
    return result[counts > 1]


def _wanted(
    root: Field, state: Fitted, edges: Edges, free: NDArray[np.bool_], voxel: float, work: Work
) -> tuple[NDArray[np.bool_], NDArray[np.float64]]:
    """Edges to split, bool [e], and the new vertices: edges out of tolerance, or the longest edges of
    triangles out of tolerance.
    """
    sides, ends = edges.sides, state.mesh.vertices[edges.ends]
    lengths = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    off = np.zeros(len(free))
    np.maximum.at(off, sides, state.sides)
    far = np.flatnonzero(free & (off > state.fit.reach))
    there = ends.mean(axis=1)
    points, creased = _creased(state, edges, far)
    there[far[creased]] = points[creased]
    rough = ROUGH * lengths * np.minimum(1, np.sqrt(lengths / voxel))
    rough[far[creased]] = np.inf
    split = np.zeros(len(free), bool)
    split[far] = off[far] < rough[far]
    left = np.flatnonzero((state.off > state.fit.reach) & ~split[sides].any(axis=1))
    longest = sides[left, np.where(free[sides[left]], lengths[sides[left]], 0).argmax(axis=1)]
    split[longest[free[longest] & (state.off[left] < rough[longest])]] = True
    split = np.asarray(with_needles(split, sides, lengths) & free)
    chosen = there[split]
    project(root, chosen, anywhere, voxel, work)
    return split, chosen


def _creased(
    state: Fitted, edges: Edges, which: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Points on the sharp edges across or along some mesh edges, [k, 3], and whether there is a sharp edge,
    [k].
    """
    ends = state.mesh.vertices[edges.ends[which]]
    beside = edges.beside[which]
    middles, along = ends.mean(axis=1), ends[:, 1] - ends[:, 0]
    along /= np.maximum(np.linalg.norm(along, axis=1), 1e-300)[:, None]
    inwards = state.mesh.corners[beside].mean(axis=2) - middles[:, None]
    inwards -= (inwards * along[:, None]).sum(axis=2, keepdims=True) * along[:, None]
    inwards /= np.maximum(np.linalg.norm(inwards, axis=2, keepdims=True), 1e-300)
    near = np.array([[7, 1], [1, 7]]) / 8 @ ends
    beyond = middles[:, None] + inwards * np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)[:, None, None] / 8
    normals = state.fit.planes(near.reshape(-1, 3))[:, :3].reshape(-1, 2, 3)
    across = (normals[:, 0] * normals[:, 1]).sum(axis=1) < CREASED
    normals = state.normals[beside]
    creased = across | ((normals[:, 0] * normals[:, 1]).sum(axis=1) < CREASED)
    starts = np.where(across[:, None, None], near, beyond)
    points = np.empty_like(middles)
    points[creased], creased[creased] = on_creases(state.fit, ends[creased], starts[creased])
    return points, creased


def _split(
    state: Fitted, edges: Edges, split: NDArray[np.bool_], there: NDArray[np.float64], work: Work
) -> tuple[Fitted, NDArray[np.int64]]:
    """Split edges, then flip edges of the new triangles.

    Splits that would turn a triangle away from the surface or cause a self-intersection are refused; the
    refused edges are returned. `there` has the new vertices of all edges to split.
    """
    old, chosen = state.mesh, np.flatnonzero(split)
    keep = np.ones(len(chosen), bool)
    while keep.any():
        work.check()
        now = np.zeros(len(split), bool)
        now[chosen[keep]] = True
        mesh, parents = cut(old, edges.sides, now, there[keep])
        cut_up = np.asarray(now[edges.sides]).any(axis=1)
        fresh = np.take(cut_up, parents)
        result, flipped = flip(state.become(mesh, parents, fresh), fresh)
        blamed = _blamed(result, fresh | flipped, len(old.vertices), work)
        if not blamed.any():
            return result, chosen[~keep]
        keep[np.flatnonzero(keep)[blamed]] = False
    return state, chosen


def _blamed(state: Fitted, fresh: NDArray[np.bool_], first: int, work: Work) -> NDArray[np.bool_]:
    """New vertices, from index `first` on, at or next to triangles that turn away from the surface or
    intersect others.
    """
    mesh = state.mesh
    crossing = self_intersecting_triangles(mesh, threads=work.threads, among=fresh)
    away = fresh & (state.upright < UPRIGHT) & (mesh.triangles >= first).any(axis=1)
    marked = np.zeros(len(mesh.vertices), bool)
    marked[mesh.triangles[crossing]] = True
    if crossing.any() and not marked[first:].any():
        marked[mesh.triangles[marked[mesh.triangles].any(axis=1)]] = True
    marked[mesh.triangles[away]] = True
    return marked[first:]
