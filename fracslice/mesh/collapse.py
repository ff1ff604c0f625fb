# mypy: allow-untyped-defs, allow-untyped-calls, allow-untyped-decorators
"""Vertices taken out of a closed mesh as long as it stays near every point of the original.

Half-edge collapses under error control (Klein, Liebich and Strasser, "Mesh Reduction with Error Control",
1996): each original vertex, and the middle of each edge, is kept with a triangle near it, and a collapse that
would leave one of them farther off than the tolerance is not done. Neighbours are found in a corner table
(Rossignac, 2001): corner c = 3 t + k of triangle t has the opposite corner `across[c]`. Importing this module
imports Numba.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fracslice.mesh.links import corners_by_vertex
from fracslice.mesh.model import Mesh
from fracslice.mesh.nearest import square_distance

STAGES = (1e-3, 0.25, 0.5, 0.75, 1.0)
"""Shares of the tolerance, in the order in which they are spent: cheap collapses first."""

DEGREE = 48
"""Triangles around a vertex, at most."""

TURN = 0.2
"""The least cosine between a triangle's normals before and after a collapse."""

SHAPE = 0.05
"""How much of the error allowed is given for a well-shaped triangle."""


class Collapsed(NamedTuple):
    """triangles: int32 [k, 3], over the vertices of the original. owner: int32 [n], the triangle that each of
    these is near. fresh: bool [k], the triangles that are not the original's. changed: bool [m], the
    original's that are gone."""

    triangles: NDArray[np.int32]
    owner: NDArray[np.int32]
    fresh: NDArray[np.bool_]
    changed: NDArray[np.bool_]


