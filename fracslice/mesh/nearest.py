# mypy: allow-untyped-defs, allow-untyped-calls, allow-untyped-decorators
"""How far one mesh is from another: proved, or sampled.

Importing this module imports Numba.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from fracslice.mesh.model import Mesh
from fracslice.mesh.tree import LEAF, Tree, build
from fracslice.work import Work, chunks

CHUNK = 4096
DEPTH = 32
"""How often a triangle is cut before nothing is said of it."""


def distance_bounds(
    mesh: Mesh, other: Mesh, tolerance: float, work: Work, tree: Tree | None = None
) -> NDArray[np.float64]:
    """For each triangle of `mesh` a proved bound on how far its points are from `other`, float64 [m].

    Infinite where a point is farther than `tolerance`, or that could not be excluded. The distance to one
    triangle is a convex function: a piece whose corners all are within a distance of the same triangle is so
    as a whole; other pieces are cut (the idea of Tang, Lee and Kim, "Interactive Hausdorff distance
    computation for general polygonal models", 2009). Raises `Cancelled`.
    """
    tree, bounds = tree or build(other), np.empty(len(mesh.triangles))

    def task(part: slice) -> None:
        _bound(
            mesh.vertices,
            mesh.triangles[part],
            other.vertices,
            other.triangles,
            *tree,
            tolerance,
            bounds[part],
        )

    work.map(task, chunks(len(bounds), CHUNK))
    return bounds


def sampled_distances(mesh: Mesh, other: Mesh, spacing: float, work: Work) -> NDArray[np.float64]:
    """For each triangle of `mesh` the greatest distance of its samples from `other`, float64 [m].

    Samples are `spacing` apart, corners and edges included, so that no point is more than spacing / sqrt(3)
    farther. Raises `Cancelled`.
    """
    tree, found = build(other), np.empty(len(mesh.triangles))

    def task(part: slice) -> None:
        _sample(
            mesh.vertices, mesh.triangles[part], other.vertices, other.triangles, *tree, spacing, found[part]
        )

    work.map(task, chunks(len(found), CHUNK))
    return found


@njit(cache=True, nogil=True)
def square_distance(p, a, b, c):
    """The squared distance of a point from a triangle (Ericson, "Real-Time Collision Detection", 2005)."""
    ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    vx, vy, vz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    x, y, z = p[0] - a[0], p[1] - a[1], p[2] - a[2]
    d1, d2 = ux * x + uy * y + uz * z, vx * x + vy * y + vz * z
    if d1 <= 0 and d2 <= 0:
        return x * x + y * y + z * z
    uu, uv, vv = ux * ux + uy * uy + uz * uz, ux * vx + uy * vy + uz * vz, vx * vx + vy * vy + vz * vz
    d3, d4 = d1 - uu, d2 - uv
    d5, d6 = d1 - uv, d2 - vv
    s, t = 0.0, 0.0
    if d3 >= 0 and d4 <= d3:
        s = 1.0
    elif d6 >= 0 and d5 <= d6:
        t = 1.0
    elif d1 * d4 - d3 * d2 <= 0 and d1 >= 0 and d3 <= 0:
        s = d1 / (d1 - d3)
    elif d5 * d2 - d1 * d6 <= 0 and d2 >= 0 and d6 <= 0:
        t = d2 / (d2 - d6)
    elif d3 * d6 - d5 * d4 <= 0 and d4 - d3 >= 0 and d5 - d6 >= 0:
        t = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        s = 1 - t
    else:
        area = uu * vv - uv * uv
        s, t = (vv * d1 - uv * d2) / area, (uu * d2 - uv * d1) / area
    x, y, z = x - s * ux - t * vx, y - s * uy - t * vy, z - s * uz - t * vz
    return x * x + y * y + z * z


@njit(cache=True, nogil=True)
def _to(vertices, triangles, p, t):
    return square_distance(p, vertices[triangles[t, 0]], vertices[triangles[t, 1]], vertices[triangles[t, 2]])


@njit(cache=True, nogil=True)
def _to_box(p, low, high, node):
    total = 0.0
    for k in range(3):
        d = max(low[node, k] - p[k], max(0.0, p[k] - high[node, k]))
        total += d * d
    return total


@njit(cache=True, nogil=True)
def _nearest(p, vertices, triangles, order, low, high, guess, stack):
    """The triangle nearest to p and its squared distance; the search begins with a guess."""
    best, found, height, leaves = _to(vertices, triangles, p, guess), guess, 1, len(low) // 2
    stack[0] = 1
    while height > 0:
        height -= 1
        node = stack[height]
        if _to_box(p, low, high, node) >= best:
            continue
        if node < leaves:
            a, b = 2 * node, 2 * node + 1
            if _to_box(p, low, high, a) < _to_box(p, low, high, b):
                a, b = b, a
            stack[height], stack[height + 1] = a, b
            height += 2
            continue
        for i in range((node - leaves) * LEAF, min(len(order), (node - leaves + 1) * LEAF)):
            d = _to(vertices, triangles, p, order[i])
            if d < best:
                best, found = d, order[i]
    return found, best


@njit(cache=True, nogil=True)
def _bound(vertices, parts, other, triangles, order, low, high, tolerance, bounds):
    """`distance_bounds` of the triangles `parts`."""
    stack, guess = np.empty(128, np.int64), order[0]
    corners, near = np.empty((DEPTH + 1, 3, 3)), np.empty((DEPTH + 1, 3), np.int64)
    depths = np.empty(DEPTH + 1, np.int64)
    for m in range(len(parts)):
        most = 0.0
        for k in range(3):
            corners[0, k] = vertices[parts[m, k]]
            guess, d = _nearest(corners[0, k], other, triangles, order, low, high, guess, stack)
            near[0, k] = guess
            most = max(most, d)
        depths[0], height = 0, 1
        while height > 0 and most <= tolerance * tolerance:
            height -= 1
            upper = np.inf
            for k in range(3):
                worst = 0.0
                for j in range(3):
                    worst = max(worst, _to(other, triangles, corners[height, j], near[height, k]))
                upper = min(upper, worst)
            if upper <= tolerance * tolerance:
                most = max(most, upper)
            elif depths[height] == DEPTH:
                most = np.inf
            else:
                point = _cut(corners, near, depths, height, other, triangles)
                found, d = _nearest(point, other, triangles, order, low, high, near[height, 0], stack)
                near[height, 1], near[height + 1, 0] = found, found
                height += 2
                if d > tolerance * tolerance:
                    most = np.inf
        bounds[m] = math.sqrt(most) if most <= tolerance * tolerance else np.inf


@njit(cache=True, nogil=True)
def _cut(corners, near, depths, row, other, triangles):
    """Cuts the piece in a row in two, which come into this row and the next, and returns the point between.

    The longest edge between corners that are near different triangles is cut where both are equally far, so
    that each piece soon has a triangle of its own; now and then in its middle, so that pieces get small.
    """
    k, longest = 0, -1.0
    for j in range(3):
        d = 0.0
        for x in range(3):
            d += (corners[row, j, x] - corners[row, (j + 1) % 3, x]) ** 2
        if d > longest and near[row, j] != near[row, (j + 1) % 3]:
            k, longest = j, d
    a, b, c = corners[row, k].copy(), corners[row, (k + 1) % 3].copy(), corners[row, (k + 2) % 3].copy()
    i, j, m = near[row, k], near[row, (k + 1) % 3], near[row, (k + 2) % 3]
    low, high = 0.0, 1.0
    for _ in range(1 if depths[row] % 4 == 3 else 16):
        t = (low + high) / 2
        point = a + t * (b - a)
        if _to(other, triangles, point, i) < _to(other, triangles, point, j):
            low = t
        else:
            high = t
    corners[row, 0], corners[row, 1], corners[row, 2] = a, point, c
    corners[row + 1, 0], corners[row + 1, 1], corners[row + 1, 2] = point, b, c
    near[row, 0], near[row, 2] = i, m
    near[row + 1, 1], near[row + 1, 2] = j, m
    depths[row] += 1
    depths[row + 1] = depths[row]
    return point


@njit(cache=True, nogil=True)
def _sample(vertices, parts, other, triangles, order, low, high, spacing, found):
    """`sampled_distances` of the triangles `parts`."""
    stack, guess, p = np.empty(128, np.int64), order[0], np.empty(3)
    for m in range(len(parts)):
        a, b, c = vertices[parts[m, 0]], vertices[parts[m, 1]], vertices[parts[m, 2]]
        longest = 0.0
        for x in range(3):
            d = max(abs(a[x] - b[x]), max(abs(b[x] - c[x]), abs(c[x] - a[x])))
            longest += d * d
        n, most = max(1, math.ceil(math.sqrt(longest) / spacing)), 0.0
        for i in range(n + 1):
            for j in range(n + 1 - i):
                for x in range(3):
                    p[x] = a[x] + (b[x] - a[x]) * (i / n) + (c[x] - a[x]) * (j / n)
                guess, d = _nearest(p, other, triangles, order, low, high, guess, stack)
                most = max(most, d)
        found[m] = math.sqrt(most)
