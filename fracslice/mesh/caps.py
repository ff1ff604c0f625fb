"""Caps: the disks of triangles that a tip replaces, and the triangle fans that replace them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .._native import corners_by_vertex
from .fit import OFF, UPRIGHT, Fit
from .model import Mesh
from .pieces import Pieces, rows

ANGLES = 0.6, 0.3, 0.1
"""Minimum sines of the elevation of a tip above the planes of the triangles it replaces."""

THIN = 0.01
"""Minimum height of a new triangle, voxels: rounding cannot turn it over."""

MOST = 64
"""Maximum number of triangles that a tip replaces."""


class Cap(NamedTuple):
    """A disk of triangles and the fan that replaces it.

    Attributes
    ----------
    old : ndarray of int64, shape (k,)
        Indices of the replaced triangles.
    fan : ndarray of float64, shape (e, 3, 3)
        Corners of the new triangles; the tip is the last corner of each.
    """

    old: NDArray[np.int64]
    fan: NDArray[np.float64]


class Rings:
    """One-ring neighbourhoods of the vertices of a mesh.

    Parameters
    ----------
    mesh : Mesh
        The mesh.
    """

    def __init__(self, mesh: Mesh) -> None:
        self.mesh = mesh
        self._start, self._corner = corners_by_vertex(mesh.triangles, len(mesh.vertices))

    def at(self, points: NDArray[np.float64]) -> NDArray[np.int64]:
        """Look up vertices by position.

        Parameters
        ----------
        points : ndarray of float64, shape (n, 3)
            Positions of vertices; each position has exactly one vertex.

        Returns
        -------
        ndarray of int64, shape (n,)
            Vertex indices.
        """
        once, which = np.unique(rows(points), return_inverse=True)
        result = np.intersect1d(rows(self.mesh.vertices), once, return_indices=True)[1]
        return np.asarray(result[which])

    def around(self, vertices: NDArray[np.integer]) -> NDArray[np.int64]:
        """Triangles incident to any of some vertices.

        Parameters
        ----------
        vertices : ndarray of integers, shape (n,)
            Vertex indices.

        Returns
        -------
        ndarray of int64, shape (k,)
            Triangle indices, ascending.
        """
        corners = [self._corner[self._start[v] : self._start[v + 1]] for v in vertices]
        return np.unique(np.concatenate(corners) // 3)

    def nearest(self, vertices: NDArray[np.integer], points: NDArray[np.float64]) -> NDArray[np.int64]:
        """Vertices close to points, by greedy descent along edges.

        Parameters
        ----------
        vertices : ndarray of integers, shape (n,)
            Start vertices.
        points : ndarray of float64, shape (n, 3)
            Target points.

        Returns
        -------
        ndarray of int64, shape (n,)
            For each point the vertex at which no neighbour is nearer to it.
        """
        out = np.empty(len(points), np.int64)
        for k, (best, point) in enumerate(zip(vertices, points, strict=True)):
            last = -1
            while best != last:
                last, ring = best, self.ring(best)
                best = ring[np.linalg.norm(self.mesh.vertices[ring] - point, axis=1).argmin()]
            out[k] = best
        return out

    def middles(self, vertices: NDArray[np.integer]) -> NDArray[np.float64]:
        """Centroid of each vertex and its neighbours.

        Parameters
        ----------
        vertices : ndarray of integers, shape (n,)
            Vertex indices.

        Returns
        -------
        ndarray of float64, shape (n, 3)
            Centroids.
        """
        return np.array([self.mesh.vertices[self.ring(v)].mean(axis=0) for v in vertices]).reshape(-1, 3)

    def ring(self, vertex: int) -> NDArray[np.int32]:
        """Neighbours of a vertex, the vertex included.

        Parameters
        ----------
        vertex : int
            Vertex index.

        Returns
        -------
        ndarray of int32, shape (k,)
            Vertex indices, ascending.
        """
        return np.unique(self.mesh.triangles[self.around(np.array([vertex]))])

    def caps(self, vertex: int, tip: NDArray[np.float64]) -> list[Cap]:
        """Candidate caps of a tip.

        A cap is a disk of triangles near the vertex that face the tip. Each angle in `ANGLES` has three
        candidates: grown from nothing, from the triangles around the vertex, and from those around its
        neighbours too.

        Parameters
        ----------
        vertex : int
            Vertex near the tip.
        tip : ndarray of float64, shape (3,)
            Position of the tip.

        Returns
        -------
        list of Cap
            Distinct candidates.
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
            seen, near = more, self.around(np.unique(self.mesh.triangles[more]))
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
    disk = here == first and not following and len(np.unique(triangles)) - edges + len(triangles) == 1
    return np.array(rim, np.int32) if rim and disk else None


def best(caps: list[Cap], gain: float, mesh: Mesh, fit: Fit, voxel: float) -> Cap | None:
    """Choose the cap whose fan is closest to the surface.

    A fan qualifies if its greatest distance from the surface is at most that of the triangles it replaces, or
    at most `gain` and the fit's reach. None of its triangles may be thin or face away from the field's
    normal.

    Parameters
    ----------
    caps : list of Cap
        Candidates.
    gain : float
        Height of the tip above the nearest vertex.
    mesh : Mesh
        The mesh.
    fit : Fit
        Distances to the surface.
    voxel : float
        Voxel, in the units of the mesh.

    Returns
    -------
    Cap or None
        The best cap; None if none qualifies.
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

    Parameters
    ----------
    corners : ndarray of float64, shape (m, 3, 3)
        Corners.

    Returns
    -------
    ndarray of float64, shape (m,)
    """
    sides = corners - np.roll(corners, 1, axis=1)
    area = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
    result: NDArray[np.float64] = area / np.linalg.norm(sides, axis=2).max(axis=1)
    return result


def disjoint(caps: list[Cap], count: int) -> list[Cap]:
    """Select caps without common triangles, in order of preference.

    Parameters
    ----------
    caps : list of Cap
        Caps, the preferred ones first.
    count : int
        Triangles of the mesh.
    """
    taken, kept = np.zeros(count, bool), []
    for cap in caps:
        if not taken[cap.old].any():
            taken[cap.old] = True
            kept.append(cap)
    return kept


def capped(mesh: Mesh, caps: list[Cap]) -> Mesh:
    """Replace triangles by the fans of caps.

    Parameters
    ----------
    mesh : Mesh
        The mesh.
    caps : list of Cap
        Disjoint caps.

    Returns
    -------
    Mesh
        The remaining triangles in order, then the fans in order.
    """
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
    return Mesh(vertices, triangles).compact()


def spans(caps: list[Cap], pieces: Pieces, near: float) -> Iterator[tuple[int, int]]:
    """Consecutive pieces that a fan, or the triangles it replaces, spans: these are joined.

    Parameters
    ----------
    caps : list of Cap
        Caps; triangle indices count from the first piece on.
    pieces : Pieces
        The pieces.
    near : float
        Distance from a seam at which a fan counts as on both sides.

    Yields
    ------
    tuple of int
        First and last piece, last excluded; all pieces, in order.
    """
    x = np.array([(cap.fan[..., 0].min() - near, cap.fan[..., 0].max() + near) for cap in caps])
    old = np.array([(cap.old.min(), cap.old.max()) for cap in caps])
    own = np.searchsorted(pieces.ends, x), np.searchsorted(pieces.starts, old, side="right") - 1
    firsts, lasts = np.minimum(*own)[:, 0], np.maximum(*own)[:, 1]
    begin = 0
    for number in range(1, len(pieces) + 1):
        if not ((firsts < number) & (number <= lasts)).any():
            yield begin, number
            begin = number
