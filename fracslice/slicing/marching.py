"""Marching squares on the tiles of one layer: coverage of pixels, and crossings linked to contours.

A pixel is the cell between four samples. Corners and edges are counted counter-clockwise from the lower
left corner and the lower edge; edge c lies between the corners c and c + 1.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from .tiles import ALL, FIRST_ROW, ONE, OUTSIDE, bits, lowest, neighbour_word, rights, uppers

SPREAD = (
    255
    * np.unpackbits(np.arange(256, dtype=np.uint8)[:, None], axis=1, bitorder="little")
    .view(np.uint64)
    .ravel()
)
"""For each byte, eight bytes that are 255 where it has a bit set."""


@njit(cache=True, nogil=True)
def corner_words(where, inside, k, y, x, t):  # type: ignore[no-untyped-def]
    """The signs of the corners 0 to 3 of each cell of a tile; a cell has the bit of its corner 0."""
    s = inside[t]
    up = neighbour_word(where, inside, k, y + 1, x)
    right = neighbour_word(where, inside, k, y, x + 1)
    diagonal = neighbour_word(where, inside, k, y + 1, x + 1)
    r = rights(s, right)
    return s, r, uppers(r, rights(up, diagonal)), uppers(s, up)


@njit(cache=True, nogil=True)
def at(where, values, k, y, x, t, r, c):  # type: ignore[no-untyped-def]
    """The value of sample (r, c) of a tile, 0 to 8; without meaning where nothing is known."""
    if r < 8 and c < 8:
        return values[t, 8 * r + c]
    other = where[k, y + (r >> 3), x + (c >> 3)]
    return values[other, 8 * (r & 7) + (c & 7)] if other >= 0 else np.float32(0)


@njit(cache=True, nogil=True)
def crossing_words(where, inside, k, y, x, t):  # type: ignore[no-untyped-def]
    """The samples of a tile whose edge to the right is crossed, and those whose edge upwards is."""
    s = inside[t]
    right = s ^ rights(s, neighbour_word(where, inside, k, y, x + 1))
    return right, s ^ uppers(s, neighbour_word(where, inside, k, y + 1, x))


@njit(cache=True, nogil=True)
def cross_edges(where, place, inside, values, count, cross, edges):  # type: ignore[no-untyped-def]
    """Where each edge of all tiles is crossed, by linear interpolation.

    cross: float32 [tiles, 128], filled with the share of the edge before the crossing: of the edge from
    each sample to its right, then of the one upwards. edges: int64, filled with 128 * tile + number of the
    edge; returns how many.
    """
    n = 0
    for t in range(count):
        k, y, x = place[t]
        words = crossing_words(where, inside, k, y, x, t)
        for up in range(2):
            word = words[up]
            while word:
                bit = lowest(word)
                word &= word - ONE
                a, b = values[t, bit], at(where, values, k, y, x, t, (bit >> 3) + up, (bit & 7) + 1 - up)
                cross[t, 64 * up + bit] = a / (a - b)
                edges[n] = 128 * t + 64 * up + bit
                n += 1
    return n


@njit(cache=True, nogil=True)
def halve(where, place, values, edges, middle, cross):  # type: ignore[no-untyped-def]
    """Better crossings from the field's values at the middles of edges, for fields whose inside values are
    too small.

    A middle that is outside makes a line with the end that is outside; both are distances.
    """
    for n in range(len(edges)):
        t, up, bit = edges[n] >> 7, (edges[n] >> 6) & 1, edges[n] & 63
        k, y, x = place[t]
        a, b = values[t, bit], at(where, values, k, y, x, t, (bit >> 3) + up, (bit & 7) + 1 - up)
        out, into, m = max(a, b), min(a, b), middle[n]
        if m < 0:
            share = 0.5 * out / (out - m)
        elif out > m:
            share = min(0.5 * out / (out - m), 1.0)
        else:
            share = 0.5 + 0.5 * m / (m - into)
        cross[t, edges[n] & 127] = share if a >= 0 else 1 - share


@njit(cache=True, nogil=True)
def shares(where, cross, k, y, x, t, bit):  # type: ignore[no-untyped-def]
    """For each corner of a cell, and the edges after and before it, the share of the edge before its
    crossing as seen from the corner: eight numbers; those of edges that are not crossed have no meaning.
    """
    right = max(where[k, y, x + 1], 0) if bit & 7 == 7 else t
    upper = max(where[k, y + 1, x], 0) if bit >> 3 == 7 else t
    one = np.float32(1)
    e0, e3 = cross[t, bit], cross[t, 64 + bit]
    e1 = cross[right, 64 + (bit & 56) + ((bit + 1) & 7)]
    e2 = cross[upper, (bit + 8) & 63]
    return e0, e3, e1, one - e0, one - e2, one - e1, one - e3, e2


@njit(cache=True, nogil=True)
def signs(words, bit):  # type: ignore[no-untyped-def]
    """Which corners of a cell are inside, as the bits 0 to 3."""
    n = np.int64(0)
    for q in range(4):
        n |= np.int64((words[q] >> np.uint64(bit)) & ONE) << q
    return n


@njit(cache=True, nogil=True)
def joined(e, q):  # type: ignore[no-untyped-def]
    """Whether the inside corners q and q + 2 of an alternating cell are connected: if more of its border is
    inside.
    """
    return e[2 * q] + e[2 * q + 1] + e[2 * q + 4] + e[2 * q + 5] > 2


@njit(cache=True, nogil=True)
def cut(e, q):  # type: ignore[no-untyped-def]
    """The area of the triangle that the contour cuts off at corner q."""
    return e[2 * q] * e[2 * q + 1] / 2


@njit(cache=True, nogil=True)
def cell_area(e, inside):  # type: ignore[no-untyped-def]
    """The inside part of a mixed cell's area. e: its `shares`; inside: the signs of its corners as bits."""
    if inside == 5 or inside == 10:
        q = 0 if inside == 5 else 1
        if joined(e, q):
            return 1 - cut(e, q + 1) - cut(e, (q + 3) & 3)
        return cut(e, q) + cut(e, q + 2)
    for q in range(4):
        if inside == 1 << q:
            return cut(e, q)
        if inside == 15 - (1 << q):
            return 1 - cut(e, q)
    q = 0 if inside == 3 else 1 if inside == 6 else 2 if inside == 12 else 3
    return (e[2 * q + 1] + e[2 * ((q + 1) & 3)]) / 2


