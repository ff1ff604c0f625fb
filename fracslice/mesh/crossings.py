# mypy: allow-untyped-defs, allow-untyped-calls, allow-untyped-decorators
"""Which triangles of a mesh cut, touch or cover others: exact, coplanar overlaps included.

Pairs come from a tree of boxes, each pair is decided by the signs of exact predicates alone (the idea of
Guigue and Devillers, "Fast and Robust Triangle-Triangle Overlap Test Using Orientation Predicates", 2003).
Neighbours may share what their shared vertices span and nothing else. Importing this module imports Numba.
"""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fracslice.mesh.model import Mesh
from fracslice.mesh.predicates import side_of_line, side_of_plane
from fracslice.mesh.tree import LEAF, Tree, build

ASIDE, FLAT, ASTRIDE = 0, 1, 2


def crossing_triangles(mesh: Mesh, tree: Tree | None = None, threads: int | None = None) -> NDArray[np.bool_]:
    """Which triangles meet another one in more than the vertices both have by index, bool [m].

    Triangles without area are passed over. Vertices must be finite, with equal positions welded to one index.
    """
    marks = np.zeros(len(mesh.triangles), dtype=np.bool_)
    if not len(marks):
        return marks
    tree = tree or build(mesh)
    drop = _dropped_axes(mesh.vertices, mesh.triangles)
    runs = -(-len(marks) // LEAF)
    steps = range(0, runs, 4096)
    with ThreadPoolExecutor(threads or os.cpu_count()) as pool:
        jobs = [
            pool.submit(
                _mark, mesh.vertices, mesh.triangles, drop, *tree, begin, min(begin + 4096, runs), marks
            )
            for begin in steps
        ]
        for job in jobs:
            job.result()
    return marks


@njit(cache=True, nogil=True)
def _dropped_axes(vertices, triangles):
    """The axis along which each triangle is seen broadest; -1 for a triangle without area."""
    axes = np.empty(len(triangles), np.int8)
    for t in range(len(triangles)):
        a, b, c = vertices[triangles[t, 0]], vertices[triangles[t, 1]], vertices[triangles[t, 2]]
        axes[t], best = -1, 0.0
        for k in range(3):
            i, j = (k + 1) % 3, (k + 2) % 3
            broad = abs((b[i] - a[i]) * (c[j] - a[j]) - (b[j] - a[j]) * (c[i] - a[i]))
            if broad > best:
                axes[t], best = k, broad
    return axes


@njit(cache=True, nogil=True)
def _mark(vertices, triangles, drop, order, low, high, begin, end, marks):
    """Mark the crossing triangles among all pairs whose first is in the runs begin..end-1."""
    leaves = len(low) // 2
    stack = np.empty(128, np.int64)
    low_box, high_box = np.empty((LEAF + 1, 3)), np.empty((LEAF + 1, 3))
    for run in range(begin, end):
        node = leaves + run
        first, last = run * LEAF, min(len(order), run * LEAF + LEAF)
        for i in range(first, last):
            _set_box(vertices, triangles, order[i], low_box, high_box, i - first)
        stack[0], height = 1, 1
        while height > 0:
            height -= 1
            other = stack[height]
            if not _boxes_meet(low, high, node, other):
                continue
            if other < leaves:
                stack[height], stack[height + 1] = 2 * other, 2 * other + 1
                height += 2
            elif other >= node:
                _mark_runs(
                    vertices,
                    triangles,
                    drop,
                    order,
                    low_box,
                    high_box,
                    first,
                    last,
                    (other - leaves) * LEAF,
                    marks,
                )


@njit(cache=True, nogil=True)
def _set_box(vertices, triangles, t, low, high, row):
    a, b, c = triangles[t, 0], triangles[t, 1], triangles[t, 2]
    for k in range(3):
        low[row, k] = min(vertices[a, k], min(vertices[b, k], vertices[c, k]))
        high[row, k] = max(vertices[a, k], max(vertices[b, k], vertices[c, k]))


@njit(cache=True, nogil=True)
def _boxes_meet(low, high, a, b):
    apart = False
    for k in range(3):
        apart |= low[a, k] > high[b, k] or high[a, k] < low[b, k]
    return not apart


@njit(cache=True, nogil=True)
def _mark_runs(vertices, triangles, drop, order, low, high, first, last, begin, marks):
    """Mark the crossing pairs of the run first..last-1, of known boxes, with the run at `begin`."""
    for j in range(begin, min(len(order), begin + LEAF)):
        t = order[j]
        if drop[t] < 0:
            continue
        _set_box(vertices, triangles, t, low, high, LEAF)
        for i in range(first, min(last, j)):
            s = order[i]
            if drop[s] < 0 or (marks[s] and marks[t]) or not _boxes_meet(low, high, i - first, LEAF):
                continue
            if _cross(vertices, triangles, s, t, drop[s], drop[t]):
                marks[s] = True
                marks[t] = True


@njit(cache=True, nogil=True)
def _point(vertices, i):
    return vertices[i, 0], vertices[i, 1], vertices[i, 2]


@njit(cache=True, nogil=True)
def _turned(vertices, triangles, t, first):
    """The corners of triangle t, beginning with corner `first`."""
    return (
        _point(vertices, triangles[t, first]),
        _point(vertices, triangles[t, (first + 1) % 3]),
        _point(vertices, triangles[t, (first + 2) % 3]),
    )


@njit(cache=True, nogil=True)
def _cross(vertices, triangles, s, t, drop_s, drop_t):
    """Whether triangles s and t meet in more than their shared vertices span."""
    shared, i, j = 0, 0, 0
    sum_i, sum_j = 0, 0
    for p in range(3):
        for q in range(3):
            if triangles[s, p] == triangles[t, q]:
                shared, i, j = shared + 1, p, q
                sum_i, sum_j = sum_i + p, sum_j + q
    if shared == 3:
        return True
    if shared == 2:
        p, a, b = _turned(vertices, triangles, s, 3 - sum_i)
        q, _, _ = _turned(vertices, triangles, t, 3 - sum_j)
        return _folded(a, b, p, q, drop_s)
    a, b, c = _turned(vertices, triangles, s, i)
    d, e, f = _turned(vertices, triangles, t, j)
    if shared == 1:
        beyond = _two_sides(a, b, c, e, f)
        if beyond == ASIDE or (beyond == FLAT and _apart_at_corner(a, b, c, e, f, drop_s)):
            return False
        if beyond == ASTRIDE and _two_sides(d, e, f, b, c) == ASIDE:
            return False
        # what they share beyond the vertex ends on one of the edges opposite to it
        return _edge_meets(b, c, d, e, f, drop_t) or _edge_meets(e, f, a, b, c, drop_s)
    beyond = _sides(a, b, c, d, e, f)
    if beyond == FLAT:
        return not (_apart(a, b, c, d, e, f, drop_s) or _apart(d, e, f, a, b, c, drop_t))
    if beyond == ASIDE or _sides(d, e, f, a, b, c) == ASIDE:
        return False
    return (
        _edge_meets(a, b, d, e, f, drop_t)
        or _edge_meets(b, c, d, e, f, drop_t)
        or _edge_meets(c, a, d, e, f, drop_t)
        or _edge_meets(d, e, a, b, c, drop_s)
        or _edge_meets(e, f, a, b, c, drop_s)
        or _edge_meets(f, d, a, b, c, drop_s)
    )


@njit(cache=True, nogil=True)
def _sides(a, b, c, d, e, f):
    """How d, e and f lie to the plane of a b c: all on one side, all in it, or otherwise."""
    side = side_of_plane(a, b, c, d)
    if side != side_of_plane(a, b, c, e) or side != side_of_plane(a, b, c, f):
        return ASTRIDE
    return FLAT if side == 0 else ASIDE


@njit(cache=True, nogil=True)
def _two_sides(a, b, c, d, e):
    """The same for d and e."""
    side = side_of_plane(a, b, c, d)
    if side != side_of_plane(a, b, c, e):
        return ASTRIDE
    return FLAT if side == 0 else ASIDE


@njit(cache=True, nogil=True)
def _apart(a, b, c, d, e, f, drop):
    """Whether an edge of a b c has the triangle d e f, of the same plane, strictly on its outer side."""
    outside = -_turn(a, b, c, drop)
    for p, q in ((a, b), (b, c), (c, a)):
        if (
            _turn(p, q, d, drop) == outside
            and _turn(p, q, e, drop) == outside
            and _turn(p, q, f, drop) == outside
        ):
            return True
    return False


@njit(cache=True, nogil=True)
def _apart_at_corner(a, b, c, e, f, drop):
    """Whether an edge at a separates the triangles a b c and a e f of one plane; sure if true."""
    outside, other = -_turn(a, b, c, drop), -_turn(a, e, f, drop)
    return (
        (_turn(a, b, e, drop) == outside and _turn(a, b, f, drop) == outside)
        or (_turn(c, a, e, drop) == outside and _turn(c, a, f, drop) == outside)
        or (_turn(a, e, b, drop) == other and _turn(a, e, c, drop) == other)
        or (_turn(f, a, b, drop) == other and _turn(f, a, c, drop) == other)
    )


@njit(cache=True, nogil=True)
def _folded(a, b, p, q, drop):
    """Whether the triangles a b p and a b q lie flat on each other."""
    return side_of_plane(a, b, p, q) == 0 and _turn(a, b, p, drop) == _turn(a, b, q, drop)


@njit(cache=True, nogil=True)
def _turn(a, b, c, drop):
    """side_of_line, seen along the axis `drop`."""
    i, j = (drop + 1) % 3, (drop + 2) % 3
    return side_of_line(a[i], a[j], b[i], b[j], c[i], c[j])


@njit(cache=True, nogil=True)
def _edge_meets(p, q, a, b, c, drop):
    """Whether the closed segment p q meets the closed triangle a b c."""
    sp, sq = side_of_plane(a, b, c, p), side_of_plane(a, b, c, q)
    if sp * sq > 0:
        return False
    if sp == 0 and sq == 0:
        return _edge_meets_flat(p, q, a, b, c, drop)
    u, v, w = side_of_plane(p, q, a, b), side_of_plane(p, q, b, c), side_of_plane(p, q, c, a)
    return (u >= 0 and v >= 0 and w >= 0) or (u <= 0 and v <= 0 and w <= 0)


@njit(cache=True, nogil=True)
def _edge_meets_flat(p, q, a, b, c, drop):
    """The same with all five points in one plane."""
    return (
        _within(p, a, b, c, drop)
        or _segments_meet(p, q, a, b, drop)
        or _segments_meet(p, q, b, c, drop)
        or _segments_meet(p, q, c, a, drop)
    )


@njit(cache=True, nogil=True)
def _within(p, a, b, c, drop):
    u, v, w = _turn(a, b, p, drop), _turn(b, c, p, drop), _turn(c, a, p, drop)
    return (u >= 0 and v >= 0 and w >= 0) or (u <= 0 and v <= 0 and w <= 0)


@njit(cache=True, nogil=True)
def _segments_meet(p, q, a, b, drop):
    """Whether two closed segments of one plane meet."""
    u, v = _turn(p, q, a, drop), _turn(p, q, b, drop)
    if u == 0 and v == 0:
        i, j = (drop + 1) % 3, (drop + 2) % 3
        return (
            max(p[i], q[i]) >= min(a[i], b[i])
            and max(a[i], b[i]) >= min(p[i], q[i])
            and max(p[j], q[j]) >= min(a[j], b[j])
            and max(a[j], b[j]) >= min(p[j], q[j])
        )
    return u * v <= 0 and _turn(a, b, p, drop) * _turn(a, b, q, drop) <= 0
