"""Sharp edges and corners of a solid beyond its last samples, where the sampled mesh is blunt.

Edges of the mesh whose ends lie on different sides of a sharp edge are split at it (Attene, Falcidieno,
Rossignac and Spagnuolo 2005, "Sharpen&Bend"); triangles that turn over are replaced, with their neighbours,
by fans. Where that leaves triangles off the surface, they give way to the triangulation of their rim that
fits best (Barequet and Sharir 1995, "Filling gaps in the boundary of a polyhedron").
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import chain, combinations, islice, product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .._native import connected_components, fans
from ..common.arrays import distinct
from ..volume import Plan
from ..volume.bricks import values_at
from ..work import Work
from .cleaning import quantise, used_vertices
from .contouring import BLUNT, Piece
from .fit import OFF, UPRIGHT, Fit
from .model import Mesh, Nearest, component_sizes, self_intersecting_triangles
from .refine import (
    Edges,
    contracted,
    edges_of,
    on_creases,
    on_three,
    placed,
    split_edges,
    stars,
    uncrowded,
    with_neighbours,
)
from .shells import Pieces, rows
from .tips import Cap, heights, replace_by_fans, spans, tips_to_end

APART = 5e-5
"""Distance between vertices, voxels, below which rounding may join them; contouring keeps twice that."""
LARGE = 1 << 24
"""Triangles above which a surface stays as it is: pieces that sharp edges span are joined, in memory."""

KEPT, FLAT = 1.5e-4, 1e-5
"""Distance, voxels, below which contouring moves vertices away from samples, and greatest change of the slope
around them, relative to it, on a side that counts as flat.
"""

SAMPLE, MOSTLY = 64, 0.5
"""Blunt cells that are examined first, and the least share of their edges that must lead to a sharp edge. On
solids nearly all do, on fractals fewer than one in six.
"""

CUBE = 4.0
"""Edge of the cubes that are remeshed, those with blunt cells and those beside them, voxels."""

CRUMB, WITHIN = 0.5, 1.0
"""Volume of a body beside a sharp edge below which it is taken for its end, cubic voxels (as for dust), and
its greatest distance from what is added there, voxels.
"""

GAP = 0.01
"""Distance of the middle of a mesh edge from the surface, voxels, above which it is examined."""

BENT, SNAP, STILL = 0.98, 0.04, 1e-7
"""Maximum cosine between triangles at vertices that may belong to sharp edges; distance, voxels, below which
they move there, and below which they are there.
"""

SHORT = 0.01
"""Length of a mesh edge, voxels, below which it is contracted where a triangle is bad."""

REACHED = 1e-3
"""Distance from the mesh, voxels, below which it has a point of a sharp edge already."""

BESIDE = 0.02
"""Distance from the ends of a mesh edge at which its sides are examined, relative to its length."""

WIDE, FAR = 1.5, 2.0
"""Least length that is taken for a mesh edge, and greatest distance of a corner from its triangle; voxels."""

SHARP = 0.9
"""Maximum cosine between the normals on both sides of a sharp edge."""

UP, THIN = 0.875, 0.005
"""Minimum cosine between the normals of a new triangle and of the field (29 degrees), and minimum height,
voxels.
"""

LOOSE, SLACK = 0.03, 1.05
"""Distance from the surface, voxels, up to which a fan may be farther off than what it replaces; beyond that,
the factor.
"""

NEAR, GROWTH = 0.05, 2.0
"""Distance from a triangle that is wrong within which no point is added in the next attempt, voxels, and the
factor by which it grows.
"""

MOST, RINGS, TURNS, RETRIES = 64, 6, 6, 8
"""Maximum triangles that a fan replaces, and their distance from a bad one; rounds of fans, and attempts."""

MANY, FEWER = 1 << 13, 3
"""Missed points above which there are fewer attempts, of some seconds each."""

RIM = 20
"""Maximum corners of a rim that is triangulated anew."""

PAIRS = [0, 1], [1, 2], [0, 2]
"""Of three sides that meet in a corner."""

INWARDS = 0.8 * np.eye(3) + np.full((3, 3), 0.2 / 3)
"""Barycentric coordinates of points near the corners of a triangle."""

ROUGH = 0.25
"""Wrong triangles of an attempt, relative to its new vertices, above which a surface is too rough for sharp
edges. On solids they are below 0.2 at the first attempt, and fewer at each further one.
"""


def with_ridges(
    planned: Plan, pieces: Pieces, blunt: NDArray[np.float64], tips: NDArray[np.float64], work: Work
) -> tuple[Pieces, NDArray[np.float64]]:
    """Extend a surface to the sharp edges and corners that samples cut off.

    The surface stays closed and free of self-intersections: what would cause one is left as it is. A rough
    surface, for example of a fractal, is not changed, nor one of more than `LARGE` triangles. The new
    triangles are the last ones of their pieces; pieces that they span are joined.

    `pieces` in scene units; `blunt`: float64 (n, 3); `tips`: float64 (k, 3). Returns float64 (j, 3), scene
    units.
    """
    if not 0 < len(blunt) <= BLUNT or pieces.triangles > LARGE:
        return pieces, tips
    if not _creased(planned, pieces, blunt, tips, work):
        return pieces, tips
    pieces = _settled(planned, pieces, work)
    mesh, numbers = _around(planned, pieces, blunt, tips, CUBE)
    crumb = _crumbs(mesh, planned.voxel)
    whole = Mesh(mesh.vertices, mesh.triangles[crumb < 0]).in_order()
    made = _Sharpening(planned, whole, tips, work).made()
    if made is None or not made.is_apart(APART * planned.voxel):
        return pieces, tips
    own = numbers[crumb < 0]
    caps = [Cap(own[cap.old], cap.fan) for cap in made.caps()]
    crumbs = np.flatnonzero(crumb >= 0)
    parts = _parted(crumbs, np.unique(crumb[crumbs], return_inverse=True)[1])
    _take_in(caps, [Cap(numbers[part], mesh.vertices[mesh.triangles[part]]) for part in parts], planned.voxel)
    points = np.concatenate([tips, made.marks()])
    result, near = pieces.anew(), planned.voxel / 2
    for first, last in spans(caps, pieces, near):
        part, start = pieces.together(first, last, near), pieces.starts[first]
        here = [Cap(c.old - start, c.fan) for c in caps if 0 <= c.old[0] - start < len(part.triangles)]
        part, _, fresh = tips_to_end(replace_by_fans(part, here) if here else part, points)
        result.add(Piece(part, pieces.ends[last - 1]), fresh)
    return result, points


def _creased(
    planned: Plan, pieces: Pieces, blunt: NDArray[np.float64], tips: NDArray[np.float64], work: Work
) -> bool:
    """Whether most of the mesh edges that have two sides, at some blunt cells, lead to a sharp edge."""
    some = blunt[np.linspace(0, len(blunt) - 1, min(SAMPLE, len(blunt))).astype(np.int64)]
    mesh, _ = _around(planned, pieces, some, tips, 1.0)
    missed = _Missed(planned, work).of(mesh, edges_of(mesh.triangles), SAMPLE)
    return len(missed.edges) > MOSTLY * missed.sided


def _settled(planned: Plan, pieces: Pieces, work: Work) -> Pieces:
    """The same surface with vertices on its flat sides, from which contouring keeps them for the sake of
    rounding.
    """
    kernel, voxel, result = planned.root.kernel("cpu", "float64"), planned.voxel, pieces.anew()
    step = 2 * KEPT * voxel
    for number in range(len(pieces)):
        mesh = pieces.mesh(number)
        off = values_at(kernel, np.ascontiguousarray(mesh.vertices.T), work)
        few = np.flatnonzero((np.abs(off) > STILL * voxel) & (np.abs(off) < 2 * KEPT * voxel))
        p, f = np.ascontiguousarray(mesh.vertices[few].T), off[few]
        up, down = (
            np.array([values_at(kernel, p + sign * way[:, None], work) for way in step * np.eye(3)])
            for sign in (1, -1)
        )
        slope, bend = (up - down) / (2 * step), np.abs(up + down - 2 * f).max(axis=0)
        square = (slope**2).sum(axis=0)
        flat = (bend < FLAT * step * np.sqrt(square)) & (np.abs(f) < KEPT * voxel * np.sqrt(square))
        few, there, up = few[flat], (p - f * slope / np.maximum(square, 1e-300)).T[flat], slope.T[flat]
        settled = placed(mesh, few, there, up, APART / 4 * voxel)
        result.add(Piece(settled, pieces.ends[number]), pieces.fresh[number])
    return result


def _around(
    planned: Plan, pieces: Pieces, blunt: NDArray[np.float64], tips: NDArray[np.float64], size: float
) -> tuple[Mesh, NDArray[np.int64]]:
    """Triangles in cubes of some voxels with blunt cells, and in those beside them, the same for any pieces,
    and their indices.
    """
    low, edge = np.asarray(planned.outer.lo), size * planned.voxel

    def cubes(points: NDArray[np.float64]) -> NDArray[np.int64]:
        cubes: NDArray[np.int64] = np.floor((points - low) / edge).astype(np.int64)
        return cubes

    def keys(cubes: NDArray[np.int64]) -> NDArray[np.int64]:
        keys: NDArray[np.int64] = ((cubes + (1 << 20)) << np.array([42, 21, 0])).sum(axis=-1)
        return keys

    mesh, numbers = pieces.near(blunt, 2 * edge + planned.voxel)
    around = cubes(blunt)[:, None] + np.array(list(product((-1, 0, 1), repeat=3)))
    inner = np.isin(keys(cubes(mesh.corners.mean(axis=1))), np.unique(keys(around)))
    part, order, _ = tips_to_end(Mesh(mesh.vertices, mesh.triangles[inner]), tips)
    return part.in_order(), numbers[inner][order]


def _crumbs(mesh: Mesh, voxel: float) -> NDArray[np.int64]:
    """Number of the crumb that each triangle is of, or -1. Crumbs are small bodies, of samples in the thin
    end of a wedge.
    """
    labels, count = connected_components(mesh.triangles, len(mesh.vertices))
    sizes = component_sizes(mesh.vertices, mesh.triangles, labels, count)
    edges, of = edges_of(mesh.triangles), labels[mesh.triangles[:, 0]]
    rim = np.bincount(edges.sides.ravel(), minlength=len(edges.ends)) == 1
    small = (sizes.volumes > 0) & (sizes.volumes < CRUMB * voxel**3)
    small[of[rim[edges.sides].any(axis=1)]] = False
    return np.where(small[of], of, -1).astype(np.int64)


def _take_in(caps: list[Cap], crumbs: list[Cap], voxel: float) -> None:
    """Remove each crumb with the nearest of the caps, if it is within reach: the sharp edge holds it then."""
    from scipy.spatial import cKDTree

    if not crumbs:
        return
    of = np.repeat(np.arange(len(caps)), [3 * len(cap.fan) for cap in caps])
    tree = cKDTree(np.concatenate([cap.fan.reshape(-1, 3) for cap in caps]))
    away, corner = tree.query([crumb.fan.mean(axis=(0, 1)) for crumb in crumbs])
    for crumb, nearest in zip(crumbs, np.where(away < WITHIN * voxel, of[corner], -1), strict=True):
        if nearest >= 0:
            cap = caps[nearest]
            caps[nearest] = Cap(distinct(np.concatenate([cap.old, crumb.old])), cap.fan)


FAN = -2
"""Mark of the triangles of new fans."""

Disk = tuple[list[int], list[tuple[int, int, int]]]
"""Triangles, and the fan that may replace them."""

Costs = dict[tuple[int, ...], float]
"""Of triangles, by the places of their corners on a rim."""


@dataclass(frozen=True)
class _Points:
    """Points of sharp edges for some mesh edges, of `sided` examined ones that have two sides."""

    edges: NDArray[np.int64]
    points: NDArray[np.float64]
    sided: int


@dataclass(frozen=True, eq=False)
class _Added:
    """Corners, and points of sharp edges that take the place of vertices nearby."""

    hosts: NDArray[np.int64]  # triangles that are split, or complements of vertices that are replaced
    points: NDArray[np.float64]
    cornered: NDArray[np.bool_]  # whether they are corners

    def joined(self, others: _Added, apart: float) -> _Added:
        """These and those others that are not as near to one of them."""
        new = _away(others.points, self.points, apart)
        hosts = np.concatenate([self.hosts, others.hosts[new]])
        points = np.concatenate([self.points, others.points[new]])
        return _Added(hosts, points, np.concatenate([self.cornered, others.cornered[new]]))


class _Missed:
    """Finds the points of sharp edges and the corners that a mesh lacks."""

    def __init__(self, planned: Plan, work: Work) -> None:
        self._kernel, self._voxel, self._work = planned.root.kernel("cpu", "float64"), planned.voxel, work
        self.fit = Fit(planned.root, 2 * GAP * planned.voxel, planned.voxel, work)

    def of(self, mesh: Mesh, edges: Edges, most: int = 1 << 62) -> _Points:
        """Points for edges whose ends are on different sides; among `most` edges that are off the surface."""
        ends = mesh.vertices[edges.ends]
        value = np.abs(values_at(self._kernel, np.ascontiguousarray(ends.mean(axis=1).T), self._work))
        far = np.flatnonzero(value > GAP * self._voxel / 4)
        far = far[:: -(-len(far) // most) or 1]
        far = far[np.abs(self.fit.planes(ends[far].mean(axis=1))[:, 3]) > GAP * self._voxel]
        near = np.array([[1 - BESIDE, BESIDE], [BESIDE, 1 - BESIDE]]) @ ends[far]
        normals = self.fit.planes(near.reshape(-1, 3))[:, :3].reshape(-1, 2, 3)
        sided = (normals[:, 0] * normals[:, 1]).sum(axis=1) < SHARP
        far, near = far[sided], near[sided]
        points, found = on_creases(self.fit, self._widened(ends[far]), near)
        far, points = far[found], points[found]
        on = self._on_surface(points)
        return _Points(far[on], points[on], int(sided.sum()))

    def corners(self, mesh: Mesh, which: NDArray[np.int64]) -> tuple[_Added, NDArray[np.int64]]:
        """Corners of the surface near triangles, each once and with its nearest triangle, and the vertices
        that are at corners already.
        """
        from scipy.spatial import cKDTree

        corners = mesh.corners[which]
        middles, sides = corners.mean(axis=1), (corners + np.roll(corners, 1, axis=1)) / 2
        around = np.concatenate([0.9 * corners + 0.1 * middles[:, None], sides], axis=1)
        both = edges_of(mesh.triangles[which]).beside
        points, found = on_three(
            self.fit, np.concatenate([around[both[:, 0]], around[both[:, 1]]], 1), self._voxel
        )
        off = np.linalg.norm(points[:, None] - middles[both], axis=2)
        nearest, away = which[both[np.arange(len(both)), off.argmin(axis=1)]], off.min(axis=1)
        found &= away < FAR * self._voxel
        points, nearest, away = points[found], nearest[found], away[found]
        on = self._on_surface(points)
        points, nearest, away = points[on], nearest[on], away[on]
        apart = 2 * GAP * self._voxel
        off, vertices = cKDTree(mesh.vertices).query(points)
        known = off <= apart
        kept: list[int] = []
        order = np.argsort(away, kind="stable")
        for k in order[~known[order]].tolist():
            new = np.linalg.norm(points[kept] - points[k], axis=1).min(initial=math.inf) > apart
            if new and nearest[k] not in nearest[kept]:
                kept.append(k)
        return _Added(nearest[kept], points[kept], np.ones(len(kept), bool)), distinct(vertices[known])

    def beside(self, mesh: Mesh, edges: Edges) -> tuple[_Added, NDArray[np.int64]]:
        """Points of sharp edges and corners in place of inner vertices that are a little off them, and the
        vertices that are at corners.
        """
        some = _bent(mesh, edges)
        around = mesh.corners[stars(mesh.triangles, some)].mean(axis=2)
        sides, sharp = self._sides(around)
        sided = sharp[:, 0]
        some, around, sides, sharp = some[sided], around[sided], sides[sided], sharp[sided]
        here = mesh.vertices[some]
        points, found = on_three(self.fit, around, self._voxel)
        away = np.where(found, np.linalg.norm(points - here, axis=1), math.inf)
        cornered = (away < SNAP * self._voxel) & self._on_surface(points)
        away[~cornered] = math.inf
        ends = here[:, None] + np.array([[-0.5], [0.5]]) * self._voxel * np.eye(3)[0]
        for k, pair in enumerate(PAIRS):
            feet, found = on_creases(self.fit, ends, sides[:, pair])
            off = np.linalg.norm(feet - here, axis=1)
            nearer = found & sharp[:, k] & ~cornered & (off < away) & self._on_surface(feet)
            points[nearer], away[nearer] = feet[nearer], off[nearer]
        near = away < SNAP * self._voxel
        some, points, cornered, away = some[near], points[near], cornered[near], away[near]
        order = np.lexsort((away, ~cornered))
        order = order[_alone(mesh, some[order], points[order], 2 * APART * self._voxel)]
        moves = order[away[order] > STILL * self._voxel]
        still = cornered & (away <= STILL * self._voxel)
        return _Added(~some[moves], points[moves], cornered[moves]), some[still]

    def _sides(self, around: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
        """The three of some points each whose tangent planes differ most, [n, 3, 3], and which pairs do."""
        normals = self.fit.planes(around.reshape(-1, 3))[:, :3].reshape(around.shape)
        each = np.arange(len(around))
        first = second = np.zeros(len(around), np.int64)
        for _ in range(2):
            first, second = (normals * normals[each, first][:, None]).sum(axis=2).argmin(axis=1), first
        across = np.cross(normals[each, first], normals[each, second])
        third = np.abs((normals * across[:, None]).sum(axis=2)).argmax(axis=1)
        which = each[:, None], np.stack([first, second, third], axis=1)
        own = normals[which]
        sharp = [(own[:, a] * own[:, b]).sum(axis=1) < SHARP for a, b in PAIRS]
        return around[which], np.stack(sharp, axis=1)

    def _on_surface(self, points: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Whether points are on the surface: planes also meet outside of what a third one cuts off."""
        on: NDArray[np.bool_] = np.abs(self.fit.planes(points)[:, 3]) < 1e-3 * self._voxel
        return on

    def _widened(self, ends: NDArray[np.float64]) -> NDArray[np.float64]:
        """End points of edges, at least `WIDE` apart."""
        middles, along = ends.mean(axis=1), ends[:, 1] - ends[:, 0]
        length = np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-300)
        half = along / length * np.maximum(length, WIDE * self._voxel) / 2
        return np.stack([middles - half, middles + half], axis=1)


