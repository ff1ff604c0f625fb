"""Marching squares on the tiles of one layer: coverage of pixels, and crossings linked to contours.

A pixel is the cell between four samples. Corners and edges are counted counter-clockwise from the lower left corner and the
lower edge; edge c lies between the corners c and c + 1. A cell whose corners alternate is joined or parted by the saddle
value of the bilinear patch (Nielson and Hamann 1991, "The asymptotic decider").
"""

from __future__ import annotations

import numpy as np
from numba import njit

from .tiles import ALL, INSIDE, NONE, ONE, neighbour_word, rights, uppers

FAR = np.float32(1e30)
"""Stands for the value of a sample that is only implied; no crossing edge ends there."""

CORNER_X = (0, 1, 1, 0)
CORNER_Y = (0, 0, 1, 1)


@njit(cache=True, nogil=True)
def mixed_cells(where, inside, k, y, x, t):  # type: ignore[no-untyped-def]
    """The cells of a tile whose corners differ in sign, as a word; a cell has the bit of its lower left corner."""
    s = inside[t]
    up = neighbour_word(where, inside, k, y + 1, x)
    right = neighbour_word(where, inside, k, y, x + 1)
    diagonal = neighbour_word(where, inside, k, y + 1, x + 1)
    r, u = rights(s, right), uppers(s, up)
    d = uppers(r, rights(up, diagonal))
    return (s ^ r) | (s ^ u) | (s ^ d)


@njit(cache=True, nogil=True)
def patch(where, inside, known, values, k, y, x, out):  # type: ignore[no-untyped-def]
    """The 9 x 9 values that the cells of a tile have as corners, float32 [9, 9]."""
    for part in range(4):
        py, px = part >> 1, part & 1
        t = where[k, y + py, x + px]
        for r in range(1 if py else 8):
            for c in range(1 if px else 8):
                bit = np.uint64(8 * r + c)
                if t < 0:
                    v = -FAR if t == INSIDE else FAR
                elif (known[t] >> bit) & ONE:
                    v = values[t, 8 * r + c]
                else:
                    v = -FAR if (inside[t] >> bit) & ONE else FAR
                out[8 * py + r, 8 * px + c] = v


@njit(cache=True, nogil=True)
def joined(a, b, c, d):  # type: ignore[no-untyped-def]
    """Whether the inside corners of an alternating cell are connected."""
    below = a + c - b - d
    return (a * c - b * d) / below < 0 if below != 0 else False


@njit(cache=True, nogil=True)
def cell_area(f, r, c):  # type: ignore[no-untyped-def]
    """The inside part of a cell's area, its crossings by linear interpolation: shoelace over the polygon's corners."""
    area, apart = 0.0, 0.0
    n_inside = 0
    first_x = first_y = last_x = last_y = 0.0
    n = 0
    for q in range(4):
        x, y = CORNER_X[q], CORNER_Y[q]
        g = (q + 1) & 3
        a, b = f[r + y, c + x], f[r + CORNER_Y[g], c + CORNER_X[g]]
        if a < 0:
            n_inside += 1
            if n:
                area += last_x * y - last_y * x
            else:
                first_x, first_y = x, y
            last_x, last_y = x, y
            n += 1
        if (a < 0) != (b < 0):
            t = a / (a - b)
            px, py = x + t * (CORNER_X[g] - x), y + t * (CORNER_Y[g] - y)
            if n:
                area += last_x * py - last_y * px
            else:
                first_x, first_y = px, py
            last_x, last_y = px, py
            n += 1
    area = (area + last_x * first_y - last_y * first_x) / 2
    alternating = n_inside == 2 and n == 6
    if alternating and not joined(f[r, c], f[r, c + 1], f[r + 1, c + 1], f[r + 1, c]):
        apart = _corners_alone(f, r, c)
    return apart if apart > 0 else area


@njit(cache=True, nogil=True)
def _corners_alone(f, r, c):  # type: ignore[no-untyped-def]
    """The area of an alternating cell's two inside corners, each cut off by itself."""
    area = 0.0
    for q in range(4):
        a = f[r + CORNER_Y[q], c + CORNER_X[q]]
        if a < 0:
            b = f[r + CORNER_Y[(q + 1) & 3], c + CORNER_X[(q + 1) & 3]]
            d = f[r + CORNER_Y[(q + 3) & 3], c + CORNER_X[(q + 3) & 3]]
            area += (a / (a - b)) * (a / (a - d)) / 2
    return area