def collapsed(mesh: Mesh, tolerance: NDArray[np.float64]) -> Collapsed:
    """As many vertices taken out as `tolerance` allows.

    mesh: closed, an oriented 2-manifold. tolerance: float64 [n], how far the surface may be moved to take
    each vertex out; 0 for one that stays. It stays a manifold of the same topology (the link condition of
    Dey, Edelsbrunner, Guha and Nekhayev, 1999). Every vertex and every middle of an edge is within the
    greatest tolerance; the rest is likely to be, and triangles may cross others.
    """
    count = len(mesh.vertices)
    triangles, corner = mesh.triangles.copy(), np.full(count, -1, np.int64)
    start, around = corners_by_vertex(triangles, count)
    across = _across(triangles, start, around, corner)
    edge = np.flatnonzero(np.arange(len(across)) < across)
    t, k = edge // 3, edge % 3
    middles = (mesh.vertices[triangles[t, (k + 1) % 3]] + mesh.vertices[triangles[t, (k + 2) % 3]]) / 2
    points, owner = (
        np.concatenate([mesh.vertices, middles]),
        np.concatenate([corner // 3, t]).astype(np.int32),
    )
    first, after = np.full(len(triangles), -1, np.int32), np.full(len(owner), -1, np.int32)
    _listed(owner, first, after)
    due, alive = np.zeros(count, np.bool_), np.ones(len(triangles), np.bool_)
    for share in STAGES:
        due[:] = corner >= 0
        while _sweep(points, triangles, across, corner, owner, first, after, due, alive, share * tolerance):
            pass
    number = np.cumsum(alive, dtype=np.int32) - np.int32(1)
    changed = ~alive | (triangles != mesh.triangles).any(axis=1)
    return Collapsed(triangles[alive], number[owner[:count]], changed[alive], changed)


@njit(cache=True, nogil=True)
def _across(triangles, start, corner_of, corner):
    """The opposite of each corner; `corner` gets one corner of each vertex."""
    across = np.full(3 * len(triangles), -1, np.int64)
    for v in range(len(start) - 1):
        for i in range(start[v], start[v + 1]):
            c = corner_of[i]
            corner[v] = c
            end = triangles[c // 3, (c % 3 + 1) % 3]  # the edge v -> end; its other triangle runs end -> v
            for j in range(start[v], start[v + 1]):
                d = corner_of[j]
                if triangles[d // 3, (d % 3 + 2) % 3] == end:
                    across[_before(c)] = _after(d)
                    across[_after(d)] = _before(c)
    return across


@njit(cache=True, nogil=True)
def _after(c):
    return c - 2 if c % 3 == 2 else c + 1


@njit(cache=True, nogil=True)
def _before(c):
    return c + 2 if c % 3 == 0 else c - 1


@njit(cache=True, nogil=True)
def _listed(owner, first, after):
    """A linked list of vertices for each triangle."""
    for p in range(len(owner)):
        if owner[p] >= 0:
            after[p] = first[owner[p]]
            first[owner[p]] = p


@njit(cache=True, nogil=True)
def _star(triangles, across, begin, star, ring):
    """The corners at a vertex, in order, and the vertex after each; how many, 0 if more than fit."""
    c, k = begin, 0
    while True:
        if k == DEGREE:
            return 0
        star[k], ring[k] = c, triangles[c // 3, (c % 3 + 1) % 3]
        k += 1
        c = _after(across[_after(c)])
        if c == begin:
            return k


@njit(cache=True, nogil=True)
def _sweep(vertices, triangles, across, corner, owner, first, after, due, alive, limits):
    """Takes out vertices that are due and have no neighbour changed in this sweep; how many."""
    star, ring = np.empty(DEGREE, np.int64), np.empty(DEGREE, np.int64)
    other, rim = np.empty(DEGREE, np.int64), np.empty(DEGREE, np.int64)
    busy = np.zeros(len(corner), np.bool_)
    done = 0
    for u in range(len(corner)):
        if not due[u] or busy[u] or corner[u] < 0:
            continue
        due[u], limit = False, limits[u]
        if limit == 0:
            continue
        k = _star(triangles, across, corner[u], star, ring)
        if k < 3:
            continue
        best, target = limit * (1 + SHAPE), -1
        for i in range(k):
            if busy[ring[i]] or not _linked(triangles, across, corner, star, ring, k, i, other, rim):
                continue
            shape = _shape(vertices, triangles, star, ring, k, i, limit)
            if shape < 0:
                continue
            penalty = SHAPE * limit * (1 - shape)
            error = _error(vertices, ring, k, i, star, first, after, min(limit, best - penalty))
            if error + penalty < best and _covered(vertices, triangles, star, ring, k, i, limit):
                best, target = error + penalty, i
        if target < 0:
            continue
        _collapse(vertices, triangles, across, corner, owner, first, after, alive, star, ring, k, target)
        corner[u] = -1
        done += 1
        for i in range(k):
            busy[ring[i]] = True
            due[ring[i]] = True
    return done


@njit(cache=True, nogil=True)
def _linked(triangles, across, corner, star, ring, k, i, other, rim):
    """Whether the edge to ring[i] may go: its ends have two common neighbours and no common triangle."""
    v = ring[i]
    degree = _star(triangles, across, corner[v], other, rim)
    if degree == 0 or degree + k - 4 > DEGREE:
        return False
    if k == 3:
        facing = across[star[(i + 1) % 3]]
        return triangles[facing // 3, facing % 3] != v
    for a in range(2, k - 1):
        for b in range(degree):
            if rim[b] == ring[(i + a) % k]:
                return False
    return True


@njit(cache=True, nogil=True)
def _cross(p, q, r):
    ux, uy, uz = q[0] - p[0], q[1] - p[1], q[2] - p[2]
    vx, vy, vz = r[0] - p[0], r[1] - p[1], r[2] - p[2]
    return uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx


@njit(cache=True, nogil=True)
def _square(p, q):
    return (p[0] - q[0]) ** 2 + (p[1] - q[1]) ** 2 + (p[2] - q[2]) ** 2


@njit(cache=True, nogil=True)
def _shape(vertices, triangles, star, ring, k, i, limit):
    """The worst of the new triangles, 1 for a regular one; -1 if one would turn over or be too thin."""
    u, v, worst = vertices[triangles[star[0] // 3, star[0] % 3]], vertices[ring[i]], 1.0
    for a in range(1, k - 1):
        p, q = vertices[ring[(i + a) % k]], vertices[ring[(i + a + 1) % k]]
        m, n = _cross(u, p, q), _cross(v, p, q)
        mm, nn = m[0] ** 2 + m[1] ** 2 + m[2] ** 2, n[0] ** 2 + n[1] ** 2 + n[2] ** 2
        dot = m[0] * n[0] + m[1] * n[1] + m[2] * n[2]
        sides = _square(v, p) + _square(p, q) + _square(q, v)
        if dot <= TURN * math.sqrt(mm * nn) or nn <= 1e-6 * limit * limit * sides:
            return -1.0
        worst = min(worst, 2 * math.sqrt(3.0) * math.sqrt(nn) / sides)
    return worst


@njit(cache=True, nogil=True)
def _error(vertices, ring, k, i, star, first, after, limit):
    """How far the star's points would be from the new triangles; infinite if beyond the limit."""
    if limit < 0:
        return np.inf
    v, most = vertices[ring[i]], 0.0
    for s in range(k):
        p = first[star[s] // 3]
        while p >= 0:
            least = np.inf
            for a in range(1, k - 1):
                b, c = vertices[ring[(i + a) % k]], vertices[ring[(i + a + 1) % k]]
                least = min(least, square_distance(vertices[p], v, b, c))
                if least <= most:
                    break
            if least > limit * limit:
                return np.inf
            most = max(most, least)
            p = after[p]
    return math.sqrt(most)


@njit(cache=True, nogil=True)
def _covered(vertices, triangles, star, ring, k, i, limit):
    """Whether the new edges are near the old triangles: no hole without points in it is bridged."""
    u, v = vertices[triangles[star[0] // 3, star[0] % 3]], vertices[ring[i]]
    for a in range(2, k - 1):
        middle, near = (v + vertices[ring[(i + a) % k]]) / 2, False
        for s in range(k):
            b, c = vertices[ring[s]], vertices[ring[(s + 1) % k]]
            if square_distance(middle, u, b, c) <= limit * limit:
                near = True
                break
        if not near:
            return False
    return True


@njit(cache=True, nogil=True)
def _collapse(vertices, triangles, across, corner, owner, first, after, alive, star, ring, k, i):
    """Moves the vertex of the star to ring[i]: two triangles go, the points of the star find new ones."""
    points = -1
    for s in range(k):
        t = star[s] // 3
        while first[t] >= 0:
            p = first[t]
            first[t], after[p] = after[p], points
            points = p
    v, gone, last = ring[i], star[i], star[(i - 1) % k]
    for s in range(k):
        triangles[star[s] // 3, star[s] % 3] = v
    corner[v] = star[(i + 1) % k]
    corner[ring[(i + 1) % k]] = _after(star[(i + 1) % k])
    corner[ring[(i - 1) % k]] = _before(star[(i - 2) % k])
    for c, inner, outer in ((gone, _after(gone), gone), (last, _before(last), last)):
        x, y = across[inner], across[outer]
        across[x], across[y] = y, x
        alive[c // 3] = False
    while points >= 0:
        p, least, nearest = points, np.inf, -1
        points = after[p]
        for a in range(1, k - 1):
            b, c = ring[(i + a) % k], ring[(i + a + 1) % k]
            d = square_distance(vertices[p], vertices[v], vertices[b], vertices[c])
            if d < least:
                least, nearest = d, star[(i + a) % k] // 3
        owner[p], after[p], first[nearest] = nearest, first[nearest], p