@dataclass(frozen=True, eq=False)
class _Sharpened:
    """A remeshed part of a surface."""

    old: Mesh  # the part before and after; the first vertices are the same
    mesh: Mesh
    parents: NDArray[np.int64]  # triangle of `old` that each one is; -1 for new ones
    # measures of the new triangles; of others, their own normals and no distance
    measured: NDArray[np.float64]

    @classmethod
    def plain(cls, old: Mesh, mesh: Mesh, parents: NDArray[np.int64]) -> _Sharpened:
        """A part without measures."""
        sizes = np.maximum(np.linalg.norm(mesh.normals, axis=1, keepdims=True), 1e-300)
        rest = np.zeros((len(mesh.triangles), 5))
        rest[:, 0] = 1
        return cls(old, mesh, parents, np.column_stack([mesh.normals / sizes, rest]))

    def after(self, before: _Sharpened) -> _Sharpened:
        """The same as a part of what `before` was made of; this one was made of that."""
        kept = np.maximum(self.parents, 0)
        parents = np.where(self.parents < 0, self.parents, before.parents[kept])
        return replace(self, old=before.old, parents=parents)

    def measured_at(self, which: NDArray[np.int64], fit: Fit) -> _Sharpened:
        """The same with measures of some triangles."""
        measured = self.measured.copy()
        measured[which] = fit.triangles(self.mesh.corners[which])
        return replace(self, measured=measured)

    def fanned(self, gone: list[int], fans: NDArray[np.int32], measured: NDArray[np.float64]) -> _Sharpened:
        """The same with fans, and their measures, in place of some triangles."""
        keep = np.ones(len(self.parents), bool)
        keep[gone] = False
        mesh = Mesh(self.mesh.vertices, np.concatenate([self.mesh.triangles[keep], fans]))
        parents = np.concatenate([np.maximum(self.parents[keep], -1), np.full(len(fans), FAN)])
        return _Sharpened(self.old, mesh, parents, np.concatenate([self.measured[keep], measured]))

    def bad(self, voxel: float, least: float = UP, thin: float = THIN) -> NDArray[np.int64]:
        """New triangles whose cosine with the surface is too small, or which are too thin."""
        new = np.flatnonzero(self.parents < 0)
        flat = heights(self.mesh.corners[new]) < thin * voxel
        bad: NDArray[np.int64] = new[flat | (self.measured[new, UPRIGHT] < least)]
        return bad

    def new_vertices(self) -> NDArray[np.float64]:
        """Vertices that were added and are used, [k, 3]."""
        taken = distinct(self.mesh.triangles)
        new: NDArray[np.float64] = self.mesh.vertices[taken[taken >= len(self.old.vertices)]]
        return new

    def marks(self) -> NDArray[np.float64]:
        """Vertices that all new triangles are at, [k, 3]: those that were added, and one of each triangle
        without any.
        """
        new, first = self.mesh.triangles[self.parents < 0], len(self.old.vertices)
        without = new[(new < first).all(axis=1)]
        marked: NDArray[np.float64] = self.mesh.vertices[
            distinct(np.concatenate([new[new >= first], without[:, 0]]))
        ]
        return marked

    def is_apart(self, least: float) -> bool:
        """True if no other vertex is as near to a new one: where bodies touch, both have an edge there."""
        from scipy.spatial import cKDTree

        used = self.mesh.vertices[distinct(self.mesh.triangles)]
        near = cKDTree(used).query_ball_point(self.new_vertices(), least, return_length=True)
        return bool((near <= 1).all())

    def caps(self) -> list[Cap]:
        """What is replaced by what; connected parts apart."""
        gone, of_old, of_new = self._replaced()
        corners, (ones, numbers) = self.mesh.corners[self.parents < 0], np.unique(of_old, return_inverse=True)
        parts = _parted(gone, numbers), _parted(corners, np.searchsorted(ones, of_new))
        return [Cap(old, fan) for old, fan in zip(*parts, strict=True)]

    def restored(self, some: NDArray[np.int64]) -> _Sharpened:
        """The same with the old triangles in place of the connected parts that some new ones are in."""
        gone, of_old, of_new = self._replaced()
        new = np.flatnonzero(self.parents < 0)
        bad = distinct(of_new[np.isin(new, some)])
        keep = np.ones(len(self.parents), bool)
        keep[new[np.isin(of_new, bad)]] = False
        back = gone[np.isin(of_old, bad)]
        triangles = np.concatenate([self.mesh.triangles[keep], self.old.triangles[back]])
        parents = np.concatenate([self.parents[keep], back])
        rest = _Sharpened.plain(self.old, Mesh(self.mesh.vertices, triangles), parents)
        rest.measured[: keep.sum()] = self.measured[keep]
        return rest

    def _replaced(self) -> tuple[NDArray[np.int64], NDArray[np.int32], NDArray[np.int32]]:
        """Old triangles that are replaced, their connected parts, and those of the new triangles."""
        new = self.mesh.triangles[self.parents < 0]
        gone = _without(len(self.old.triangles), self.parents)
        both = np.concatenate([new, self.old.triangles[gone]])
        labels, _ = connected_components(both, len(self.mesh.vertices))
        return gone, labels[self.old.triangles[gone, 0]], labels[new[:, 0]]


