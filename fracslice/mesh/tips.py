"""The tips that lie beyond the last samples: a mesh of samples is blunt there."""

from __future__ import annotations

from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._native import pointed
from ..kernel import Field
from ..volume.climbing import SLANTS, climb
from ..volume.values import values_at
from ..work import Work
from .fit import OFF, UPRIGHT, Fit
from .model import Mesh
from .quantisation import quantise
from .self_intersections import self_intersecting_triangles
from .topology import corners_by_vertex

POINTED = 0.15
"""The sine of the angle by which all edges at a pointed vertex fall off, at least."""

MANY, MOST_TIPS = 512, 64
"""Pointed vertices at most: else the surface is rough, and has no end of tips. Tips that are looked at."""

ABOVE, STEP = 0.002, 0.25
"""Voxels above a triangle where the solid goes on; the first steps from there outwards."""

ASIDE = np.array([(*way, -POINTED) for way in product((-1, 0, 1), repeat=2) if any(way)]).T
"""From a tip: no way there stays in the solid. Along the rim of a disk, or a ridge, some do."""

ROUGHLY, EXACT = 0.03, 1e-7
"""Voxels: the last step of the first ways outwards; of the mesh's size: that of the last ones."""

SAME = 0.05
"""Voxels: a mesh that ends so near a tip reaches it."""

ANGLES = 0.6, 0.3, 0.1
"""Sines of angles at which a tip is above the planes of triangles that it replaces, at least."""

THIN = 0.01
"""Voxels: the height of new triangles, at least: rounding turns none over."""

MOST = 64
"""Triangles that a tip replaces."""


class Cap(NamedTuple):
    """Triangles, by number, int64 [k], whose place others take: from the edges around them, int32 [e, 2], to
    a tip, float64 [3]."""

    old: NDArray[np.int64]
    rim: NDArray[np.int32]
    tip: NDArray[np.float64]

    def corners(self, mesh: Mesh) -> NDArray[np.float64]:
        """Of the new triangles, [e, 3, 3]."""
        rim = mesh.vertices[self.rim]
        return np.concatenate([rim, np.broadcast_to(self.tip, (len(rim), 1, 3))], axis=1)


def with_tips(
    root: Field, mesh: Mesh, voxel: float, work: Work | None = None
) -> tuple[Mesh, NDArray[np.bool_]]:
    """The mesh with the solid's own tips in place of blunt ends, and which triangles are new, bool [m].

    mesh: closed, an oriented 2-manifold, scene units, its vertices on the zero set of root's field, a voxel
    apart. Where the solid goes on above a triangle at a pointed vertex, its farthest point is looked for, and
    what that sees from above is replaced by a fan around it, if the fan is nowhere farther from the surface
    than what it replaces. The surface stays closed, and does not cross itself. A rough surface, as of a
    fractal, stays as it is. Raises `Cancelled`.
    """
    work = work or Work()
    at = pointed(mesh.vertices, mesh.triangles, POINTED, work.threads)
    if not 0 < len(at) <= MANY:
        return mesh, np.zeros(len(mesh.triangles), bool)
    rings, fit = Rings(mesh), Fit(root, STEP * voxel, voxel, work)
    found = [
        _best(rings.caps(end, tip), gain, mesh, fit, voxel)
        for gain, end, tip in _found(root, rings, at, voxel, work)
    ]
    caps = _apart([cap for cap in found if cap], len(mesh.triangles))
    while caps:
        work.check()
        made, of_cap = _capped(mesh, caps)
        as_written = Mesh(quantise(made, threads=work.threads)[0], made.triangles)
        wrong = of_cap[self_intersecting_triangles(as_written, threads=work.threads, among=of_cap >= 0)]
        if not (wrong >= 0).any():
            return made, of_cap >= 0
        caps = [cap for number, cap in enumerate(caps) if number not in wrong]
    return mesh, np.zeros(len(mesh.triangles), bool)


