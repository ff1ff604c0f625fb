"""Sharp tips of a solid beyond its last samples: pointed vertices, and fans of triangles in place of blunt
ends.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._native import corners_by_vertex, pointed, touching
from ..common.arrays import distinct
from ..volume import Plan
from ..volume.bricks import values_at
from ..volume.extent import SLANTS, climb
from ..work import Work
from .cleaning import quantise, used_vertices
from .contouring import Piece
from .fit import OFF, UPRIGHT, Fit
from .model import Mesh, self_intersecting_triangles
from .shells import NOTHING, Pieces, join_at_seam, near_plane, rows

ANGLES = 0.6, 0.3, 0.1
"""Minimum sines of the elevation of a tip above the planes of the triangles it replaces."""

THIN = 0.01
"""Minimum height of a new triangle, voxels: rounding cannot turn it over."""

MOST = 64
"""Maximum number of triangles that a tip replaces."""


class Cap(NamedTuple):
    """A disk of triangles and the fan that replaces it."""

    old: NDArray[np.int64]  # indices of the replaced triangles
    fan: NDArray[np.float64]  # corners of the new triangles; the tip is the last corner of each


class Rings:
    """One-ring neighbourhoods of the vertices of a mesh."""

    def __init__(self, mesh: Mesh) -> None:
        self.mesh = mesh
        self._start, self._corner = corners_by_vertex(mesh.triangles, len(mesh.vertices))

    def at(self, points: NDArray[np.float64]) -> NDArray[np.int64]:
        """Look up vertices by position.

        `points`: float64 (n, 3). Returns int64 (n,).
        """
        once, which = np.unique(rows(points), return_inverse=True)
        result = np.intersect1d(rows(self.mesh.vertices), once, return_indices=True)[1]
        return np.asarray(result[which])

    def around(self, vertices: NDArray[np.integer]) -> NDArray[np.int64]:
        """Triangles incident to any of some vertices.

        `vertices`: integers (n,). Returns int64 (k,).
        """
        corners = [self._corner[self._start[v] : self._start[v + 1]] for v in vertices]
        return distinct(np.concatenate(corners) // 3)

    def nearest(self, vertices: NDArray[np.integer], points: NDArray[np.float64]) -> NDArray[np.int64]:
        """Vertices close to points, by greedy descent along edges.

        `vertices`: integers (n,); `points`: float64 (n, 3). Returns int64 (n,).
        """
        out, moving = np.array(vertices, np.int64), np.arange(len(points))
        while len(moving):
            ring, of = self._rings(out[moving])
            far = np.linalg.norm(self.mesh.vertices[ring] - points[moving[of]], axis=1)
            order = np.lexsort([ring, far, of])
            best = ring[order[np.searchsorted(of[order], np.arange(len(moving)))]]
            moved = best != out[moving]
            out[moving], moving = best, moving[moved]
        return out

    def _rings(self, vertices: NDArray[np.int64]) -> tuple[NDArray[np.int32], NDArray[np.int64]]:
        """Corners of the triangles at each vertex, and the index of that vertex: int32 (k,), int64 (k,)."""
        start, end = self._start[vertices], self._start[vertices + 1]
        of = np.repeat(np.arange(len(vertices)), end - start)
        corners = np.arange(len(of)) + (start - np.r_[0, np.cumsum(end - start)[:-1]])[of]
        return self.mesh.triangles[self._corner[corners] // 3].ravel(), np.repeat(of, 3)

    def middles(self, vertices: NDArray[np.integer]) -> NDArray[np.float64]:
        """Centroid of each vertex and its neighbours.

        `vertices`: integers (n,). Returns float64 (n, 3).
        """
        return np.array([self.mesh.vertices[self.ring(v)].mean(axis=0) for v in vertices]).reshape(-1, 3)

    def ring(self, vertex: int) -> NDArray[np.int32]:
        """Neighbours of a vertex, the vertex included.

        Returns int32 (k,).
        """
        return distinct(self.mesh.triangles[self.around(np.array([vertex]))])

    def caps(self, vertex: int, tip: NDArray[np.float64]) -> list[Cap]:
        """Candidate caps of a tip.

        A cap is a disk of triangles near the vertex that face the tip. Each angle in `ANGLES` has three
        candidates: grown from nothing, from the triangles around the vertex, and from those around its
        neighbours too.

        `tip`: float64 (3,).
        """
        own = self.around(np.array([vertex]))
        seeds = own[:0], own, self.around(self.ring(vertex))
        disks = (self._disk(seed, vertex, tip, sine) for sine in ANGLES for seed in seeds)
        return list({cap.old.tobytes(): cap for cap in disks if cap}.values())

    def _disk(
        self, seed: NDArray[np.int64], vertex: int, tip: NDArray[np.float64], sine: float
    ) -> Cap | None:
        """Grow a disk from the seed by adjacent triangles that face the tip; None if it is too large or no
        disk.
        """
        seen, near = seed, self.around(np.array([vertex]))
        while len(seen) <= MOST:
            corners = self.mesh.vertices[self.mesh.triangles[near]]
            normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
            arms = tip - corners.mean(axis=1)
            sizes = np.linalg.norm(normals, axis=1) * np.linalg.norm(arms, axis=1)
            more = np.union1d(near[(normals * arms).sum(axis=1) > sine * sizes], seen)
            if len(more) == len(seen):
                rim = _rim(self.mesh.triangles[seen])
                return None if rim is None else Cap(seen, self._fan(rim, tip))
            seen, near = more, self.around(distinct(self.mesh.triangles[more]))
        return None

    def _fan(self, rim: NDArray[np.int32], tip: NDArray[np.float64]) -> NDArray[np.float64]:
        """Triangles from the edges of the rim to the tip."""
        ends = self.mesh.vertices[rim]
        return np.concatenate([ends, np.broadcast_to(tip, (len(rim), 1, 3))], axis=1)


def _rim(triangles: NDArray[np.int32]) -> NDArray[np.int32] | None:
    """Boundary edges of triangles, in order; None if the triangles do not form a disk."""
    sides = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2).reshape(-1, 2)
    known = set(map(tuple, sides.tolist()))
    following = {a: b for a, b in sides.tolist() if (b, a) not in known}
    first = here = next(iter(following), -1)
    rim = []
    while here in following:
        rim.append((here, following.pop(here)))
        here = rim[-1][1]
    edges = (3 * len(triangles) + len(rim)) // 2
    disk = here == first and not following and len(distinct(triangles)) - edges + len(triangles) == 1
    return np.array(rim, np.int32) if rim and disk else None


def best(caps: list[Cap], gain: float, mesh: Mesh, fit: Fit, voxel: float) -> Cap | None:
    """Choose the cap whose fan is closest to the surface.

    A fan qualifies if its greatest distance from the surface is at most that of the triangles it replaces, or
    at most `gain` and the fit's reach. None of its triangles may be thin or face away from the field's
    normal.
    """
    if not caps:
        return None
    old = fit.triangles(mesh.vertices[mesh.triangles[np.concatenate([cap.old for cap in caps])]])
    corners = np.concatenate([cap.fan for cap in caps])
    new = fit.triangles(corners)
    olds, rims = (np.cumsum([0, *map(len, sets)])[:-1] for sets in zip(*caps, strict=True))
    before, after = np.maximum.reduceat(old[:, OFF], olds), np.maximum.reduceat(new[:, OFF], rims)
    good = after <= np.maximum(before, min(gain, fit.reach))
    fine = (new[:, UPRIGHT] > 0) & (heights(corners) > THIN * voxel)
    good &= np.minimum.reduceat(fine, rims)
    return caps[int(np.where(good, after, np.inf).argmin())] if good.any() else None


def heights(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """Smallest height of triangles.

    `corners`: float64 (m, 3, 3). Returns float64 (m,).
    """
    sides = corners - np.roll(corners, 1, axis=1)
    area = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
    result: NDArray[np.float64] = area / np.linalg.norm(sides, axis=2).max(axis=1)
    return result


def disjoint(caps: list[Cap], count: int) -> list[Cap]:
    """Select caps without common triangles, in order of preference."""
    taken, kept = np.zeros(count, bool), []
    for cap in caps:
        if not taken[cap.old].any():
            taken[cap.old] = True
            kept.append(cap)
    return kept


def replace_by_fans(mesh: Mesh, caps: list[Cap]) -> Mesh:
    """Replace triangles by the fans of caps."""
    gone = np.concatenate([cap.old for cap in caps])
    keep = np.ones(len(mesh.triangles), bool)
    keep[gone] = False
    known = distinct(mesh.triangles[gone])
    corners = np.concatenate([mesh.vertices[known], *(cap.fan.reshape(-1, 3) for cap in caps)])
    _, first, which = np.unique(rows(corners), return_index=True, return_inverse=True)
    tips = np.sort(first[first >= len(known)])
    number = np.zeros(len(corners), np.int32)
    number[: len(known)], number[tips] = known, len(mesh.vertices) + np.arange(len(tips))
    fans = number[first[which[len(known) :]]].reshape(-1, 3)
    vertices = np.concatenate([mesh.vertices, corners[tips]])
    triangles = np.concatenate([mesh.triangles[keep], fans])
    return Mesh(vertices, triangles).compact()


def spans(caps: list[Cap], pieces: Pieces, near: float) -> Iterator[tuple[int, int]]:
    """Consecutive pieces that a fan, or the triangles it replaces, spans: these are joined."""
    x = np.array([(cap.fan[..., 0].min() - near, cap.fan[..., 0].max() + near) for cap in caps])
    old = np.array([(cap.old.min(), cap.old.max()) for cap in caps])
    own = np.searchsorted(pieces.ends, x), np.searchsorted(pieces.starts, old, side="right") - 1
    firsts, lasts = np.minimum(*own)[:, 0], np.maximum(*own)[:, 1]
    begin = 0
    for number in range(1, len(pieces) + 1):
        if not ((firsts < number) & (number <= lasts)).any():
            yield begin, number
            begin = number


def tips_last(meshes: Iterable[Mesh], tips: NDArray[np.float64]) -> Iterator[Mesh]:
    """Move the triangles at tips to the end, tip after tip, in the order of a mesh in one piece.

    `meshes` in mm; `tips`: float64 (k, 3), mm.
    """
    late = list[Late]()
    for mesh in meshes:
        plain, own = without_tips(mesh, tips)
        late.append(own)
        yield plain
    if sum(len(own.tips) for own in late):
        yield by_tip(late)


class Late(NamedTuple):
    """Triangles at tips."""

    tips: NDArray[np.int64]  # tip of each triangle
    corners: NDArray[np.float64]  # corners, mm, float64 [k, 3, 3]


def without_tips(mesh: Mesh, tips: NDArray[np.float64], threads: int = 0) -> tuple[Mesh, Late]:
    """Separate the triangles at tips from the others.

    `mesh` in mm; `tips`: float64 (k, 3), mm.
    """
    of = at_tips(mesh, tips)
    at = np.flatnonzero(of >= 0)
    late = Late(of[at], mesh.vertices[mesh.triangles[at]])
    return mesh.selected(of < 0, threads) if len(at) else mesh, late


def at_tips(mesh: Mesh, tips: NDArray[np.float64]) -> NDArray[np.int64]:
    """Find the triangles at tips.

    `mesh` in mm; `tips`: float64 (k, 3), mm. Returns int64 (m,).
    """
    if not len(tips):
        return np.full(len(mesh.triangles), -1)
    places = {tuple(tip): number for number, tip in enumerate(tips.astype(np.float32).tolist())}
    near = np.flatnonzero(np.isin(mesh.vertices[:, 0], [tip[0] for tip in places]))
    of_vertex = np.full(len(mesh.vertices), -1)
    of_vertex[near] = [places.get(tuple(point), -1) for point in mesh.vertices[near].tolist()]
    of_triangle: NDArray[np.int64] = of_vertex[mesh.triangles].max(axis=1, initial=-1)
    return of_triangle


def by_tip(late: Sequence[Late]) -> Mesh:
    """Mesh of the triangles at tips of all pieces, tip after tip."""
    order = np.argsort(np.concatenate([own.tips for own in late]), kind="stable")
    corners = np.concatenate([own.corners for own in late])[order]
    count = 3 * len(corners)
    return Mesh(corners.reshape(-1, 3), np.arange(count, dtype=np.int32).reshape(-1, 3))


def tips_to_end(mesh: Mesh, tips: NDArray[np.float64]) -> tuple[Mesh, NDArray[np.int64], int]:
    """Move the triangles at tips to the end of a piece, tip after tip.

    `mesh` in scene units; `tips`: float64 (k, 3), scene units. Returns int64 (m,).
    """
    _, known, here = np.intersect1d(rows(tips), rows(mesh.vertices), return_indices=True)
    of_vertex = np.full(len(mesh.vertices), -1)
    of_vertex[here] = known
    of = of_vertex[mesh.triangles].max(axis=1, initial=-1)
    order = np.argsort(of, kind="stable")
    return Mesh(mesh.vertices, mesh.triangles[order]), order, int(np.count_nonzero(of >= 0))


POINTED = 0.15
"""Minimum sine of the angle by which all edges descend from a pointed vertex."""

MANY = 512
"""Pointed vertices above which a surface is rough: it has any number of tips."""

NEAR_SEAM, AT_SEAM = 2.0, 5.0
"""Distances from a seam, voxels: vertices within the first are examined with the triangles of both pieces
within the second.
"""


class PointedPiece(NamedTuple):
    """Pointed vertices of a piece."""

    points: NDArray[np.float64]  # pointed vertices away from the seams; more than `MANY` on a rough surface
    head: Mesh  # triangles at its begin and at its end
    tail: Mesh


def pointed_in(mesh: Mesh, start: float, end: float, voxel: float, threads: int = 0) -> PointedPiece:
    """Find the pointed vertices of a piece."""
    points = _find_pointed(mesh, start + NEAR_SEAM * voxel, end - NEAR_SEAM * voxel, threads)
    head, tail = _at_seam(mesh, start, voxel, threads), _at_seam(mesh, end, voxel, threads)
    return PointedPiece(points, head, tail)


def _at_seam(mesh: Mesh, seam: float, voxel: float, threads: int) -> Mesh:
    """Triangles at a seam; none at an end of the surface."""
    near = np.zeros(len(mesh.vertices), bool)
    near[near_plane(mesh.vertices, seam, AT_SEAM * voxel)] = True
    if not near.any():
        return NOTHING
    return Mesh(mesh.vertices, mesh.triangles[touching(mesh.triangles, near, threads)]).compact()


def _find_pointed(mesh: Mesh, low: float, high: float, threads: int) -> NDArray[np.float64]:
    """Pointed vertices with low <= x < high; more than `MANY` on a rough surface."""
    at = mesh.vertices[pointed(mesh.vertices, mesh.triangles, POINTED, MANY, threads)]
    return at if len(at) > MANY else at[(low <= at[:, 0]) & (at[:, 0] < high)]


class Pointed:
    """Collects the pointed vertices of a surface in pieces."""

    def __init__(self, voxel: float, threads: int = 0) -> None:
        self._voxel, self._threads, self._points = voxel, threads, [np.empty((0, 3))]
        self._tail, self._seam = NOTHING, -np.inf

    def join(self, piece: PointedPiece, end: float) -> None:
        """Add the pointed vertices of a piece, or of consecutive ones, and those at its seam with the piece
        before.
        """
        if self.rough:
            return
        seam, voxel = self._seam, self._voxel
        if len(self._tail.triangles):
            both = join_at_seam(self._tail, piece.head, seam, voxel / 2)
            reach = NEAR_SEAM * voxel
            self._points.append(_find_pointed(both, seam - reach, seam + reach, self._threads))
        self._points.append(piece.points)
        self._tail, self._seam = piece.tail, end

    def before(self, head: Mesh) -> PointedPiece:
        """Pointed vertices of the pieces so far."""
        if self.rough:
            return PointedPiece(np.concatenate(self._points)[: MANY + 1], NOTHING, NOTHING)
        return PointedPiece(self.points, head, self._tail)

    @property
    def rough(self) -> bool:
        """True for a surface with more pointed vertices than tips are searched at."""
        return sum(map(len, self._points)) > MANY

    @property
    def points(self) -> NDArray[np.float64]:
        """Pointed vertices, float64 [n, 3]; none for a rough surface."""
        points = np.concatenate(self._points)
        return points[:0] if self.rough else points


MOST_TIPS = 64
"""Maximum number of tips that are added."""

ABOVE, STEP = 0.002, 0.25
"""Height of a start point above its triangle, and first step of the climb, voxels."""

ASIDE = np.array([(*way, -POINTED) for way in product((-1, 0, 1), repeat=2) if any(way)]).T
"""Sideways and downward steps from a tip. At a tip all of them leave the solid; along the rim of a disk, or a
ridge, some do not.
"""

ROUGHLY, EXACT = 0.03, 1e-7
"""Last step of the first climbs, voxels, and of the last climbs, relative to the size of the object."""

SAME = 0.05
"""Minimum distance of a tip from the mesh, voxels."""

REACH = 8.0
"""Radius around pointed vertices and tips within which triangles are examined, voxels."""


def with_tips(
    planned: Plan, pieces: Pieces, points: NDArray[np.float64], work: Work
) -> tuple[Pieces, NDArray[np.float64]]:
    """Replace blunt ends of a surface by the tips of the solid.

    If the solid continues above a triangle at a pointed vertex, its farthest point is located. The triangles
    that face this tip are replaced by a fan around it, if the fan is nowhere farther from the surface than
    they are. The surface stays closed and free of self-intersections. A rough surface, for example of a
    fractal, is not changed. The fans are the last triangles of their pieces; pieces that a fan spans are
    joined.

    `pieces` in scene units; `points`: float64 (n, 3). Returns float64 (k, 3), scene units.
    """
    caps = _caps(planned, pieces, points, work) if len(points) else []
    if not caps:
        return pieces, np.empty((0, 3))
    made, near = pieces.anew(), planned.voxel / 2
    for first, last in spans(caps, pieces, near):
        mesh, start = pieces.together(first, last, near), pieces.starts[first]
        own = [Cap(c.old - start, c.fan) for c in caps if 0 <= c.old[0] - start < len(mesh.triangles)]
        fresh = sum(len(cap.fan) for cap in own)
        made.add(Piece(replace_by_fans(mesh, own) if own else mesh, pieces.ends[last - 1]), fresh)
    return made, np.array([cap.fan[0, 2] for cap in caps])


def _caps(planned: Plan, pieces: Pieces, points: NDArray[np.float64], work: Work) -> list[Cap]:
    """Caps of all tips; triangle indices count from the first piece on."""
    root, voxel = planned.root, planned.voxel
    tips = _tips_beyond(planned, pieces, points, work)
    if not tips:
        return []
    ends, places = (np.array(rows) for rows in list(zip(*tips, strict=True))[1:])
    mesh, numbers = pieces.near(_between(ends, places, REACH * voxel), REACH * voxel)
    rings, fit = Rings(mesh), Fit(root, STEP * voxel, voxel, work)
    caps_of_tips = [
        best(rings.caps(vertex, tip.place), tip.gain, mesh, fit, voxel)
        for vertex, tip in zip(rings.at(ends), tips, strict=True)
    ]
    caps = disjoint([cap for cap in caps_of_tips if cap], len(mesh.triangles))
    while caps:
        work.check()
        wrong = _crossing(mesh, caps, work)
        if not wrong:
            break
        caps = [cap for number, cap in enumerate(caps) if number not in wrong]
    return [Cap(numbers[cap.old], cap.fan) for cap in caps]


def _crossing(mesh: Mesh, caps: list[Cap], work: Work) -> set[int]:
    """Caps whose fans intersect each other or the mesh after quantisation."""
    made = replace_by_fans(mesh, caps)
    of_cap = np.repeat(np.arange(len(caps)), [len(cap.fan) for cap in caps])
    of_cap = np.concatenate([np.full(len(made.triangles) - len(of_cap), -1), of_cap])
    as_written = quantise(made, used_vertices(made), threads=work.threads).mesh
    crossing = self_intersecting_triangles(as_written, threads=work.threads, among=of_cap >= 0)
    return set(of_cap[crossing].tolist()) - {-1}


class Tip(NamedTuple):
    """A tip beyond the mesh."""

    gain: float  # height of the tip above the nearest vertex
    end: NDArray[np.float64]  # nearest vertex
    place: NDArray[np.float64]  # position of the tip


def _tips_beyond(planned: Plan, pieces: Pieces, points: NDArray[np.float64], work: Work) -> list[Tip]:
    """Tips beyond pointed vertices, the highest one first."""
    kernel, voxel = planned.root.kernel("cpu", "float64"), planned.voxel
    exact = EXACT * max(planned.box.size)

    def inside(points: NDArray[np.float64]) -> NDArray[np.bool_]:
        inside: NDArray[np.bool_] = values_at(kernel, np.ascontiguousarray(points), work) < 0
        return inside

    def climbed(starts: NDArray[np.float64], ups: NDArray[np.float64], last: float) -> NDArray[np.float64]:
        steps = np.einsum("nij,jw->inw", _frames(_unit(ups)), SLANTS)
        return climb(kernel, starts.T[..., None], steps, STEP * voxel, last, work)[..., 0].T

    ends, starts, ups = _above(pieces, points, voxel)
    on = inside(starts.T)
    if not on.any():
        return []
    ends, tips = ends[on], climbed(starts[on], ups[on], ROUGHLY * voxel)
    for last in (ROUGHLY * voxel, exact, exact):
        ends, tips, ups = _nearest(pieces, ends, tips, voxel)
        tips = climbed(tips, ups, last)
    ends, tips, ups = _nearest(pieces, ends, tips, voxel)
    gain = ((tips - ends) * ups).sum(axis=1)
    aside = tips.T[..., None] + STEP * voxel * np.einsum("nij,jw->inw", _frames(ups), ASIDE)
    falls = ~inside(aside.reshape(3, -1)).reshape(aside.shape[1:]).any(axis=1)
    order = np.lexsort([*tips.T[::-1], -gain])
    order = order[((gain > SAME * voxel) & falls)[order]][:MOST_TIPS]
    return [Tip(float(gain[k]), ends[k], tips[k]) for k in order]


def _above(
    pieces: Pieces, points: NDArray[np.float64], voxel: float
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """A corner, a point just above the triangle and its unit normal, [n, 3] each, for each triangle at some
    vertices.
    """
    mesh, _ = pieces.near(points, REACH * voxel)
    rings = Rings(mesh)
    seats = mesh.corners[rings.around(rings.at(points))]
    ups = _unit(np.cross(seats[:, 1] - seats[:, 0], seats[:, 2] - seats[:, 0]))
    return seats[:, 0], seats.mean(axis=1) + ABOVE * voxel * ups, ups


def _nearest(
    pieces: Pieces, ends: NDArray[np.float64], tips: NDArray[np.float64], voxel: float
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Vertices near tips, reached from `ends` along edges, each once, with the highest of its tips and the
    upward direction.
    """
    mesh, _ = pieces.near(_between(ends, tips, REACH * voxel), REACH * voxel)
    rings = Rings(mesh)
    nearest = rings.nearest(rings.at(ends), tips)
    once, tips, ups = _highest(nearest, tips, tips - rings.middles(nearest))
    return mesh.vertices[once], tips, ups