@dataclass(frozen=True, eq=False)
class _Cornered:
    """A part of a surface with some added points."""

    added: NDArray[np.int64]  # their numbers; they are the first new vertices
    mesh: Mesh  # the part
    parents: NDArray[np.int64]  # triangle that each one was; -1 for new ones
    edges: Edges  # its edges
    missed: _Points  # points of sharp edges that it lacks, for edges with two triangles


class _Sharpening:
    """Attempts to add points of sharp edges to a part of a surface."""

    def __init__(self, planned: Plan, mesh: Mesh, tips: NDArray[np.float64], work: Work) -> None:
        self._planned, self._mesh, self._tips, self._work = planned, mesh, tips, work
        self._voxel, self._missed = planned.voxel, _Missed(planned, work)
        self._fit, self._fixed = self._missed.fit, np.isin(rows(mesh.vertices), rows(tips))

    def made(self, rough: float = ROUGH) -> _Sharpened | None:
        """The part with as many of the points as there can be; None for none, or for a rough surface."""
        mesh = self._mesh
        edges = edges_of(mesh.triangles)
        sided = np.zeros(len(edges.ends), bool)
        sided[self._missed.of(mesh, edges).edges] = True
        corners, there = self._missed.corners(mesh, np.flatnonzero(sided[edges.sides].any(axis=1)))
        beside, still = self._missed.beside(mesh, edges)
        added = beside.joined(corners, GAP * self._voxel)
        self._fixed[there] = self._fixed[still] = True
        banned, reach, given = np.empty((0, 3)), NEAR * self._voxel, None
        stays, before = np.ones(len(added.points), bool), math.inf
        for attempt in range(1, RETRIES + 1):
            self._work.check()
            if given is None or not stays[given.added].all():
                given = self._given(added, np.flatnonzero(stays))
            splits = _away(given.missed.points, banned, reach)
            if not splits.any() and not stays.any():
                return None
            result, fixed = self._with(given, splits, added.cornered)
            wrong = self._wrong(result)
            if not len(wrong):
                made = self._patched(result, fixed)
                return made if rough > ROUGH else self._again(made)
            fewer, before = len(wrong) < before, len(wrong)
            if before >= rough * len(result.new_vertices()):
                return None
            if attempt == RETRIES or (attempt == FEWER and len(given.missed.edges) > MANY):
                break
            at = distinct(result.mesh.triangles[wrong])
            new = result.mesh.vertices[at[at >= len(mesh.vertices)]]
            spots = np.concatenate([new, result.mesh.corners[wrong].mean(axis=1)])
            twice = splits & self._reached(given) & ~_away(given.missed.points, spots, FAR * self._voxel)
            if fewer and twice.any():  # enough, as a rule
                banned = np.concatenate([banned, given.missed.points[twice]])
                continue
            banned = np.concatenate([banned, spots])
            reach *= GROWTH
            stays = _away(added.points, banned, reach)
        return self._sound(result, wrong, fixed)

    def _again(self, before: _Sharpened) -> _Sharpened:
        """The part once more: fans leave some vertices beside sharp edges."""
        made = _Sharpening(self._planned, before.mesh, self._tips, self._work).made(math.inf)
        return before if made is None else made.after(before)

    def _sound(
        self, state: _Sharpened, wrong: NDArray[np.int64], fixed: NDArray[np.bool_]
    ) -> _Sharpened | None:
        """The part with its old triangles where new ones are wrong; None if all are."""
        while len(wrong):
            self._work.check()
            state = state.restored(wrong)
            if not len(state.new_vertices()):
                return None
            wrong = self._wrong(state)
        return self._patched(state, fixed)

    def _given(self, added: _Added, which: NDArray[np.int64]) -> _Cornered:
        """The part with some added points, and the points that it lacks."""
        old, hosts = self._mesh, added.hosts[which]
        number, splits = (len(old.vertices) + np.arange(len(which))).astype(np.int32), hosts >= 0
        place = np.arange(len(old.vertices), dtype=np.int32)
        place[~hosts[~splits]] = number[~splits]
        placed = place[old.triangles]
        a, b, c = placed[hosts[splits]].T
        new = [np.stack([p, q, number[splits]], axis=1) for p, q in ((a, b), (b, c), (c, a))]
        keep = _without(len(placed), hosts[splits])
        triangles = np.concatenate([placed[keep], *new])
        mesh = Mesh(np.concatenate([old.vertices, added.points[which]]), triangles)
        same = (placed[keep] == old.triangles[keep]).all(axis=1)
        parents = np.concatenate([np.where(same, keep, -1), np.full(len(triangles) - len(keep), -1)])
        edges = edges_of(triangles)
        missed = self._missed.of(mesh, edges)
        inner = np.bincount(edges.sides.ravel(), minlength=len(edges.ends))[missed.edges] == 2
        missed = _Points(missed.edges[inner], missed.points[inner], missed.sided)
        return _Cornered(which, mesh, parents, edges, missed)

    def _reached(self, given: _Cornered) -> NDArray[np.bool_]:
        """Points that the part has elsewhere: beside a corner, mesh edges may span a whole side."""
        away = Nearest(given.mesh).points(given.missed.points, self._work.threads)
        return away < REACHED * self._voxel

    def _with(
        self, given: _Cornered, splits: NDArray[np.bool_], cornered: NDArray[np.bool_]
    ) -> tuple[_Sharpened, NDArray[np.bool_]]:
        """The part with corners and some of the points of sharp edges, and which vertices are corners."""
        mesh, edges, points = given.mesh, given.edges, given.missed.points[splits]
        split = np.zeros(len(edges.ends), bool)
        split[given.missed.edges[splits]] = True
        whole = ~split[edges.sides].any(axis=1)
        mesh, origin = split_edges(mesh, edges.sides, split, points)
        parents = np.where(whole, given.parents, -1)[origin]
        fixed = np.zeros(len(mesh.vertices), bool)
        fixed[: len(self._fixed)] = self._fixed
        fixed[len(self._fixed) : len(self._fixed) + len(given.added)] = cornered[given.added]
        state = _Sharpened.plain(self._mesh, mesh, parents).measured_at(
            np.flatnonzero(parents < 0), self._fit
        )
        state = self._contracted(state, fixed)
        bad = state.bad(self._voxel)
        for _ in range(TURNS):
            self._work.check()
            following = self._fanned(state, fixed, bad) if len(bad) else None
            if following is None:
                break
            # the others were tried, and nothing near them has changed
            near = _rings(following.mesh, np.flatnonzero(following.parents == FAN))
            bad, state = following.bad(self._voxel), following
            bad = bad[np.isin(bad, near)]
        return state, fixed

    def _contracted(self, state: _Sharpened, fixed: NDArray[np.bool_]) -> _Sharpened:
        """The part without the very short edges of bad triangles."""
        edges, short = edges_of(state.mesh.triangles), SHORT * self._voxel
        some = distinct(edges.sides[state.bad(self._voxel)])
        lengths = np.linalg.norm(np.diff(state.mesh.vertices[edges.ends[some]], axis=1)[:, 0], axis=1)
        ends = edges.ends[some[lengths < short]]
        left, triangles = contracted(state.mesh, ends, fixed, short)
        changed = (triangles != state.mesh.triangles[left]).any(axis=1)
        parents = np.where(changed, -1, state.parents[left])
        mesh, measured = Mesh(state.mesh.vertices, triangles), state.measured[left]
        return _Sharpened(state.old, mesh, parents, measured).measured_at(np.flatnonzero(changed), self._fit)

    def _wrong(self, state: _Sharpened) -> NDArray[np.int64]:
        """New triangles that are turned over or too thin, or intersect others after quantisation."""
        mesh = state.mesh
        new, threads = state.parents < 0, self._work.threads
        as_written = quantise(mesh, used_vertices(mesh), threads=threads).mesh
        # whether a flat fold is found depends on the rounding, and the file has another one
        crossing = self_intersecting_triangles(as_written, threads=threads, among=new)
        crossing |= self_intersecting_triangles(mesh, threads=threads, among=new)
        bad = state.bad(self._voxel, 0.0, 2 * APART)
        return distinct(np.concatenate([bad[~self._across(state, bad)], np.flatnonzero(crossing)]))

    def _across(self, state: _Sharpened, some: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Whether triangles lie across a sharp edge, close to it, and face as one of its sides does."""
        corners, own = state.mesh.corners[some], state.mesh.normals[some]
        own /= np.maximum(np.linalg.norm(own, axis=1, keepdims=True), 1e-300)
        normals = self._fit.planes((INWARDS @ corners).reshape(-1, 3))[:, :3].reshape(-1, 3, 3)
        facing = (normals * own[:, None]).sum(axis=2).max(axis=1) > UP
        close = state.measured[some, OFF] <= LOOSE * self._voxel
        result: NDArray[np.bool_] = facing & close & (heights(corners) >= THIN * self._voxel)
        return result

    def _patched(self, state: _Sharpened, fixed: NDArray[np.bool_]) -> _Sharpened:
        """The part without the triangles off the surface that edges with missed points are at, as far as it
        stays sound.
        """
        mesh, edges = state.mesh, edges_of(state.mesh.triangles)
        beside = np.asarray(np.isin(edges.sides, self._missed.of(mesh, edges).edges).any(axis=1))
        near = np.flatnonzero(with_neighbours(mesh, with_neighbours(mesh, beside)))
        state = state.measured_at(near, self._fit)
        patches = self._patches(state, fixed, near[state.measured[near, OFF] > LOOSE * self._voxel])
        while patches:
            self._work.check()
            fans = np.array([triangle for _, patch in patches for triangle in patch], np.int32)
            measured = self._fit.triangles(state.mesh.vertices[fans])
            result = state.fanned([t for old, _ in patches for t in old], fans, measured)
            wrong = self._wrong(result) - (len(result.mesh.triangles) - len(fans))
            if not len(wrong):
                return result
            of = np.repeat(np.arange(len(patches)), [len(patch) for _, patch in patches])
            blamed = set(of[wrong[wrong >= 0]].tolist())
            patches = [patch for number, patch in enumerate(patches) if blamed and number not in blamed]
        return state

    def _patches(self, state: _Sharpened, fixed: NDArray[np.bool_], off: NDArray[np.int64]) -> list[Disk]:
        """Connected parts of some triangles, and the triangulations of their rims that fit best."""
        mesh, some = state.mesh, np.zeros(len(state.mesh.triangles), bool)
        some[off] = True
        taken = set(edges_of(mesh.triangles[with_neighbours(mesh, some)]).keys.tolist())
        pairs = edges_of(mesh.triangles[off]).beside.astype(np.int32)
        of, _ = connected_components(pairs[:, [0, 1, 1]], len(off))
        rims: list[tuple[list[int], list[int]]] = []
        for old in (part.tolist() for part in _parted(off, of)):
            rim = _rim(mesh.triangles[old].tolist(), fixed)
            if rim is not None and len(rim) <= RIM:
                rims.append((old, rim))
        patches: list[Disk] = []
        for (old, rim), costs in zip(rims, self._costs(mesh.vertices, [rim for _, rim in rims]), strict=True):
            own = edges_of(mesh.triangles[old])
            inner = set(own.keys[own.sides.ravel()[own.pairs[:, 0]]].tolist())
            patch = _best(rim, costs, taken, inner)
            if patch:
                patches.append((old, patch))
                taken.update(edges_of(np.array(patch, np.int32)).keys.tolist())
        return patches

    def _costs(self, vertices: NDArray[np.float64], rims: list[list[int]]) -> list[Costs]:
        """Distances from the surface of the triangles between any three corners of rims; infinite for those
        that face elsewhere, are too far off or too thin.
        """
        ways = [list(combinations(range(len(rim)), 3)) for rim in rims]
        if not ways:
            return []
        corners = vertices[
            np.concatenate([np.array(r)[np.array(w)] for r, w in zip(rims, ways, strict=True)])
        ]
        measured = self._fit.triangles(corners)
        good = (measured[:, UPRIGHT] > UP) & (measured[:, OFF] <= LOOSE * self._voxel)
        good &= heights(corners) >= THIN * self._voxel
        off = iter(np.where(good, measured[:, OFF], math.inf).tolist())
        return [dict(zip(own, islice(off, len(own)), strict=True)) for own in ways]

    def _fanned(
        self, state: _Sharpened, fixed: NDArray[np.bool_], bad: NDArray[np.int64]
    ) -> _Sharpened | None:
        """Replace bad triangles by fans around new vertices or corners; None if none can be replaced."""
        mesh, voxel = state.mesh, self._voxel
        apex = fixed.copy()
        apex[len(state.old.vertices) :] = True
        near = bad[np.argsort(~fixed[mesh.triangles[bad]].any(axis=1), kind="stable")].tolist()
        ways = (v for t in near for v in sorted(mesh.triangles[t].tolist(), key=lambda v: not fixed[v]))
        apexes = [v for v in dict.fromkeys(ways) if apex[v]]
        found = _grow_disks(state, fixed, THIN * voxel, bad, apexes, self._work.threads)
        found = list({(*old, fan[0][2]): (old, fan) for old, fan in found}.values())
        if not found:
            return None
        fans = np.array([triangle for _, fan in found for triangle in fan], np.int32)
        measured = self._fit.triangles(mesh.vertices[fans])
        gone, stays, begin = set[int](), np.zeros(len(fans), bool), 0
        for old, fan in found:
            own = slice(begin, begin := begin + len(fan))
            limit = max(SLACK * state.measured[old, OFF].max(), LOOSE * voxel)
            good = measured[own, OFF].max() <= limit and measured[own, UPRIGHT].min() > UP
            if good and gone.isdisjoint(old):
                gone.update(old)
                stays[own] = True
        return state.fanned(sorted(gone), fans[stays], measured[stays]) if gone else None


def _grow_disks(
    state: _Sharpened,
    fixed: NDArray[np.bool_],
    thin: float,
    some: NDArray[np.int64],
    apexes: Sequence[int],
    threads: int,
) -> list[Disk]:
    """Disks of triangles around vertices, each seen in full from there, with their fans.

    Only triangles within `RINGS` of some are known, as disks are small.
    """
    which = _rings(state.mesh, some)
    vertices, corners = np.unique(state.mesh.triangles[which], return_inverse=True)
    corners = corners.reshape(-1, 3).astype(np.int64)
    after = np.roll(corners, -1, axis=1)
    keys, back = ((a << 32 | b).ravel() for a, b in ((corners, after), (after, corners)))
    order = np.argsort(keys)
    place = np.minimum(np.searchsorted(keys, back, sorter=order), len(keys) - 1)
    beyond = np.where(keys[order[place]] == back, order[place] // 3, -1).reshape(-1, 3)
    normals = np.ascontiguousarray(state.measured[which, :3])
    found = fans(
        corners.astype(np.int32),
        beyond,
        state.mesh.vertices[vertices],
        normals,
        np.round(normals, 3),
        fixed[vertices],
        np.searchsorted(vertices, np.array(apexes, np.int64)).astype(np.int32),
        thin,
        SHARP,
        MOST,
        threads,
    )
    return [
        (which[disk].tolist(), [(a, b, c) for a, b, c in vertices[np.array(fan)].tolist()])
        for disk, fan in filter(None, found)
    ]


def _parted(values: NDArray[Any], of: NDArray[np.integer]) -> list[NDArray[Any]]:
    """Rows of an array by the parts that they are of, numbered from 0 on; of negative ones none."""
    order = np.argsort(of, kind="stable")
    starts = np.searchsorted(of[order], np.arange(of.max(initial=-1) + 1))
    return np.split(values[order], starts)[1:]


def _best(
    rim: list[int], costs: Costs, taken: set[int], inner: set[int]
) -> list[tuple[int, int, int]] | None:
    """Triangulation of a rim that is off the surface by least in total; without edges that are taken but for
    those inside.
    """
    count = len(rim)
    best = {(i, i + 1): (0.0, -1) for i in range(count - 1)}
    for i, k in ((i, i + gap) for gap in range(2, count) for i in range(count - gap)):
        low, high = sorted((rim[i], rim[k]))
        split = min((best[i, j][0] + best[j, k][0] + costs[i, j, k], j) for j in range(i + 1, k))
        edge = low << 32 | high
        free = k - i == count - 1 or edge in inner or edge not in taken
        best[i, k] = split if free else (math.inf, -1)
    result, left = [], [(0, count - 1)]
    while left and best[0, count - 1][0] < math.inf:
        i, k = left.pop()
        j = best[i, k][1]
        if j >= 0:
            result.append((rim[i], rim[j], rim[k]))
            left += [(i, j), (j, k)]
    return result or None


def _rim(triangles: list[list[int]], fixed: NDArray[np.bool_]) -> list[int] | None:
    """Vertices on the rim of a disk, in order; None for what is no disk, or has a corner inside."""
    sides = {side for a, b, c in triangles for side in ((a, b), (b, c), (c, a))}
    loop = _loop(triangles, [(a, b) for a, b in sides if (b, a) not in sides])
    return None if loop is None or fixed[list({*chain(*triangles)} - {*loop})].any() else loop


def _loop(triangles: list[list[int]], rim: list[tuple[int, int]]) -> list[int] | None:
    """Vertices on the rim of triangles, in order, from the least on; None for what is no disk."""
    following = dict(rim)
    if not rim or len(following) < len(rim):
        return None
    loop = [min(following)]
    while (there := following.pop(loop[-1], -1)) >= 0:
        loop.append(there)
    vertices, count = {*chain(*triangles)}, len(triangles)
    euler = len(vertices) - (3 * count + len(rim)) // 2 + count
    return loop[:-1] if loop[-1] == loop[0] and not following and euler == 1 else None


def _bent(mesh: Mesh, edges: Edges) -> NDArray[np.int64]:
    """Vertices at which triangles face differently, but for those on the rim of a part."""
    flat = mesh.normals / np.maximum(np.linalg.norm(mesh.normals, axis=1, keepdims=True), 1e-300)
    one, other = edges.beside.T
    bent = edges.sides.ravel()[edges.pairs[:, 0]][(flat[one] * flat[other]).sum(axis=1) < BENT]
    rim = np.bincount(edges.sides.ravel(), minlength=len(edges.ends)) == 1
    some = distinct(edges.ends[bent])
    return uncrowded(mesh.triangles, some[~np.isin(some, edges.ends[rim])])


def _without(count: int, some: NDArray[np.integer]) -> NDArray[np.int64]:
    """Numbers below a count but for some; negative ones are none."""
    left = np.ones(count, bool)
    left[some[some >= 0]] = False
    return np.flatnonzero(left)


def _alone(
    mesh: Mesh, some: NDArray[np.int64], points: NDArray[np.float64], least: float
) -> NDArray[np.int64]:
    """Numbers of the vertices that come to lie apart from the others; the first ones have precedence."""
    from scipy.spatial import cKDTree

    used = distinct(mesh.triangles)
    rank = np.full(len(mesh.vertices), -1)
    rank[some] = np.arange(len(some))
    placed = mesh.vertices.copy()
    placed[some] = points
    pairs = rank[used[cKDTree(placed[used]).query_pairs(least, output_type="ndarray")]]
    return _without(len(some), pairs.max(axis=1, initial=-1))


def _rings(mesh: Mesh, some: NDArray[np.int64]) -> NDArray[np.int64]:
    """Some triangles of a mesh and those within `RINGS` of them."""
    near = np.zeros(len(mesh.triangles), bool)
    near[some] = True
    for _ in range(RINGS):
        near = with_neighbours(mesh, near)
    return np.flatnonzero(near)


def _away(points: NDArray[np.float64], banned: NDArray[np.float64], reach: float) -> NDArray[np.bool_]:
    """Whether points are farther than `reach` from all banned ones."""
    from scipy.spatial import cKDTree

    if not len(banned) or not len(points):
        return np.ones(len(points), bool)
    away: NDArray[np.bool_] = cKDTree(banned).query(points, distance_upper_bound=2 * reach)[0] > reach
    return away
