"""Layers as runs of solid or empty pixels: parts, and what lies over what, in time linear in the outline."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..compiled import compiled
from ..disjoint import find, unite

THRESHOLD = 128
"""The coverage from which a pixel is solid."""


@dataclass(frozen=True, eq=False)
class Parts:
    """The connected parts of one layer, solid ones or empty ones.

    rows: int32 [ny + 1], the runs of row y are ``rows[y]:rows[y + 1]``. begin, end: int32 [r], the pixels
    of each run, end excluded. part: int32 [r], the part of each run. area: int64 [m] in pixels. middle:
    float64 [m, 2], (x, y) in pixels. open: bool [m], whether the part reaches the border of the window.
    """

    rows: np.ndarray
    begin: np.ndarray
    end: np.ndarray
    part: np.ndarray
    area: np.ndarray
    middle: np.ndarray
    open: np.ndarray

    def __len__(self) -> int:
        return len(self.area)


def parts_of(image: np.ndarray) -> tuple[Parts, Parts]:
    """The solid parts, pixels that touch at a corner connected, and the empty ones, by sides only; uint8
    [ny, nx].
    """
    ny, nx = image.shape
    rows = np.zeros(ny + 1, np.int32)
    count = _solid_runs(image, rows, np.empty(0, np.int32), np.empty(0, np.int32))
    begin, end = np.empty(count, np.int32), np.empty(count, np.int32)
    _solid_runs(image, rows, begin, end)
    gaps = np.zeros(ny + 1, np.int32)
    gap_begin, gap_end = np.empty(count + ny, np.int32), np.empty(count + ny, np.int32)
    between = _gaps(rows, begin, end, nx, gaps, gap_begin, gap_end)
    return _labelled(rows, begin, end, nx, 1), _labelled(gaps, gap_begin[:between], gap_end[:between], nx, 0)


def _labelled(rows: np.ndarray, begin: np.ndarray, end: np.ndarray, nx: int, reach: int) -> Parts:
    part = np.empty(len(begin), np.int32)
    count = _label(rows, begin, end, reach, part)
    row = np.repeat(np.arange(len(rows) - 1), np.diff(rows))
    length = end - begin
    area = np.bincount(part, length, count).astype(np.int64)
    x, y = (np.bincount(part, length * at, count) for at in ((begin + end) / 2, row + 0.5))
    rim = (begin == 0) | (end == nx) | (row == 0) | (row == len(rows) - 2)
    opened = np.zeros(count, bool)
    opened[part[rim]] = True
    return Parts(rows, begin, end, part, area, np.stack([x, y], 1) / np.maximum(area, 1)[:, None], opened)


@compiled
def _solid_runs(image, rows, begin, end):  # type: ignore[no-untyped-def]
    n = 0
    for y in range(image.shape[0]):
        inside = False
        for x in range(image.shape[1]):
            if (image[y, x] >= THRESHOLD) != inside:
                if n < len(begin):
                    if inside:
                        end[n] = x
                    else:
                        begin[n] = x
                n += inside
                inside = not inside
        if inside:
            if n < len(begin):
                end[n] = image.shape[1]
            n += 1
        rows[y + 1] = n
    return n


@compiled
def _gaps(rows, begin, end, nx, gaps, gap_begin, gap_end):  # type: ignore[no-untyped-def]
    n = 0
    for y in range(len(rows) - 1):
        x = 0
        for r in range(rows[y], rows[y + 1]):
            if begin[r] > x:
                gap_begin[n], gap_end[n] = x, begin[r]
                n += 1
            x = end[r]
        if x < nx:
            gap_begin[n], gap_end[n] = x, nx
            n += 1
        gaps[y + 1] = n
    return n


@compiled
def _label(rows, begin, end, reach, part):  # type: ignore[no-untyped-def]
    parent = np.arange(len(begin))
    for y in range(1, len(rows) - 1):
        a, b = rows[y - 1], rows[y]
        while a < rows[y] and b < rows[y + 1]:
            if begin[a] < end[b] + reach and begin[b] < end[a] + reach:
                unite(parent, a, b)
            if end[a] < end[b]:
                a += 1
            else:
                b += 1
    count = 0
    for r in range(len(begin)):
        if parent[r] == r:
            part[r] = count
            count += 1
        else:
            part[r] = part[find(parent, r)]
    return count


def overlaps(below: Parts, above: Parts) -> np.ndarray:
    """Pairs of parts of two layers that share a pixel, int32 [n, 2] (below, above), in order, each once."""
    pairs = np.empty((len(below.begin) + len(above.begin), 2), np.int32)
    count = _overlaps(
        below.rows, below.begin, below.end, below.part, above.rows, above.begin, above.end, above.part, pairs
    )
    return np.unique(pairs[:count], axis=0)


@compiled
def _overlaps(rows_a, begin_a, end_a, part_a, rows_b, begin_b, end_b, part_b, pairs):  # type: ignore[no-untyped-def]
    n = 0
    for y in range(len(rows_a) - 1):
        a, b = rows_a[y], rows_b[y]
        while a < rows_a[y + 1] and b < rows_b[y + 1]:
            if begin_a[a] < end_b[b] and begin_b[b] < end_a[a]:
                pairs[n, 0], pairs[n, 1] = part_a[a], part_b[b]
                n += 1
            if end_a[a] < end_b[b]:
                a += 1
            else:
                b += 1
    return n


def unsupported(below: Parts, above: Parts, reach: float, width: int) -> int:
    """Solid pixels of a layer that are farther than `reach` pixels from all solid ones of the layer below."""
    return int(
        _unsupported(below.rows, below.begin, below.end, above.rows, above.begin, above.end, reach, width)
    )


@compiled
def _unsupported(rows_a, begin_a, end_a, rows_b, begin_b, end_b, reach, width):  # type: ignore[no-untyped-def]
    held = np.zeros(width + 1, np.int32)
    total, far = 0, int(np.floor(reach))
    for y in range(len(rows_b) - 1):
        if rows_b[y] == rows_b[y + 1]:
            continue
        held[:] = 0
        for v in range(max(y - far, 0), min(y + far, len(rows_a) - 2) + 1):
            side = int(np.floor(np.sqrt(reach * reach - (v - y) ** 2)))
            for r in range(rows_a[v], rows_a[v + 1]):
                held[max(begin_a[r] - side, 0)] += 1
                held[min(end_a[r] + side, width)] -= 1
        level, r = 0, rows_b[y]
        for x in range(width):
            level += held[x]
            while r < rows_b[y + 1] and end_b[r] <= x:
                r += 1
            if r == rows_b[y + 1]:
                break
            if level == 0 and begin_b[r] <= x:
                total += 1
    return total
