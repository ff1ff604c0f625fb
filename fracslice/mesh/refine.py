"""More triangles where the surface bends away from them, until none is farther off than a chord."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..kernel import Field
from ..volume.projection import anywhere, project
from ..work import Work
from .creases import on_creases
from .fit import Fit, Fitted
from .flips import flip
from .model import Mesh
from .self_intersections import self_intersecting_triangles
from .subdivision import Edges, cut, edges_of, with_needles

PASSES = 12
AIM = 0.9
"""The share of the chord that samples may have. A distance of second order that is zero at the corners is at
most 1.07 times what `LATTICE` sees of it."""

ROUGH = 0.12
"""A middle that is off by more than this share of its edge, and less and less where edges are shorter than
voxels, is at a rough place: more triangles would not follow it."""

WORTH = 10
"""As long as one edge is split for so many triangles that are too far off, it goes on."""

UPRIGHT = np.cos(np.radians(29))
"""No new triangle's normal is farther from the field's."""

CREASED = 0.9
"""The cosine between the field's normals on both sides of a sharp edge, at most."""


@dataclass(frozen=True)
class Refined:
    """What a refinement did. from_triangles: how many there were. off_mm: no sample of the triangles, a
    quarter of a side apart, is farther from the surface. left: how many triangles have one that is farther
    off than the chord allows; they are at rough places, or more triangles there would turn over or cross."""

    chord_mm: float
    from_triangles: int
    off_mm: float
    left: int

    @property
    def notes(self) -> tuple[str, ...]:
        """What did not succeed, in words."""
        chord = f"the chord of {self.chord_mm:.3g} mm"
        far = f"{self.left:,} triangles are farther off than {chord}, up to {self.off_mm:.2g} mm"
        return (far,) if self.left else ()

    def scaled(self, scale: float) -> Refined:
        """In other units."""
        return replace(self, chord_mm=scale * self.chord_mm, off_mm=scale * self.off_mm)


def refine(
    root: Field, mesh: Mesh, chord: float, voxel: float, work: Work | None = None
) -> tuple[Mesh, Refined]:
    """Splits edges until no triangle is farther than `chord` from the surface.

    mesh: closed, scene units, its vertices on the zero set of root's field; chord, voxel: scene units. New
    vertices are on the surface, and on sharp edges where an edge is one. Then edges are flipped where that
    makes triangles better, so that none has a normal that the field has not. The surface stays closed, and
    does not cross itself: what would make it is not done. Old vertices stay where they are. Returns the mesh,
    and what was done, in scene units. Raises `Cancelled`.
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
    return state.mesh, Refined(chord, count, float(state.off.max()), int((state.off > state.fit.reach).sum()))


def _repeated(keys: NDArray[np.int64]) -> NDArray[np.int64]:
    """The numbers that come more than once."""
    found, counts = np.unique(keys, return_counts=True)
    return found[counts > 1]


def _wanted(
    root: Field, state: Fitted, edges: Edges, free: NDArray[np.bool_], voxel: float, work: Work
) -> tuple[NDArray[np.bool_], NDArray[np.float64]]:
    """The edges to be split: those that are too far off, or the longest ones of triangles that are; and
    where."""
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
    moved, places = project(root, chosen, anywhere, voxel, work)
    chosen[moved] = places
    return split, chosen


def _creased(
    state: Fitted, edges: Edges, which: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Points of sharp edges that some edges run across or along, [k, 3], and which do, [k]."""
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
    normals = state.ways[beside]
    creased = across | ((normals[:, 0] * normals[:, 1]).sum(axis=1) < CREASED)
    starts = np.where(across[:, None, None], near, beyond)
    points = np.empty_like(middles)
    points[creased], creased[creased] = on_creases(state.fit, ends[creased], starts[creased])
    return points, creased


def _split(
    state: Fitted, edges: Edges, split: NDArray[np.bool_], there: NDArray[np.float64], work: Work
) -> tuple[Fitted, NDArray[np.int64]]:
    """The mesh with edges split and others flipped; and edges that are left, for a triangle would turn away
    from the surface, or cross others. there: of all that shall be split."""
    old, chosen = state.mesh, np.flatnonzero(split)
    keep = np.ones(len(chosen), bool)
    while keep.any():
        work.check()
        now = np.zeros(len(split), bool)
        now[chosen[keep]] = True
        mesh, parents = cut(old, edges.sides, now, there[keep])
        cut_up = np.asarray(now[edges.sides]).any(axis=1)
        fresh = np.take(cut_up, parents)
        found, flipped = flip(state.become(mesh, parents, fresh), fresh)
        blamed = _blamed(found, fresh | flipped, len(old.vertices), work)
        if not blamed.any():
            return found, chosen[~keep]
        keep[np.flatnonzero(keep)[blamed]] = False
    return state, chosen


def _blamed(state: Fitted, fresh: NDArray[np.bool_], first: int, work: Work) -> NDArray[np.bool_]:
    """Which of the vertices from `first` on are corners of triangles that turn away or cross, or next to
    such."""
    mesh = state.mesh
    crossing = self_intersecting_triangles(mesh, threads=work.threads, among=fresh)
    away = fresh & (state.upright < UPRIGHT) & (mesh.triangles >= first).any(axis=1)
    marked = np.zeros(len(mesh.vertices), bool)
    marked[mesh.triangles[crossing]] = True
    if crossing.any() and not marked[first:].any():
        marked[mesh.triangles[marked[mesh.triangles].any(axis=1)]] = True
    marked[mesh.triangles[away]] = True
    return marked[first:]
