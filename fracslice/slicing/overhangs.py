"""Overhangs: parts of a layer with nothing below them, and how far they reach from what holds them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..common.compiled import compiled
from .runs import Runs
from .thickness import count_pixels

COARSE = 8
"""Coarse pixels along the longest allowed overhang, on which most layers are seen to have none."""

FINEST = 1024
"""Pixels along the longer side of the picture on which a large overhang is measured."""

DIRECTIONS = ((0, 1), (1, 0), (1, 1), (1, -1))
"""Steps along rows, columns and both diagonals, pixels."""


@dataclass(frozen=True)
class Overhang:
    """The farthest overhang of a layer.

    Attributes
    ----------
    layer : int
        Its layer.
    reach : float
        Largest distance from the supported part of the layer, mm.
    area : float
        Area of the layer that reaches too far, mm^2.
    at : tuple of float
        Its farthest point, mm from the middle of the object.
    """

    layer: int
    reach: float
    area: float
    at: tuple[float, float]


def unsupported(below: Runs, above: Runs, reach: float) -> Runs:
    """Pixels of a layer that nothing supports.

    Parameters
    ----------
    below, above : Runs
        Solid pixels of the layers.
    reach : float
        Pixels within this distance of a solid pixel of the layer below are supported, pixels.
    """
    rows, count, size = np.zeros(len(above.rows), np.int32), len(above.begin), -1
    while count > size:  # most layers have fewer unsupported runs than runs
        size = count
        begin, end = np.empty((2, size), np.int32)
        solid = below.rows, below.begin, below.end, above.rows, above.begin, above.end
        count = _unsupported(*solid, reach, above.width, rows, begin, end)
    return Runs(rows, begin[:count], end[:count], above.width)


def farthest(
    solid: Runs, bare: Runs, layer: int, pixel: tuple[float, float], overhang: float, span: float
) -> Overhang | None:
    """Measure how far the unsupported pixels of a layer reach.

    A pixel on a straight line of solid pixels with support at both ends, a bridge, may be as long as `span`;
    any other, a cantilever, may reach `overhang` far. Components without any support are islands and not
    measured.

    Parameters
    ----------
    solid, bare : Runs
        Solid pixels of the layer, and the unsupported ones among them.
    layer : int
        Number of the layer.
    pixel : tuple of float
        Width and height of a pixel, mm.
    overhang : float
        Longest allowed cantilever, mm.
    span : float
        Longest allowed bridge, mm.

    Returns
    -------
    Overhang or None
        None if nothing reaches too far.
    """
    coarse = max(int(overhang / COARSE / max(pixel)), 1)
    fine = max(-(-max(solid.height, solid.width) // FINEST), 1)
    for times, slack in ((coarse, 2 * coarse * max(pixel)), (fine, 0.0)):
        far, away = _too_far(solid, bare, times, pixel, overhang - slack, span)
        if not far.any():
            return None
    step = np.array(pixel) * times
    y, x = np.unravel_index(np.argmax(np.where(far, away, 0)), far.shape)
    at = (np.array([x, y]) + 0.5) * step - np.array([solid.width, solid.height]) * pixel / 2
    return Overhang(layer, float(away[y, x]), float(far.sum() * step.prod()), (float(at[0]), float(at[1])))


def _too_far(
    solid: Runs, bare: Runs, times: int, pixel: tuple[float, float], overhang: float, span: float
) -> tuple[np.ndarray, np.ndarray]:
    """Mask of pixels `times` as large that reach too far, and the distance of all from support, mm."""
    from scipy.ndimage import distance_transform_edt, label

    shape = -(-solid.height // times), -(-solid.width // times)
    counts = np.zeros((2, *shape), np.int32)
    for runs, count in zip((solid, bare), counts, strict=True):
        count_pixels(runs.rows, runs.begin, runs.end, times, count)
    full, held = counts[0] > 0, counts[0] > counts[1]
    step = times * pixel[0], times * pixel[1]
    away = distance_transform_edt(~held, sampling=step[::-1])
    far = full & (away > overhang)
    if far.any():
        components, count = label(full, np.ones((3, 3)))
        has_support = np.zeros(count + 1, bool)
        has_support[components[held]] = True
        far &= has_support[components]
    for dy, dx in DIRECTIONS if far.any() else ():
        far &= ~(np.hypot(dy * step[1], dx * step[0]) * _span(full, held, dy, dx) <= span)
    return far, away


@compiled
def _span(solid, held, dy, dx):  # type: ignore[no-untyped-def]
    """Steps between the supported pixels on both sides of each pixel along a line of solid ones."""
    ny, nx = solid.shape
    span = np.zeros((ny, nx), np.float32)
    for sign in (1, -1):
        steps = np.full((ny, nx), np.inf, np.float32)
        for j in range(ny):
            y = j if sign > 0 else ny - 1 - j
            for i in range(nx):
                x = i if sign * (dx if dx else dy) > 0 else nx - 1 - i
                v, u = y - sign * dy, x - sign * dx
                if held[y, x]:
                    steps[y, x] = 0
                elif solid[y, x] and 0 <= v < ny and 0 <= u < nx:
                    steps[y, x] = steps[v, u] + 1
                span[y, x] += steps[y, x]
    return span


@compiled
def _unsupported(rows_a, begin_a, end_a, rows_b, begin_b, end_b, reach, width, rows, begin, end):  # type: ignore[no-untyped-def]
    """Write the runs of pixels farther than `reach` from all runs of the layer below; return their number,
    which may exceed the length of the arrays.
    """
    held = np.zeros(width + 1, np.int32)
    count, far = 0, int(np.floor(reach))
    for y in range(len(rows_b) - 1):
        if not _lies_on(rows_a, begin_a, end_a, rows_b, begin_b, end_b, y):
            held[:] = 0
            for v in range(max(y - far, 0), min(y + far, len(rows_a) - 2) + 1):
                side = int(np.floor(np.sqrt(reach * reach - (v - y) ** 2)))
                for r in range(rows_a[v], rows_a[v + 1]):
                    held[max(begin_a[r] - side, 0)] += 1
                    held[min(end_a[r] + side, width)] -= 1
            level, x = 0, 0
            for r in range(rows_b[y], rows_b[y + 1]):
                while x < begin_b[r]:
                    level += held[x]
                    x += 1
                since = -1
                while x < end_b[r]:
                    level += held[x]
                    if level == 0 and since < 0:
                        since = x
                    if since >= 0 and (level or x == end_b[r] - 1):
                        if count < len(begin):
                            begin[count], end[count] = since, x + (level == 0)
                        count, since = count + 1, -1
                    x += 1
        rows[y + 1] = count
    return count


@compiled
def _lies_on(rows_a, begin_a, end_a, rows_b, begin_b, end_b, y):  # type: ignore[no-untyped-def]
    """True if every run of a row lies on a run of the row below."""
    a = rows_a[y]
    for b in range(rows_b[y], rows_b[y + 1]):
        while a < rows_a[y + 1] and end_a[a] < end_b[b]:
            a += 1
        if a == rows_a[y + 1] or begin_a[a] > begin_b[b]:
            return False
    return True
