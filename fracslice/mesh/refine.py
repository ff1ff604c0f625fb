"""Adaptive refinement: triangles are split, and edges flipped, until none is farther from the surface than
a chord.

Red-green refinement (Bank, Sherman and Weiser 1983, "Some refinement algorithms and data structures for
regular local mesh refinement"): both triangles at a split edge are split.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..common.arrays import distinct
from ..fields.field import Field
from ..work import Work
from .contouring import anywhere, project
from .fit import OFF, UPRIGHT, Fit, Fitted
from .model import Mesh, self_intersecting_triangles
from .tips import heights

STEPS = 6
NEAREST = 4e-3
"""Minimum distance from the sharp edge at which planes are evaluated, relative to the length of the mesh
edge.
"""

ANGLE = 0.05
"""Minimum sine between two planes; below it they count as one."""


LEAST = 0.1
"""Minimum determinant of the normals of three sides that meet in a corner."""

SAME = 0.95
"""Minimum cosine between the normals of one side, far from the sharp edge and near it."""

REACH = 0.9
"""Maximum displacement of the midpoint, relative to the length of its edge."""


def on_creases(
    fit: Fit, ends: NDArray[np.float64], starts: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Points on sharp edges near the midpoints of mesh edges.

    The tangent planes of the field on both sides are intersected repeatedly, each time closer to their
    intersection: Newton's method for two equations.

    `ends`, `starts`: float64 (n, 2, 3). Returns float64 (n, 3); bool (n,).
    """
    middles = there = ends.mean(axis=1)
    length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    points, spacing, first = starts, length / 4, np.empty(0)
    for step in range(STEPS):
        planes = fit.planes(points.reshape(-1, 3)).reshape(-1, 2, 4)
        normals = planes[..., :3]
        first = normals if step == 0 else first
        points = points - planes[..., 3:] * normals
        move = _nearest(normals, ((points - there[:, None]) * normals).sum(axis=2))
        size = np.linalg.norm(move, axis=1)
        there = there + move * np.minimum(1, length / np.maximum(size, 1e-300))[:, None]
        along = _unit(np.cross(normals[:, 0], normals[:, 1]))[:, None]
        directions = points - there[:, None]
        directions = _unit(directions - (directions * along).sum(axis=2, keepdims=True) * along)
        spacing = np.maximum(np.minimum(2 * size, spacing / 2), NEAREST * length)
        points = there[:, None] + spacing[:, None, None] * directions
    result = ((first * normals).sum(axis=2) > SAME).all(axis=1) & (size < NEAREST / 4 * length)
    result &= np.linalg.norm(there - middles, axis=1) < REACH * length
    return there, result


