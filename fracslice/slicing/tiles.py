"""Tiles of 8 x 8 samples of one layer, and the integer work on them: who is inside, and who must be asked
next.

A tile is two words of 64 bits, *inside* and *known*, and 64 values; bit 8 * row + column belongs to the
sample at (8 tx + column, 8 ty + row). The sign of a sample that is not known is implied by a probe near it.
Whole rows of neighbours are compared at once by shifting words.

Closure, as in the sampler of volumes: where two neighbours differ in sign and one of them is only implied,
it is evaluated, until no such pair is left. So every edge that the contour crosses has two evaluated ends.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numba import njit

TILE = 8
OUTSIDE, INSIDE = -1, -2

ALL = np.uint64(0xFFFFFFFFFFFFFFFF)
NONE = np.uint64(0)
ONE = np.uint64(1)
FIRST_COLUMN = np.uint64(0x0101010101010101)
LAST_COLUMN = np.uint64(0x8080808080808080)
FIRST_ROW = np.uint64(0xFF)
LAST_ROW = np.uint64(0xFF00000000000000)
_1, _7, _8, _56 = (np.uint64(n) for n in (1, 7, 8, 56))

_DE_BRUIJN, _58 = np.uint64(0x03F79D71B4CB0A89), np.uint64(58)
_PLACES = np.empty(64, np.int64)
for _n in range(64):
    _PLACES[(int(_DE_BRUIJN) << _n) % (1 << 64) >> 58] = _n

PROBES = np.zeros(9, np.uint64)
"""The middles of the blocks of 8, 4 and 2 samples of a tile, as a word each."""
for _n in (8, 4, 2):
    for _y in range(_n // 2, 8, _n):
        for _x in range(_n // 2, 8, _n):
            PROBES[_n] |= np.uint64(1 << (8 * _y + _x))


@dataclass(eq=False)
class Tiles:
    """The tiles of a few layers, growing while they are explored.

    where: int32 [layers, ty + 2, tx + 2], the row of each tile, or `OUTSIDE` or `INSIDE` where none is
    needed; its rim is outside. cross: float32 [n, 128], where edges are crossed, when all is explored; see
    `marching.cross_edges`. place: int32 [n, 3], (layer, y, x) in `where`. inside, known: uint64 [n].
    values: float32 [n, 64].
    """

    where: np.ndarray
    place: np.ndarray
    inside: np.ndarray
    known: np.ndarray
    values: np.ndarray
    cross: np.ndarray = field(default_factory=lambda: np.empty((0, 128), np.float32))
    count: int = 0

    @classmethod
    def empty(cls, layers: int, ty: int, tx: int) -> Tiles:
        where = np.full((layers, ty + 2, tx + 2), OUTSIDE, np.int32)
        words = np.empty((2, 0), np.uint64)
        place, values = np.empty((0, 3), np.int32), np.empty((0, TILE * TILE), np.float32)
        return cls(where, place, words[0], words[1], values)

    def reserve(self, more: int) -> None:
        """Room for `more` tiles."""
        wanted = self.count + more
        if wanted > len(self.place):
            room = max(wanted, 2 * len(self.place))
            for name in ("place", "inside", "known", "values"):
                old = getattr(self, name)
                new = np.empty((room, *old.shape[1:]), old.dtype)
                new[: self.count] = old[: self.count]
                setattr(self, name, new)

    @property
    def arrays(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """where, place, inside, known and values, as the functions below take them."""
        return self.where, self.place, self.inside, self.known, self.values


@njit(cache=True, nogil=True)
def lowest(word):  # type: ignore[no-untyped-def]
    """The number of the lowest bit that is set (Leiserson, Prokop and Randall 1998, "Using de Bruijn
    sequences").
    """
    return _PLACES[((word & (~word + ONE)) * _DE_BRUIJN) >> _58]


@njit(cache=True, nogil=True)
def bits(word):  # type: ignore[no-untyped-def]
    """How many bits are set."""
    n = 0
    while word:
        word &= word - ONE
        n += 1
    return n


@njit(cache=True, nogil=True)
def neighbour_word(where, inside, k, y, x):  # type: ignore[no-untyped-def]
    """The inside word of the tile at a place, implied where there is no tile."""
    row = where[k, y, x]
    if row >= 0:
        return inside[row]
    return ALL if row == INSIDE else NONE


@njit(cache=True, nogil=True)
def rights(word, right):  # type: ignore[no-untyped-def]
    """For each sample the sign of the one to its right."""
    return ((word >> _1) & ~LAST_COLUMN) | ((right << _7) & LAST_COLUMN)


@njit(cache=True, nogil=True)
def lefts(word, left):  # type: ignore[no-untyped-def]
    return ((word << _1) & ~FIRST_COLUMN) | ((left >> _7) & FIRST_COLUMN)


@njit(cache=True, nogil=True)
def uppers(word, upper):  # type: ignore[no-untyped-def]
    """For each sample the sign of the one in the next row."""
    return (word >> _8) | (upper << _56)


@njit(cache=True, nogil=True)
def lowers(word, lower):  # type: ignore[no-untyped-def]
    return (word << _8) | (lower >> _56)


@njit(cache=True, nogil=True)
def allocate(where, place, inside, known, count, k, y, x):  # type: ignore[no-untyped-def]
    """A new tile, all its samples implied by what `where` said; returns the new count."""
    place[count, 0], place[count, 1], place[count, 2] = k, y, x
    inside[count] = ALL if where[k, y, x] == INSIDE else NONE
    known[count] = NONE
    where[k, y, x] = count
    return count + 1


@njit(cache=True, nogil=True)
def block_mask(size, y, x):  # type: ignore[no-untyped-def]
    """The bits of a block of size x size samples."""
    line = ((ONE << np.uint64(size)) - ONE) << np.uint64(x) if size < 8 else FIRST_ROW
    mask = NONE
    for r in range(y, y + size):
        mask |= line << np.uint64(8 * r)
    return mask


@njit(cache=True, nogil=True)
def undecided(size, limit, stop_inside, stop_outside, inside, known, values, count, points):  # type: ignore[no-untyped-def]
    """The probes of the next level: for each block whose own probe decides too little, the middles of its
    quarters.

    size: of the blocks, 8, 4 or 2; limit: the largest value that leaves a block of this size undecided.
    Blocks of `stop_inside` or `stop_outside` samples (by the sign of their probe) are not cut. points:
    int64, filled with 64 * tile + bit; returns how many.
    """
    n, half, quarter = 0, size // 2, size // 4
    for t in range(count):
        probes = known[t] & PROBES[size]
        while probes:
            bit = lowest(probes)
            probes &= probes - ONE
            v = values[t, bit]
            if abs(v) > limit or size <= (stop_inside if v < 0 else stop_outside):
                continue
            first = bit - 9 * (half - quarter)
            for p in (first, first + half, first + 8 * half, first + 9 * half):
                if not (known[t] >> np.uint64(p)) & ONE:
                    points[n] = 64 * t + p
                    n += 1
    return n


@njit(cache=True, nogil=True)
def record(size, points, f, inside, known, values):  # type: ignore[no-untyped-def]
    """Writes probes of blocks of `size`: their values, and their sign as the implied one of the block."""
    for n in range(len(points)):
        t, p = points[n] >> 6, points[n] & 63
        half = size // 2
        block = block_mask(size, (p >> 3) - half, (p & 7) - half) & ~known[t] if size > 1 else NONE
        bit = ONE << np.uint64(p)
        if f[n] < 0:
            inside[t] |= block | bit
        else:
            inside[t] &= ~(block | bit)
        known[t] |= bit
        values[t, p] = f[n]


@njit(cache=True, nogil=True)
def asked(where, place, inside, known, active, n_active, count, marks, points):  # type: ignore[no-untyped-def]
    """One wave of the closure: the implied samples that differ from a neighbour.

    active: int32, the tiles to look at, its first `n_active` filled; tiles allocated on the way are
    appended. Returns (number of active tiles, number of tiles, number of points, whether the solid reaches
    the rim).
    """
    n, a = 0, 0
    while a < n_active:
        t = active[a]
        a += 1
        marks[t] = 0
        k, y, x = place[t]
        s = inside[t]
        differing = NONE
        for side in range(4):
            dy, dx = (0, 0, 1, -1)[side], (1, -1, 0, 0)[side]
            other = neighbour_word(where, inside, k, y + dy, x + dx)
            if side == 0:
                d = s ^ rights(s, other)
                face = d & LAST_COLUMN
            elif side == 1:
                d = s ^ lefts(s, other)
                face = d & FIRST_COLUMN
            elif side == 2:
                d = s ^ uppers(s, other)
                face = d & LAST_ROW
            else:
                d = s ^ lowers(s, other)
                face = d & FIRST_ROW
            differing |= d
            if face and where[k, y + dy, x + dx] < 0:
                ny, nx = y + dy, x + dx
                if ny == 0 or nx == 0 or ny == where.shape[1] - 1 or nx == where.shape[2] - 1:
                    if face & known[t]:
                        return n_active, count, n, True
                    continue
                active[n_active] = count
                n_active += 1
                count = allocate(where, place, inside, known, count, k, ny, nx)
        need = differing & ~known[t]
        while need:
            points[n] = 64 * t + lowest(need)
            need &= need - ONE
            n += 1
    return n_active, count, n, False


@njit(cache=True, nogil=True)
def answered(where, place, inside, known, values, points, f, active, marks):  # type: ignore[no-untyped-def]
    """Writes the values of a wave; returns how many tiles the next one must look at."""
    n = 0
    for q in range(len(points)):
        t, p = points[q] >> 6, points[q] & 63
        bit = ONE << np.uint64(p)
        known[t] |= bit
        values[t, p] = f[q]
        if (f[q] < 0) == ((inside[t] & bit) != NONE):
            continue
        inside[t] ^= bit
        k, y, x = place[t]
        for side in range(5):
            o = where[k, y + (0, 0, 0, 1, -1)[side], x + (0, 1, -1, 0, 0)[side]]
            if o >= 0 and marks[o] == 0:
                marks[o] = 1
                active[n] = o
                n += 1
    return n


@njit(cache=True, nogil=True)
def corner_tiles(where, place, inside, known, count):  # type: ignore[no-untyped-def]
    """Allocates tiles of which the contour cuts nothing but the last cell, at the corner. Returns the new
    count.
    """
    for t in range(count):
        k, y, x = place[t]
        there = where[k, y - 1, x - 1]
        if there < 0 and ((there == INSIDE) != ((inside[t] & ONE) != NONE)):
            count = allocate(where, place, inside, known, count, k, y - 1, x - 1)
    return count


@njit(cache=True, nogil=True)
def coordinates(points, place, frame, z, x_out, y_out, z_out):  # type: ignore[no-untyped-def]
    """Positions of points 64 * tile + bit. frame: (x0, y0, dx, dy); z: of the layers; out in scene units."""
    for n in range(len(points)):
        t, p = points[n] >> 6, points[n] & 63
        x_out[n] = frame[0] + frame[2] * (8 * (place[t, 2] - 1) + (p & 7))
        y_out[n] = frame[1] + frame[3] * (8 * (place[t, 1] - 1) + (p >> 3))
        z_out[n] = z[place[t, 0]]
