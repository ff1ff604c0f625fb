"""The triangles that a tip replaces: disks of a mesh, and the fans in their place."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .fit import OFF, UPRIGHT, Fit
from .model import Mesh
from .pieces import rows
from .topology import corners_by_vertex

ANGLES = 0.6, 0.3, 0.1
"""Sines of angles at which a tip is above the planes of triangles that it replaces, at least."""

THIN = 0.01
"""Voxels: the height of new triangles, at least: rounding turns none over."""

MOST = 64
"""Triangles that a tip replaces."""


class Cap(NamedTuple):
    """Triangles, by number, int64 [k], and the corners of the fan in their place, float64 [e, 3, 3]: the tip
    is the last one of each."""

    old: NDArray[np.int64]
    fan: NDArray[np.float64]


class Rings:
    """A mesh, and the triangles around its vertices."""

    def __init__(self, mesh: Mesh) -> None:
        self.mesh = mesh
        self._start, self._corner = corners_by_vertex(mesh.triangles, len(mesh.vertices))

    def at(self, points: NDArray[np.float64]) -> NDArray[np.int64]:
        """The vertices at points, [n, 3], where there is one each."""
        once, which = np.unique(rows(points), return_inverse=True)
        found = np.intersect1d(rows(self.mesh.vertices), once, return_indices=True)[1]
        return np.asarray(found[which])

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
                return None if rim is None else Cap(seen, self._fan(rim, tip))
            seen, near = more, self.around(np.unique(self.mesh.triangles[more]))
        return None

    def _fan(self, rim: NDArray[np.int32], tip: NDArray[np.float64]) -> NDArray[np.float64]:
        ends = self.mesh.vertices[rim]
        return np.concatenate([ends, np.broadcast_to(tip, (len(rim), 1, 3))], axis=1)


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


def best(caps: list[Cap], gain: float, mesh: Mesh, fit: Fit, voxel: float) -> Cap | None:
    """The one that is nearest to the surface, if it is nowhere farther than what it replaces, or than the tip
    was; and nowhere thin or turned away."""
    if not caps:
        return None
    old = fit.triangles(mesh.vertices[mesh.triangles[np.concatenate([cap.old for cap in caps])]])
    corners = np.concatenate([cap.fan for cap in caps])
    new = fit.triangles(corners)
    olds, rims = (np.cumsum([0, *map(len, sets)])[:-1] for sets in zip(*caps, strict=True))
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


def apart(caps: list[Cap], count: int) -> list[Cap]:
    """Those of which no two have a triangle in common, the first ones first."""
    taken, kept = np.zeros(count, bool), []
    for cap in caps:
        if not taken[cap.old].any():
            taken[cap.old] = True
            kept.append(cap)
    return kept


def capped(mesh: Mesh, caps: list[Cap]) -> Mesh:
    """The mesh with caps: the other triangles first, then the fans in turn."""
    gone = np.concatenate([cap.old for cap in caps])
    keep = np.ones(len(mesh.triangles), bool)
    keep[gone] = False
    known = np.unique(mesh.triangles[gone])
    corners = np.concatenate([mesh.vertices[known], *(cap.fan.reshape(-1, 3) for cap in caps)])
    _, first, which = np.unique(rows(corners), return_index=True, return_inverse=True)
    tips = np.sort(first[first >= len(known)])
    number = np.zeros(len(corners), np.int32)
    number[: len(known)], number[tips] = known, len(mesh.vertices) + np.arange(len(tips))
    fans = number[first[which[len(known) :]]].reshape(-1, 3)
    vertices = np.concatenate([mesh.vertices, corners[tips]])
    triangles = np.concatenate([mesh.triangles[keep], fans])
    return Mesh(vertices, triangles).selected(np.ones(len(triangles), bool))