def on_three(
    fit: Fit, around: NDArray[np.float64], size: float
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Corners of the surface near some points each, where three of its sides meet.

    As `on_creases`, with the three of the tangent planes at the points that differ most.

    `around`: float64 (n, k, 3); `size` in scene units. Returns float64 (n, 3); bool (n,).
    """
    there, each = around.mean(axis=1), np.arange(len(around))
    normals = fit.planes(around.reshape(-1, 3))[:, :3].reshape(around.shape)
    second = (normals * normals[:, :1]).sum(axis=2).argmin(axis=1)
    across = np.cross(normals[:, 0], normals[each, second])
    third = np.abs((normals * across[:, None]).sum(axis=2)).argmax(axis=1)
    points = np.stack([around[:, 0], around[each, second], around[each, third]], axis=1)
    result = np.ones(len(around), bool)
    first: NDArray[np.float64] = np.empty(0)
    moved = spacing = np.full(len(around), size / 4, np.float64)
    for step in range(STEPS):
        planes = fit.planes(points.reshape(-1, 3)).reshape(-1, 3, 4)
        normals = planes[..., :3]
        first = normals if step == 0 else first
        result &= np.abs(np.linalg.det(normals)) > LEAST
        points = points - planes[..., 3:] * normals
        off = ((points - there[:, None]) * normals).sum(axis=2)
        move = np.linalg.solve(np.where(result[:, None, None], normals, np.eye(3)), off[..., None])[..., 0]
        there, moved = there + move, np.linalg.norm(move, axis=1)
        spacing = np.maximum(np.minimum(2 * moved, spacing / 2), NEAREST * size)
        points = there[:, None] + spacing[:, None, None] * _midways(normals, points - there[:, None])
    result &= ((first * normals).sum(axis=2) > SAME).all(axis=1) & (moved < NEAREST / 4 * size)
    return there, result


def _unit(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Unit vectors; zero where there is no direction."""
    result: NDArray[np.float64] = vectors / np.maximum(
        np.linalg.norm(vectors, axis=-1, keepdims=True), 1e-300
    )
    return result


def _midways(normals: NDArray[np.float64], ways: NDArray[np.float64]) -> NDArray[np.float64]:
    """Unit vectors from corners into their three sides, midway between the sharp edges on both sides of
    `ways`: differences of the field do not reach beyond these.

    `normals`, `ways`: float64 (n, 3, 3).
    """
    one = _unit(np.cross(normals, np.roll(normals, -1, axis=1)))
    other = _unit(np.cross(normals, np.roll(normals, 1, axis=1)))
    turn = (np.cross(one, other) * normals).sum(axis=2)
    shares = (np.cross(a, b) * normals for a, b in ((ways, other), (one, ways)))
    first, second = (np.where(share.sum(axis=2) * turn < 0, -1.0, 1.0)[..., None] for share in shares)
    return _unit(first * one + second * other)


def _nearest(normals: NDArray[np.float64], off: NDArray[np.float64]) -> NDArray[np.float64]:
    """Shortest vectors from points to the intersection of two planes at signed distances `off`, or, if these
    are nearly parallel, to the plane midway.
    """
    cosine = (normals[:, 0] * normals[:, 1]).sum(axis=1)
    square = 1 - cosine**2
    sharp = square > ANGLE**2
    share = (off - cosine[:, None] * off[:, ::-1]) / np.where(sharp, square, 1)[:, None]
    share[~sharp] = off[~sharp] / 2
    result: NDArray[np.float64] = (share[..., None] * normals).sum(axis=1)
    return result


NEEDLE = 0.3
"""Maximum ratio of the shortest to the longest side of a needle. A needle is split at both of its long sides
or at none.
"""


class Edges(NamedTuple):
    """Edges of a closed mesh."""

    ends: NDArray[np.int64]  # end points, the lower index first
    sides: NDArray[np.int64]  # edges of each triangle; side k runs from corner k to the next

    @property
    def keys(self) -> NDArray[np.int64]:
        """Unique key of each edge, made of its end points, int64 [e]."""
        result: NDArray[np.int64] = self.ends[:, 0] << 32 | self.ends[:, 1]
        return result

    def has(self, one: NDArray[np.int64], other: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Whether there are edges between these vertices; arrays that broadcast together."""
        keys, wanted = self.keys, np.minimum(one, other) << 32 | np.maximum(one, other)
        place = np.searchsorted(keys, wanted)
        return np.asarray((place < len(keys)) & (np.append(keys, -1)[place] == wanted))

    @property
    def pairs(self) -> NDArray[np.int64]:
        """Sides, 3 * triangle + number, at each edge that two triangles share, int64 [k, 2]."""
        order = np.argsort(self.sides.ravel(), kind="stable")
        at = self.sides.ravel()[order]
        first = np.flatnonzero(at[1:] == at[:-1])
        return np.stack([order[first], order[first + 1]], axis=1)

    @property
    def beside(self) -> NDArray[np.int64]:
        """The two triangles at each edge that two share, int64 [k, 2]."""
        return self.pairs // 3


def edges_of(triangles: NDArray[np.int32]) -> Edges:
    """Edges of a closed mesh.

    `triangles`: int32 (m, 3).
    """
    ends = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2).astype(np.int64)
    ends.sort(axis=2)
    keys, sides = np.unique(ends[..., 0] << 32 | ends[..., 1], return_inverse=True)
    return Edges(np.stack([keys >> 32, keys & 0xFFFFFFFF], axis=1), sides.reshape(-1, 3))


def with_neighbours(mesh: Mesh, some: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Some triangles of a mesh, bool (m,), and those that share a vertex with them."""
    return _at(mesh, mesh.triangles[some])


def _at(mesh: Mesh, vertices: NDArray[np.integer]) -> NDArray[np.bool_]:
    """Whether triangles of a mesh are at some vertices, bool (m,)."""
    near = np.zeros(len(mesh.vertices), bool)
    near[vertices] = True
    return np.asarray(np.logical_or.reduce([near[corner] for corner in mesh.triangles.T]))


def with_needles(
    split: NDArray[np.bool_], sides: NDArray[np.int64], lengths: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """Add the other long side of needles with a split side. Half a needle would be nearly degenerate.

    `split`: bool (e,); `sides`: int64 (m, 3); `lengths`: float64 (e,). Returns bool (e,).
    """
    own = lengths[sides]
    longest = own.max(axis=1, keepdims=True)
    needles = np.flatnonzero(own.min(axis=1) < NEEDLE * longest[:, 0])
    sides, long = sides[needles], own[needles] > longest[needles] / 2
    while True:
        more = distinct(sides[(split[sides] & long).any(axis=1)[:, None] & long & ~split[sides]])
        if not len(more):
            return split
        split = split.copy()
        split[more] = True


def split_edges(
    mesh: Mesh, sides: NDArray[np.int64], split: NDArray[np.bool_], there: NDArray[np.float64]
) -> tuple[Mesh, NDArray[np.int64]]:
    """Split edges of a mesh.

    `sides`: int64 (m, 3); `split`: bool (e,); `there`: float64 (k, 3). Returns int64 (j,).
    """
    number = np.full(len(split), -1, np.int32)
    number[split] = len(mesh.vertices) + np.arange(split.sum(), dtype=np.int32)
    vertices = np.concatenate([mesh.vertices, there])
    cuts = split[sides].sum(axis=1)
    parts, parents = [mesh.triangles[cuts == 0]], [np.flatnonzero(cuts == 0)]
    for count in (1, 2, 3):
        own = np.flatnonzero(cuts == count)
        pieces = _split_triangles(mesh.triangles[own], number[sides[own]], count, vertices)
        parts += pieces
        parents += [own] * len(pieces)
    return Mesh(vertices, np.concatenate(parts)), np.concatenate(parents)


def _split_triangles(
    triangles: NDArray[np.int32], middles: NDArray[np.int32], count: int, vertices: NDArray[np.float64]
) -> list[NDArray[np.int32]]:
    """Triangles split at `count` of their sides. Midpoint vertices int32 [m, 3]; -1 for a whole side."""
    # Rotated so that the split side comes first, or the whole one last.
    first = np.argmax(middles >= 0, axis=1) if count == 1 else (np.argmin(middles, axis=1) + 1) % 3
    turn = (first[:, None] + np.arange(3)) % 3
    a, b, c = np.take_along_axis(triangles, turn, axis=1).T
    p, q, r = np.take_along_axis(middles, turn, axis=1).T
    if count == 1:
        return [np.stack([a, p, c], 1), np.stack([p, b, c], 1)]
    corner = np.stack([p, b, q], 1)
    if count == 3:
        return [corner, np.stack([a, p, r], 1), np.stack([r, q, c], 1), np.stack([p, q, r], 1)]
    across = vertices[[a, p]] - vertices[[q, c]]
    shorter = np.diff(np.linalg.norm(across, axis=2), axis=0)[0, :, None] > 0
    one = np.where(shorter, np.stack([a, p, q], 1), np.stack([a, p, c], 1))
    other = np.where(shorter, np.stack([a, q, c], 1), np.stack([p, q, c], 1))
    return [corner, one, other]


EVEN = 0.98
"""Minimum cosine between triangles around a vertex that vanishes, before and after."""


CROWDED = 64
"""Most triangles around a vertex that is looked at together with others."""


def uncrowded(triangles: NDArray[np.int32], some: NDArray[np.int64]) -> NDArray[np.int64]:
    """Those of some vertices that have few triangles."""
    counts = np.bincount(triangles.ravel(), minlength=some.max(initial=0) + 1)
    few: NDArray[np.int64] = some[counts[some] <= CROWDED]
    return few


def stars(triangles: NDArray[np.int32], some: NDArray[np.int64]) -> NDArray[np.int64]:
    """Triangles at some vertices, the last ones repeated in rows of those that have fewer, [n, k]."""
    order = np.argsort(triangles, axis=None, kind="stable")
    starts = np.searchsorted(triangles.ravel()[order], np.stack([some, some + 1]))
    most = np.diff(starts, axis=0).max(initial=1)
    places = np.minimum(starts[0][:, None] + np.arange(most), starts[1][:, None] - 1)
    result: NDArray[np.int64] = order[places] // 3
    return result


def placed(
    mesh: Mesh, some: NDArray[np.int64], there: NDArray[np.float64], up: NDArray[np.float64], thin: float
) -> Mesh:
    """A mesh with some vertices at other places, where all triangles around them face upwards and are not
    thin, but for vertices on its rim.
    """
    edges = edges_of(mesh.triangles)
    rim = np.bincount(edges.sides.ravel(), minlength=len(edges.ends)) == 1
    inner = ~np.isin(some, edges.ends[rim]) & np.isin(some, uncrowded(mesh.triangles, some))
    some, there, up = some[inner], there[inner], up[inner] / np.linalg.norm(up[inner], axis=1, keepdims=True)
    star = stars(mesh.triangles, some)
    while len(some):
        vertices = mesh.vertices.copy()
        vertices[some] = there
        wide, normals = measures(vertices[mesh.triangles[star]], thin)
        good = (wide & ((normals * up[:, None]).sum(axis=2) > LEAST)).all(axis=1)
        if good.all():
            return Mesh(vertices, mesh.triangles)
        some, there, up, star = some[good], there[good], up[good], star[good]
    return mesh


def contracted(
    mesh: Mesh, ends: NDArray[np.int64], fixed: NDArray[np.bool_], short: float
) -> tuple[NDArray[np.int64], NDArray[np.int32]]:
    """Triangles that are left without some short edges at vertices of flat sides, and their corners.

    `ends`: int64 (n, 2).
    """
    left, triangles, stay = np.arange(len(mesh.triangles)), mesh.triangles, fixed.copy()
    edges = edges_of(triangles)
    stay[edges.ends[np.bincount(edges.sides.ravel(), minlength=len(edges.ends)) == 1]] = True
    ways = np.stack([ends, ends[:, ::-1]], axis=1).reshape(-1, 2)
    ways = ways[~stay[ways[:, 1]]]
    for _ in range(PASSES):
        ways, vertices = _shrinking(Mesh(mesh.vertices, triangles), ways, short / 2)
        claims = np.full(len(mesh.vertices), len(ways))
        np.minimum.at(claims, vertices, np.arange(len(ways))[:, None])
        now = (claims[vertices] == np.arange(len(ways))[:, None]).all(axis=1)
        if not now.any():
            break
        place = np.arange(len(mesh.vertices), dtype=np.int32)
        place[ways[now, 1]] = ways[now, 0]
        triangles, ways = place[triangles], ways[~now]
        whole = (triangles != np.roll(triangles, 1, axis=1)).all(axis=1)
        left, triangles = left[whole], triangles[whole]
    return left, triangles


def _shrinking(
    mesh: Mesh, ways: NDArray[np.int64], thin: float
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Pairs of vertices of which the second can become the first, and all vertices around the second, [n, k].

    The triangles around it, but for thin ones, face one way, and all do then, and are not thin.
    """
    mesh = Mesh(mesh.vertices, mesh.triangles[_at(mesh, ways)])
    edges, (keep, vanish) = edges_of(mesh.triangles), ways.T
    there = edges.has(keep, vanish) & np.isin(vanish, uncrowded(mesh.triangles, vanish))
    ways, keep, vanish = ways[there], keep[there], vanish[there]
    star = stars(mesh.triangles, vanish)
    once = np.diff(star, axis=1, prepend=-1) != 0
    corners = mesh.triangles[star].astype(np.int64)
    both = (corners == keep[:, None, None]).any(axis=2)
    common = edges.has(corners, keep[:, None, None]) & (corners != vanish[:, None, None]) & once[..., None]
    moved = np.where(corners == vanish[:, None, None], keep[:, None, None], corners)
    wide, normals = measures(mesh.vertices[corners], thin)
    wider, others = measures(mesh.vertices[moved], thin)
    middle = np.where((wide & once)[..., None], normals, 0).sum(axis=1)
    middle /= np.maximum(np.linalg.norm(middle, axis=1, keepdims=True), 1e-300)
    even = (normals * middle[:, None]).sum(axis=2) > EVEN, (others * middle[:, None]).sum(axis=2) > EVEN
    good = wide.any(axis=1) & (even[0] | ~wide).all(axis=1) & ((even[1] & wider) | both).all(axis=1)
    good &= ((both & once).sum(axis=1) == 2) & (common.sum(axis=(1, 2)) == 4)
    return ways[good], corners.reshape(len(good), 3 * star.shape[1])[good]


def measures(corners: NDArray[np.float64], thin: float) -> tuple[NDArray[np.bool_], NDArray[np.float64]]:
    """Whether triangles are wider, and their unit normals."""
    flat = corners.reshape(-1, 3, 3)
    wide = heights(flat) > thin
    return wide.reshape(corners.shape[:-2]), _normals(flat).reshape(corners.shape[:-1])


def _normals(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """Unit normals of triangles, [m, 3]."""
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    result: NDArray[np.float64] = across / np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-300)
    return result


ROUNDS = 12
"""Maximum rounds of independent flips."""

FINE = np.cos(np.radians(10))
"""Cosine between the normals of a triangle and of the field down to which a flip may reduce it."""

STEEP, BETTER = np.cos(np.radians(29)), 0.02
"""Triangles with a smaller cosine than `STEEP` are flipped only if the smaller of both cosines grows by more
than `BETTER`.
"""

OBTUSE = 1e-6
"""An edge is flipped if the sine of the sum of its opposite angles is below the negative of this."""


class Flips(NamedTuple):
    """Candidate flips."""

    old: NDArray[np.int64]  # the two triangles at each edge
    new: NDArray[np.int32]  # corners of the triangles that replace them
    ends: NDArray[np.int32]  # end points of the new edge, ascending

    def some(self, which: NDArray[np.bool_] | NDArray[np.int64]) -> Flips:
        """Select flips.

        `which`: bool (k,).
        """
        return Flips(self.old[which], self.new[which], self.ends[which])


def flip(state: Fitted, due: NDArray[np.bool_]) -> tuple[Fitted, NDArray[np.bool_]]:
    """Flip edges whose opposite angles sum up to more than 180 degrees.

    An edge stays if the flip would increase the angle between a triangle's normal and the field's, for
    example at a sharp edge, or the distance from the surface.

    `due`: bool (m,). Returns bool (m,).
    """
    triangles, measured = state.mesh.triangles.copy(), state.measured.copy()
    mesh = Mesh(state.mesh.vertices, triangles)
    changed = np.zeros(len(measured), bool)
    for _ in range(ROUNDS):
        flips, worth = _candidates(mesh, due, measured[:, UPRIGHT] < STEEP)
        flips = flips.some(_independent(flips, worth, len(measured)))
        if not len(flips.old):
            break
        before = measured[flips.old]
        after = state.fit.triangles(mesh.vertices[flips.new].reshape(-1, 3, 3)).reshape(
            -1, 2, before.shape[2]
        )
        was, now = before[..., UPRIGHT].min(axis=1), after[..., UPRIGHT].min(axis=1)
        good = np.where(was < STEEP, now > was + BETTER, now >= np.minimum(was, FINE))
        good &= after[..., OFF].max(axis=1) <= np.maximum(before[..., OFF].max(axis=1), state.fit.reach)
        flips = flips.some(good)
        triangles[flips.old], measured[flips.old] = flips.new, after[good]
        due = np.zeros(len(measured), bool)
        changed[flips.old] = due[flips.old] = True
    return Fitted(mesh, state.fit, measured), changed


def _candidates(
    mesh: Mesh, due: NDArray[np.bool_], steep: NDArray[np.bool_]
) -> tuple[Flips, NDArray[np.float64]]:
    """Candidate flips at due triangles and their worth: edges with too large opposite angles, and edges of
    steep triangles. A smaller worth is better.
    """
    some = np.flatnonzero(with_neighbours(mesh, due))
    edges = edges_of(mesh.triangles[some])
    half = edges.pairs
    old = some[half // 3]
    half = half[due[old].any(axis=1)]
    old, side = some[half // 3], half % 3
    a, b, c = (mesh.triangles[old[:, 0], (side[:, 0] + k) % 3] for k in range(3))
    d = mesh.triangles[old[:, 1], (side[:, 1] + 2) % 3]
    worth = _sine_of_sum(mesh.vertices, a, b, c, d)
    new = np.stack([np.stack([a, d, c], axis=1), np.stack([d, b, c], axis=1)], axis=1)
    ends = np.sort(np.stack([c, d], axis=1), axis=1)
    worth = np.where(steep[old].any(axis=1), worth - 2, worth)
    kept = np.flatnonzero((worth < -OBTUSE) & (c != d))
    kept = kept[~edges.has(*ends[kept].astype(np.int64).T)]
    return Flips(old, new, ends).some(kept), worth[kept]


def _sine_of_sum(p: NDArray[np.float64], a, b, c, d) -> NDArray[np.float64]:  # type: ignore[no-untyped-def]
    """Sine of the sum of the angles at c and d, opposite to the edge (a, b)."""
    parts = []
    for tip in (c, d):
        u, v = p[a] - p[tip], p[b] - p[tip]
        size = np.maximum(np.linalg.norm(u, axis=1) * np.linalg.norm(v, axis=1), 1e-300)
        parts.append(((u * v).sum(axis=1) / size, np.linalg.norm(np.cross(u, v), axis=1) / size))
    (cos_c, sin_c), (cos_d, sin_d) = parts
    result: NDArray[np.float64] = sin_c * cos_d + cos_c * sin_d
    return result


def _independent(flips: Flips, worth: NDArray[np.float64], count: int) -> NDArray[np.int64]:
    """Independent flips: the best one of each triangle, with no triangle or new edge in common."""
    order = np.argsort(worth, kind="stable")
    rank = np.empty(len(order), np.int64)
    rank[order] = np.arange(len(order))
    best = np.full(count, len(order), np.int64)
    np.minimum.at(best, flips.old.ravel(), np.repeat(rank, 2))
    own = np.flatnonzero((best[flips.old] == rank[:, None]).all(axis=1))
    _, first = np.unique(flips.ends[own].astype(np.int64) @ [1 << 32, 1], return_index=True)
    return own[np.sort(first)]


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

UPRIGHT_COSINE = np.cos(np.radians(29))
"""Minimum cosine between the normals of a new triangle and of the field."""

CREASED = 0.9
"""Maximum cosine between the field's normals on both sides of a sharp edge."""


@dataclass(frozen=True)
class Refined:
    """Result of a refinement."""

    chord_mm: float  # maximum distance of a triangle from the surface
    from_triangles: int  # triangles before the refinement
    # estimate of the greatest distance, from samples of the triangles a quarter of a side apart
    off_mm: float
    # triangles with a sample out of tolerance: in rough places, or where smaller triangles would turn over or
    # intersect
    left: int

    @property
    def notes(self) -> tuple[str, ...]:
        """Note on triangles out of tolerance, tuple of str; empty if there are none."""
        chord = f"the chord of {self.chord_mm:.3g} mm"
        far = f"{self.left:,} triangles are farther off than {chord}, up to {self.off_mm:.2g} mm"
        return (far,) if self.left else ()

    def scaled(self, scale: float) -> Refined:
        """Convert the lengths to other units."""
        return replace(self, chord_mm=scale * self.chord_mm, off_mm=scale * self.off_mm)


def refine(
    root: Field, mesh: Mesh, chord: float, voxel: float, work: Work | None = None
) -> tuple[Mesh, Refined]:
    """Split edges until no triangle is farther than `chord` from the surface.

    New vertices lie on the surface, and on sharp edges that a mesh edge follows or crosses. Edges are then
    flipped to improve the normals of triangles. Old vertices do not move. The surface stays closed and free
    of self-intersections: a split that would cause one is refused.

    All lengths in scene units.
    """
    work, count = work or Work(), len(mesh.triangles)
    state = Fitted.of(mesh, Fit(root, AIM * chord, voxel, work))
    latest = refused = np.empty(0, np.int64)
    for number in range(PASSES):
        work.progress("refining", number / PASSES)
        edges = edges_of(state.mesh.triangles)
        free = ~np.isin(edges.keys, np.concatenate([latest, _repeated_values(refused)]))
        split, there = _edges_to_split(root, state, edges, free, voxel, work)
        if not split.any():
            break
        state, left = _split_and_flip(state, edges, split, there, work)
        latest = edges.keys[left]
        refused = np.concatenate([refused, latest])
        if (split.sum() - len(latest)) * WORTH < np.count_nonzero(state.off > state.fit.reach):
            break
    far = np.count_nonzero(state.off > state.fit.reach)
    return state.mesh, Refined(chord, count, float(state.off.max()) / AIM, int(far))


def _repeated_values(keys: NDArray[np.int64]) -> NDArray[np.int64]:
    """Values that occur more than once."""
    result, counts = np.unique(keys, return_counts=True)
    return result[counts > 1]


def _edges_to_split(
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
    points, creased = _crease_points(state, edges, far)
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


def _crease_points(
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


def _split_and_flip(
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
        mesh, parents = split_edges(old, edges.sides, now, there[keep])
        cut_up = np.asarray(now[edges.sides]).any(axis=1)
        fresh = np.take(cut_up, parents)
        result, flipped = flip(state.become(mesh, parents, fresh), fresh)
        blamed = _folding_vertices(result, fresh | flipped, len(old.vertices), work)
        if not blamed.any():
            return result, chosen[~keep]
        keep[np.flatnonzero(keep)[blamed]] = False
    return state, chosen


def _folding_vertices(state: Fitted, fresh: NDArray[np.bool_], first: int, work: Work) -> NDArray[np.bool_]:
    """New vertices, from index `first` on, at or next to triangles that turn away from the surface or
    intersect others.
    """
    mesh = state.mesh
    crossing = self_intersecting_triangles(mesh, threads=work.threads, among=fresh)
    away = fresh & (state.upright < UPRIGHT_COSINE) & (mesh.triangles >= first).any(axis=1)
    marked = np.zeros(len(mesh.vertices), bool)
    marked[mesh.triangles[crossing]] = True
    if crossing.any() and not marked[first:].any():
        marked[mesh.triangles[with_neighbours(mesh, crossing)]] = True
    marked[mesh.triangles[away]] = True
    return marked[first:]