@njit(cache=True, nogil=True)
def paint(where, inside, known, values, k, image):  # type: ignore[no-untyped-def]
    """Writes the coverage of one layer to a zeroed image, uint8 [ny, nx], row 0 lowest; 255 is wholly inside.

    Returns (inside area in pixels, number of partly covered pixels).
    """
    ny, nx = image.shape
    f = np.empty((9, 9), np.float32)
    area, partly = 0.0, 0
    for y in range(1, where.shape[1] - 1):
        for x in range(1, where.shape[2] - 1):
            t = where[k, y, x]
            y0, x0 = 8 * (y - 1), 8 * (x - 1)
            full = t == INSIDE or (t >= 0 and inside[t] == ALL)
            if t < 0 and not full:
                continue
            mixed = mixed_cells(where, inside, k, y, x, t) if t >= 0 else NONE
            if full and mixed == NONE:
                rows, columns = min(8, ny - y0), min(8, nx - x0)
                for r in range(rows):
                    image[y0 + r, x0 : x0 + columns] = 255
                area += rows * columns
                continue
            if mixed:
                patch(where, inside, known, values, k, y, x, f)
            for bit in range(64):
                r, c = bit >> 3, bit & 7
                if y0 + r >= ny or x0 + c >= nx:
                    continue
                if (mixed >> np.uint64(bit)) & ONE:
                    a = cell_area(f, r, c)
                    image[y0 + r, x0 + c] = np.uint8(255 * a + 0.5)
                    area += a
                    partly += 1
                elif (inside[t] >> np.uint64(bit)) & ONE:
                    image[y0 + r, x0 + c] = 255
                    area += 1
    return area, partly


@njit(cache=True, nogil=True)
def number_edges(where, inside, known, values, k, ids, points, ends):  # type: ignore[no-untyped-def]
    """Numbers the crossing edges of a layer.

    ids: int32 [tiles, 128], the number of the edge from each sample to its right, then to the one above it. points: int32
    [n, 3], (column, row, 0 right or 1 up). ends: float64 [n, 2], values at both ends. Returns how many there are; writes
    none beyond the arrays' length.
    """
    n = 0
    f = np.empty((9, 9), np.float32)
    for y in range(1, where.shape[1] - 1):
        for x in range(1, where.shape[2] - 1):
            t = where[k, y, x]
            if t < 0:
                continue
            s = inside[t]
            crossing_right = s ^ rights(s, neighbour_word(where, inside, k, y, x + 1))
            crossing_up = s ^ uppers(s, neighbour_word(where, inside, k, y + 1, x))
            if not (crossing_right | crossing_up):
                continue
            patch(where, inside, known, values, k, y, x, f)
            for bit in range(64):
                r, c = bit >> 3, bit & 7
                for up in range(2):
                    if ((crossing_up if up else crossing_right) >> np.uint64(bit)) & ONE:
                        if n < len(points):
                            ids[t, 64 * up + bit] = n
                            points[n, 0], points[n, 1], points[n, 2] = 8 * (x - 1) + c, 8 * (y - 1) + r, up
                            ends[n, 0], ends[n, 1] = f[r, c], f[r + up, c + 1 - up]
                        n += 1
    return n


@njit(cache=True, nogil=True)
def link(where, inside, known, values, k, ids, following):  # type: ignore[no-untyped-def]
    """For each numbered edge the one that follows on its contour, the inside to the left; int32 [n]."""
    f = np.empty((9, 9), np.float32)
    e = np.empty(4, np.int32)
    for y in range(1, where.shape[1] - 1):
        for x in range(1, where.shape[2] - 1):
            t = where[k, y, x]
            if t < 0:
                continue
            mixed = mixed_cells(where, inside, k, y, x, t)
            if mixed == NONE:
                continue
            patch(where, inside, known, values, k, y, x, f)
            for bit in range(64):
                if not (mixed >> np.uint64(bit)) & ONE:
                    continue
                r, c = bit >> 3, bit & 7
                right = where[k, y, x + 1] if c == 7 else t
                upper = where[k, y + 1, x] if r == 7 else t
                e[0], e[3] = ids[t, bit], ids[t, 64 + bit]
                e[1] = ids[right, 64 + 8 * r + ((c + 1) & 7)] if right >= 0 else -1
                e[2] = ids[upper, 8 * ((r + 1) & 7) + c] if upper >= 0 else -1
                _link_cell(f[r, c], f[r, c + 1], f[r + 1, c + 1], f[r + 1, c], e, following)


@njit(cache=True, nogil=True)
def _link_cell(a, b, c, d, e, following):  # type: ignore[no-untyped-def]
    s = (a < 0, b < 0, c < 0, d < 0)
    alternating = s[0] == s[2] and s[1] == s[3]
    alone = alternating and not joined(a, b, c, d)
    for q in range(4):
        if s[q] and not s[(q + 1) & 3]:
            step = 3 if alone else 1
            to = (q + step) & 3
            while not alone and not (s[(to + 1) & 3] and not s[to]):
                to = (to + 1) & 3
            following[e[q]] = e[to]


@njit(cache=True, nogil=True)
def walk(following, order, starts):  # type: ignore[no-untyped-def]
    """Cuts the permutation `following` into its cycles: order int32 [n], starts int32 [n + 1]. Returns how many."""
    seen = np.zeros(len(following), np.bool_)
    loops, n = 0, 0
    for first in range(len(following)):
        if seen[first]:
            continue
        starts[loops] = n
        loops += 1
        e = first
        while not seen[e]:
            seen[e] = True
            order[n] = e
            n += 1
            e = following[e]
    starts[loops] = n
    return loops