def _found(
    root: Field, rings: Rings, at: NDArray[np.int64], voxel: float, work: Work
) -> list[tuple[float, int, NDArray[np.float64]]]:
    """Tips that the mesh does not reach: how far it is from them, the nearest vertex, and where they are; the
    farthest one first."""
    kernel, mesh = root.kernel("cpu", "float64"), rings.mesh
    exact = EXACT * float(mesh.size.max())

    def inside(points: NDArray[np.float64]) -> NDArray[np.bool_]:
        found: NDArray[np.bool_] = values_at(kernel, np.ascontiguousarray(points), work) < 0
        return found

    def climbed(starts: NDArray[np.float64], ups: NDArray[np.float64], last: float) -> NDArray[np.float64]:
        ways = np.einsum("nij,jw->inw", _frames(_unit(ups)), SLANTS)
        return climb(inside, starts.T[..., None], ways, STEP * voxel, last)[..., 0].T

    seats = rings.around(at)
    corners = mesh.vertices[mesh.triangles[seats]]
    ups = _unit(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))
    starts = corners.mean(axis=1) + ABOVE * voxel * ups
    on = inside(starts.T)
    tips = climbed(starts[on], ups[on], ROUGHLY * voxel)
    ends = mesh.triangles[seats[on], 0].astype(np.int64)
    for last in (ROUGHLY * voxel, exact, exact):
        ends = rings.nearest(ends, tips)
        ends, tips, ups = _highest(ends, tips, tips - rings.middles(ends))
        tips = climbed(tips, ups, last)
    ends = rings.nearest(ends, tips)
    ends, tips, ups = _highest(ends, tips, tips - rings.middles(ends))
    gain = ((tips - mesh.vertices[ends]) * ups).sum(axis=1)
    aside = tips.T[..., None] + STEP * voxel * np.einsum("nij,jw->inw", _frames(ups), ASIDE)
    falls = ~inside(aside.reshape(3, -1)).reshape(aside.shape[1:]).any(axis=1)
    order = np.argsort(-gain, kind="stable")
    order = order[((gain > SAME * voxel) & falls)[order]][:MOST_TIPS]
    return [(float(gain[k]), int(ends[k]), tips[k]) for k in order]


def _highest(
    ends: NDArray[np.int64], tips: NDArray[np.float64], ups: NDArray[np.float64]
) -> tuple[NDArray[np.int64], NDArray[np.float64], NDArray[np.float64]]:
    """Each end once, with the highest of its tips, and what is upwards there."""
    once, which = np.unique(ends, return_inverse=True)
    up = np.zeros((len(once), 3))
    np.add.at(up, which, ups)
    up = _unit(up)
    order = np.lexsort([-(tips * up[which]).sum(axis=1), which])
    first = order[np.searchsorted(which[order], np.arange(len(once)))]
    return once, tips[first], up


