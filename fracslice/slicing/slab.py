"""A few neighbouring layers, from the field to the samples around their contours.

Top down, blocks of 64, 32 and 16 pixels over all layers of the slab, then of 8 pixels in each layer, then,
within tiles, of 4, 2 and 1: a block is dropped where ``|f| > L * reach`` at its middle says that no sample
in it has the other sign. What is left is closed by `tiles.asked`. Every probe from 8 pixels down is a
sample itself, so nothing is evaluated twice.

Where inside values say little about distance (escape-time fractals), going down to single pixels everywhere
would cost more than the contours: there probing ends at `WEAK_INSIDE` and `WEAK_OUTSIDE` pixels, and the
closure does the rest. Parts of a layer smaller than that which touch no probe are then not found.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ..errors import SliceError
from ..formulas.registry import Facts
from . import marching
from . import tiles as t
from .tiles import INSIDE, OUTSIDE, TILE, Tiles

COARSEST = 8
"""Tiles along a block of the first level."""

WEAK_INSIDE, WEAK_OUTSIDE = 4, 2


class Field(Protocol):
    """What is sampled: a kernel, or one with changes."""

    @property
    def dtype(self) -> np.dtype: ...

    def points(self, x: np.ndarray, y: np.ndarray, z: np.ndarray, /) -> np.ndarray: ...


@dataclass(frozen=True, eq=False)
class Sampler:
    """Samples slabs of a stack; may be used from many threads.

    frame: (x0, y0, dx, dy) of the lattice, scene units. shape: lattice points (ny, nx).
    """

    kernel: Field
    facts: Facts
    frame: np.ndarray
    shape: tuple[int, int]

    def sample(self, z: np.ndarray) -> tuple[Tiles, int]:
        """The tiles of the layers at heights `z` (scene units), closed, and how many evaluations they took.

        Raises `SliceError` where the solid reaches the rim of the lattice.
        """
        ty, tx = (-(-n // TILE) for n in self.shape)
        tiles = Tiles.empty(len(z), ty, tx)
        spent = self._coarse(tiles, z)
        for size in (8, 4, 2):
            spent += self._finer(tiles, z, size)
        spent += self._closed(tiles, z)
        tiles.reserve(tiles.count)
        tiles.count = t.corner_tiles(*tiles.arrays[:4], tiles.count)
        return tiles, spent + self._crossed(tiles, z)

    # --- top down
    # ---------------------------------------------------------------------------------------------------
    def _coarse(self, tiles: Tiles, z: np.ndarray) -> int:
        """Blocks over the whole slab, then tiles of each layer; fills `where` and allocates what may hold a
        contour.
        """
        _, height, width = tiles.where.shape
        size = COARSEST
        blocks = np.stack(
            np.meshgrid(*(np.arange(1, n - 1, size) for n in (height, width)), indexing="ij"), -1
        ).reshape(-1, 2)
        middle, half = (z.max() + z.min()) / 2, (z.max() - z.min()) / 2
        spent = 0
        while size > 1:
            f = self._at((blocks - 1 + size / 2) * TILE, np.full(len(blocks), middle))
            spent += len(f)
            reach = self.facts.lipschitz * math.hypot(self._diagonal(size * TILE), half)
            for y, x in blocks[f < -reach]:
                tiles.where[:, y : min(y + size, height - 1), x : min(x + size, width - 1)] = INSIDE
            size //= 2
            blocks = (blocks[~(np.abs(f) > reach)][:, None] + size * _QUARTERS).reshape(-1, 2)
            blocks = blocks[(blocks < (height - 1, width - 1)).all(1)]
        return spent + self._tiles(tiles, z, blocks)

    def _tiles(self, tiles: Tiles, z: np.ndarray, blocks: np.ndarray) -> int:
        layer = np.repeat(np.arange(len(z)), len(blocks))
        blocks = np.tile(blocks, (len(z), 1))
        f = self._at((blocks - 1) * TILE + TILE / 2, z[layer])
        tiles.where[layer, blocks[:, 0], blocks[:, 1]] = np.where(f < 0, INSIDE, OUTSIDE)
        kept = np.flatnonzero(~(np.abs(f) > self.facts.lipschitz * self._diagonal(TILE)))
        n = len(kept)
        tiles.reserve(6 * n)
        tiles.count = n
        tiles.place[:n] = np.column_stack([layer, blocks])[kept]
        tiles.where[tuple(tiles.place[:n].T)] = np.arange(n)
        tiles.inside[:n] = np.where(f[kept] < 0, t.ALL, t.NONE)
        tiles.known[:n] = np.uint64(1) << np.uint64(TILE * TILE // 2 + TILE // 2)
        tiles.values[:n, TILE * TILE // 2 + TILE // 2] = f[kept]
        return len(f)

    def _finer(self, tiles: Tiles, z: np.ndarray, size: int) -> int:
        stops = (WEAK_INSIDE, WEAK_OUTSIDE) if self.facts.weak else (1, 1)
        limit = self.facts.lipschitz * self._diagonal(size)
        points = np.empty(tiles.count * (2 * TILE // size) ** 2, np.int64)
        words = (tiles.inside, tiles.known, tiles.values)
        points = points[: t.undecided(size, limit, *stops, *words, tiles.count, points)]
        t.record(size // 2, points, self._field(tiles, z, points), *words)
        return len(points)

    # --- outside in, and inside out
    # ---------------------------------------------------------------------------------
    def _closed(self, tiles: Tiles, z: np.ndarray) -> int:
        self._mend(tiles)
        spent, active = 0, np.arange(tiles.count, dtype=np.int32)
        while n := len(active):
            tiles.reserve(4 * n)
            active = np.concatenate([active, np.empty(4 * n, np.int32)])
            marks = np.zeros(len(tiles.place), np.uint8)
            points = np.empty(5 * n * TILE * TILE, np.int64)
            n, tiles.count, asked, reached = t.asked(*tiles.arrays[:4], active, n, tiles.count, marks, points)
            if reached:
                raise SliceError("the solid reaches the border of the layers; give it finite <bounds>")
            points = points[:asked]
            active = np.empty(tiles.count, np.int32)
            active = active[: t.answered(*tiles.arrays, points, self._field(tiles, z, points), active, marks)]
            spent += asked
        return spent

    def _crossed(self, tiles: Tiles, z: np.ndarray) -> int:
        """Finds where edges are crossed."""
        tiles.cross = np.empty((tiles.count, 2 * TILE * TILE), np.float32)
        words = (tiles.where, tiles.place, tiles.inside, tiles.values)
        edges = np.empty(tiles.count * 2 * TILE * TILE, np.int64)
        edges = edges[: marching.cross_edges(*words, tiles.count, tiles.cross, edges)]
        if not self.facts.weak:
            return 0
        up = (edges >> 6) & 1
        middle = self._field(tiles, z, (edges >> 7 << 6) + (edges & 63), 0.5 * (1 - up), 0.5 * up)
        marching.halve(tiles.where, tiles.place, tiles.values, edges, middle, tiles.cross)
        return len(edges)

    def _mend(self, tiles: Tiles) -> None:
        """Allocates tiles said to be full beside ones said to be empty: the bound is wrong there."""
        empty = tiles.where == OUTSIDE
        beside = np.zeros_like(empty)
        beside[:, 1:-1] |= empty[:, 2:] | empty[:, :-2]
        beside[:, :, 1:-1] |= empty[:, :, 2:] | empty[:, :, :-2]
        lost = np.argwhere(beside & (tiles.where == INSIDE))
        tiles.reserve(len(lost))
        for k, y, x in lost:
            tiles.count = t.allocate(*tiles.arrays[:4], tiles.count, k, y, x)

    # --- the field
    # ----------------------------------------------------------------------------------------------------
    def _diagonal(self, size: float) -> float:
        """From the middle of a block of `size` pixels to its farthest sample, scene units."""
        return math.hypot(self.frame[2], self.frame[3]) * size / 2 if size > 1 else 0.0

    def _at(self, yx: np.ndarray, z: np.ndarray) -> np.ndarray:
        """The field at lattice positions [n, 2]."""
        x0, y0, dx, dy = self.frame
        return _whole(self.kernel.points(x0 + dx * yx[:, 1], y0 + dy * yx[:, 0], z), dx)

    def _field(self, tiles: Tiles, z: np.ndarray, points: np.ndarray, *beside: np.ndarray) -> np.ndarray:
        """The field at samples 64 * tile + bit, or beside them by so many pixels in x and y."""
        xyz = np.empty((3, len(points)), self.kernel.dtype)
        t.coordinates(points, tiles.place, self.frame, z, *xyz)
        for axis, by in enumerate(beside):
            xyz[axis] += (by * self.frame[2 + axis]).astype(xyz.dtype)
        return _whole(self.kernel.points(*xyz), self.frame[2])


_QUARTERS = np.array([[(0, 0), (0, 1), (1, 0), (1, 1)]])


def _whole(f: np.ndarray, outside: float) -> np.ndarray:
    """Values without NaN, which counts as outside."""
    if len(f) and np.isnan(f.max()):
        np.nan_to_num(f, copy=False, nan=outside)
    return f