def _between(starts: NDArray[np.float64], ends: NDArray[np.float64], step: float) -> NDArray[np.float64]:
    """Points on the segments between start and end points, at most a step apart."""
    count = 2 + int(np.linalg.norm(ends - starts, axis=1).max() / step)
    return np.linspace(starts, ends, count).reshape(-1, 3)


def _highest(
    ends: NDArray[np.int64], tips: NDArray[np.float64], ups: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
    """Distinct ends, the highest tip of each, and the upward direction there."""
    once, which = np.unique(ends, return_inverse=True)
    up = np.zeros((len(once), 3))
    np.add.at(up, which, ups)
    up = _unit(up)
    order = np.lexsort([-(tips * up[which]).sum(axis=1), which])
    first = order[np.searchsorted(which[order], np.arange(len(once)))]
    return once, tips[first], up


def _unit(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    """Normalised vectors."""
    unit: NDArray[np.float64] = vectors / np.maximum(np.linalg.norm(vectors, axis=1), 1e-300)[:, None]
    return unit


def _frames(ups: NDArray[np.float64]) -> NDArray[np.float64]:
    """Rotations from the z axis to unit vectors, [n, 3, 3]."""
    aside = np.eye(3)[np.abs(ups).argmin(axis=1)]
    first = _unit(np.cross(aside, ups))
    return np.stack([first, np.cross(ups, first), ups], axis=2)