def _unit(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    found: NDArray[np.float64] = vectors / np.maximum(np.linalg.norm(vectors, axis=1), 1e-300)[:, None]
    return found


def _frames(ups: NDArray[np.float64]) -> NDArray[np.float64]:
    """Rotations that turn z to unit vectors, [n, 3, 3]."""
    aside = np.eye(3)[np.abs(ups).argmin(axis=1)]
    first = _unit(np.cross(aside, ups))
    return np.stack([first, np.cross(ups, first), ups], axis=2)


class Rings:
    """A mesh, and the triangles around its vertices."""

    def __init__(self, mesh: Mesh) -> None:
        self.mesh = mesh
        self._start, self._corner = corners_by_vertex(mesh.triangles, len(mesh.vertices))

    def around(self, vertices: NDArray[np.integer]) -> NDArray[np.int64]:
        """The triangles at some vertices, ascending."""
        corners = [self._corner[self._start[v] : self._start[v + 1]] for v in vertices]
        return np.unique(np.concatenate(corners) // 3)

    def nearest(self, vertices: NDArray[np.integer], points: NDArray[np.float64]) -> NDArray[np.int64]:
        """The vertices near points that ways over nearer and nearer ones lead to."""
        found = np.empty(len(points), np.int64)
        for k, (best, point) in enumerate(zip(vertices, points, strict=True)):
            last = -1
            while best != last:
                last, ring = best, self.ring(best)
                best = ring[np.linalg.norm(self.mesh.vertices[ring] - point, axis=1).argmin()]
            found[k] = best
        return found

    def middles(self, vertices: NDArray[np.integer]) -> NDArray[np.float64]:
        """Of the vertices around each, and itself."""
        return np.array([self.mesh.vertices[self.ring(v)].mean(axis=0) for v in vertices]).reshape(-1, 3)

    def ring(self, vertex: int) -> NDArray[np.int32]:
        """The vertices around one, and itself."""
        return np.unique(self.mesh.triangles[self.around(np.array([vertex]))])

    def caps(self, vertex: int, tip: NDArray[np.float64]) -> list[Cap]:
        """Disks of triangles near a vertex that a tip sees from above, at several angles; with all of those
        around the vertex, with those around its neighbours too, and without."""
        own = self.around(np.array([vertex]))
        seeds = own[:0], own, self.around(self.ring(vertex))
        disks = (self._disk(seed, vertex, tip, sine) for sine in ANGLES for seed in seeds)
        return list({cap.old.tobytes(): cap for cap in disks if cap}.values())

    def _disk(
        self, seed: NDArray[np.int64], vertex: int, tip: NDArray[np.float64], sine: float
    ) -> Cap | None:
        seen, near = seed, self.around(np.array([vertex]))
        while len(seen) <= MOST:
            corners = self.mesh.vertices[self.mesh.triangles[near]]
            normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
            ways = tip - corners.mean(axis=1)
            sizes = np.linalg.norm(normals, axis=1) * np.linalg.norm(ways, axis=1)
            more = np.union1d(near[(normals * ways).sum(axis=1) > sine * sizes], seen)
            if len(more) == len(seen):
                rim = _rim(self.mesh.triangles[seen])
                return None if rim is None else Cap(seen, rim, tip)
            seen, near = more, self.around(np.unique(self.mesh.triangles[more]))
        return None


def _rim(triangles: NDArray[np.int32]) -> NDArray[np.int32] | None:
    """The edges around triangles, in turn; None if these are no disk."""
    sides = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2).reshape(-1, 2)
    known = set(map(tuple, sides.tolist()))
    following = {a: b for a, b in sides.tolist() if (b, a) not in known}
    first = here = next(iter(following), -1)
    rim = []
    while here in following:
        rim.append((here, following.pop(here)))
        here = rim[-1][1]
    edges = (3 * len(triangles) + len(rim)) // 2
    disk = here == first and not following and len(np.unique(triangles)) - edges + len(triangles) == 1
    return np.array(rim, np.int32) if rim and disk else None


def _best(caps: list[Cap], gain: float, mesh: Mesh, fit: Fit, voxel: float) -> Cap | None:
    """The one that is nearest to the surface, if it is nowhere farther than what it replaces, or than the tip
    was; and nowhere thin or turned away."""
    if not caps:
        return None
    old = fit.triangles(mesh.vertices[mesh.triangles[np.concatenate([cap.old for cap in caps])]])
    corners = np.concatenate([cap.corners(mesh) for cap in caps])
    new = fit.triangles(corners)
    olds, rims = (
        np.cumsum([0, *map(len, sets)])[:-1] for sets in zip(*(cap[:2] for cap in caps), strict=True)
    )
    before, after = np.maximum.reduceat(old[:, OFF], olds), np.maximum.reduceat(new[:, OFF], rims)
    good = after <= np.maximum(before, min(gain, fit.reach))
    fine = (new[:, UPRIGHT] > 0) & (_heights(corners) > THIN * voxel)
    good &= np.minimum.reduceat(fine, rims)
    return caps[int(np.where(good, after, np.inf).argmin())] if good.any() else None


def _heights(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """The least height of triangles, [m]."""
    sides = corners - np.roll(corners, 1, axis=1)
    area = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
    found: NDArray[np.float64] = area / np.linalg.norm(sides, axis=2).max(axis=1)
    return found


def _apart(caps: list[Cap], count: int) -> list[Cap]:
    """Those of which no two have a triangle in common, the first ones first."""
    taken, kept = np.zeros(count, bool), []
    for cap in caps:
        if not taken[cap.old].any():
            taken[cap.old] = True
            kept.append(cap)
    return kept


def _capped(mesh: Mesh, caps: list[Cap]) -> tuple[Mesh, NDArray[np.int64]]:
    """The mesh with caps, and of each triangle the number of its cap, -1 for the others."""
    keep = np.ones(len(mesh.triangles), bool)
    keep[np.concatenate([cap.old for cap in caps])] = False
    tips = len(mesh.vertices) + np.arange(len(caps), dtype=np.int32)
    of_cap = np.repeat(np.arange(len(caps)), [len(cap.rim) for cap in caps])
    fans = np.column_stack([np.concatenate([cap.rim for cap in caps]), tips[of_cap]])
    vertices = np.concatenate([mesh.vertices, [cap.tip for cap in caps]])
    triangles = np.concatenate([mesh.triangles[keep], fans])
    made = Mesh(vertices, triangles).selected(np.ones(len(triangles), bool))
    return made, np.concatenate([np.full(keep.sum(), -1), of_cap])