@njit(cache=True, nogil=True)
def paint(where, inside, cross, k, image):  # type: ignore[no-untyped-def]
    """Writes the coverage of one layer to a zeroed image; 255 is wholly inside.

    image: uint64 [ny, tx], eight pixels a word, row 0 lowest. Returns (inside area in pixels, number of
    partly covered pixels).
    """
    grey = image.view(np.uint8)
    area, partly = 0.0, 0
    for y in range(1, where.shape[1] - 1):
        y0 = 8 * (y - 1)
        rows = min(8, image.shape[0] - y0)
        for x in range(1, where.shape[2] - 1):
            t = where[k, y, x]
            if t == OUTSIDE or x > image.shape[1]:
                continue
            words = corner_words(where, inside, k, y, x, t) if t >= 0 else (ALL, ALL, ALL, ALL)
            whole = words[0] & words[1] & words[2] & words[3]
            mixed = (words[0] | words[1] | words[2] | words[3]) & ~whole
            if whole:
                area += 64 if whole == ALL else bits(whole)
                for r in range(rows):
                    image[y0 + r, x - 1] = SPREAD[(whole >> np.uint64(8 * r)) & FIRST_ROW]
            while mixed:
                bit = lowest(mixed)
                mixed &= mixed - ONE
                r = bit >> 3
                if r < rows:
                    a = cell_area(shares(where, cross, k, y, x, t, bit), signs(words, bit))
                    grey[y0 + r, 8 * (x - 1) + (bit & 7)] = np.uint8(255 * a + 0.5)
                    area += a
                    partly += 1
    return area, partly


@njit(cache=True, nogil=True)
def number_edges(where, inside, values, k, ids, points, ends):  # type: ignore[no-untyped-def]
    """Numbers the crossing edges of a layer.

    ids: int32 [tiles, 128], the number of the edge from each sample to its right, then to the one above it.
    points: int32 [n, 3], (column, row, 0 right or 1 up). ends: float64 [n, 2], values at both ends. Returns
    how many there are; writes none beyond the arrays' length.
    """
    n = 0
    for y in range(1, where.shape[1] - 1):
        for x in range(1, where.shape[2] - 1):
            t = where[k, y, x]
            if t < 0:
                continue
            words = crossing_words(where, inside, k, y, x, t)
            crossing = words[0] | words[1]
            while crossing:
                bit = lowest(crossing)
                crossing &= crossing - ONE
                r, c = bit >> 3, bit & 7
                for up in range(2):
                    if (words[up] >> np.uint64(bit)) & ONE:
                        if n < len(points):
                            ids[t, 64 * up + bit] = n
                            points[n, 0], points[n, 1], points[n, 2] = 8 * (x - 1) + c, 8 * (y - 1) + r, up
                            ends[n, 0], ends[n, 1] = (
                                values[t, bit],
                                at(where, values, k, y, x, t, r + up, c + 1 - up),
                            )
                        n += 1
    return n


@njit(cache=True, nogil=True)
def link(where, inside, cross, k, ids, following):  # type: ignore[no-untyped-def]
    """For each numbered edge the one that follows on its contour, the inside to the left; int32 [n]."""
    e = np.empty(4, np.int32)
    for y in range(1, where.shape[1] - 1):
        for x in range(1, where.shape[2] - 1):
            t = where[k, y, x]
            if t < 0:
                continue
            words = corner_words(where, inside, k, y, x, t)
            mixed = (words[0] | words[1] | words[2] | words[3]) & ~(words[0] & words[1] & words[2] & words[3])
            while mixed:
                bit = lowest(mixed)
                mixed &= mixed - ONE
                r, c = bit >> 3, bit & 7
                right = where[k, y, x + 1] if c == 7 else t
                upper = where[k, y + 1, x] if r == 7 else t
                e[0], e[3] = ids[t, bit], ids[t, 64 + bit]
                e[1] = ids[right, 64 + 8 * r + ((c + 1) & 7)] if right >= 0 else -1
                e[2] = ids[upper, 8 * ((r + 1) & 7) + c] if upper >= 0 else -1
                _link_cell(shares(where, cross, k, y, x, t, bit), signs(words, bit), e, following)


@njit(cache=True, nogil=True)
def _link_cell(share, inside, e, following):  # type: ignore[no-untyped-def]
    """Where the outline of the cell's inside, counter-clockwise, leaves along one edge, it comes back along
    another.
    """
    alone = (inside == 5 and not joined(share, 0)) or (inside == 10 and not joined(share, 1))
    for q in range(4):
        g = (q + 1) & 3
        if (inside >> q) & 1 and not (inside >> g) & 1:
            to = (q + 3) & 3 if alone else g
            while not alone and not (inside >> ((to + 1) & 3)) & 1:
                to = (to + 1) & 3
            following[e[q]] = e[to]


@njit(cache=True, nogil=True)
def walk(following, order, starts):  # type: ignore[no-untyped-def]
    """Cuts the permutation `following` into its cycles: order int32 [n], starts int32 [n + 1]. Returns how
    many.
    """
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
