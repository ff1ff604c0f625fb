"""Thickness of walls and width of gaps in a layer."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..common.compiled import compiled
from ..printing.widths import BINS
from .runs import Runs

WIDE = float(BINS[-1])
"""mm; in layers with many pixels, greater widths are measured on coarser pixels."""

COARSE, LAYER = 4, 512
"""Minimum numbers of coarse pixels across `WIDE`, and along the layer."""

WINDOW = 1024
"""Approximate size of the windows that are measured at a time, without their halo, pixels."""

AROUND = 3
"""Halo in pixels, besides half of `WIDE`: wider than the stencil of a distance's slope."""

Pair = tuple[float, float]
Window = tuple[slice, slice]


def widths(solid: Runs, pixel: Pair) -> tuple[np.ndarray, np.ndarray]:
    """Measure walls and gaps on their medial axes.

    A width is twice the distance to the outline where that distance has no slope (Blum 1967, "A
    transformation for extracting new descriptors of shape"). Axes into right-angled corners are excluded:
    their slope is 0.7, and in the last pixel of a corner the distance is lower than beside it. The outline
    lies at half coverage, so widths are accurate to one pixel. In large layers, widths above `WIDE` are
    accurate to one coarse pixel: time and memory follow the outline, not the area.

    `solid`: solid pixels of a layer; `pixel`: width and height of a pixel, mm. Returns walls, gaps float64
    [n, 2], widths in mm, and the number of pixels of the medial axis at each.
    """
    if not len(solid.begin):
        return np.empty((0, 2)), np.empty((0, 2))
    times = max(int(min(WIDE / COARSE / max(pixel), max(solid.height, solid.width) / LAYER)), 1)
    count = np.zeros((-(-solid.height // times), -(-solid.width // times)), np.int32)
    count_pixels(solid.rows, solid.begin, solid.end, times, count)
    return _measure_widths(solid, count, times, pixel, False), _measure_widths(
        solid, count, times, pixel, True
    )


def _measure_widths(solid: Runs, count: np.ndarray, times: int, pixel: Pair, gaps: bool) -> np.ndarray:
    """Widths of walls or gaps. count: solid pixels in each coarse one, which is `times` pixels across."""
    coarse, narrow = (pixel[0] * times, pixel[1] * times), np.zeros(count.shape, np.bool_)
    if times > 1:
        # Whatever the tilt of a wall, a row or a column through it is at most this long.
        longest = np.ceil(2**0.5 * WIDE / np.array(pixel)).astype(np.int64)
        _narrow(solid.rows, solid.begin, solid.end, solid.width, gaps, times, longest, narrow)
    width, middle = _across((2 * np.pad(count, 2) >= times**2) != gaps, coarse)
    far = width[2:-2, 2:-2][middle[2:-2, 2:-2] & ~narrow]
    result = [np.column_stack([far, np.full(len(far), times)])]
    halo = int(np.ceil(WIDE / 2 / min(pixel))) + AROUND
    for rows, columns in _windows(narrow, max(WINDOW // times, 1)):
        chosen = narrow[rows, columns].repeat(times, 0).repeat(times, 1)
        image = np.zeros((chosen.shape[0] + 2 * halo, chosen.shape[1] + 2 * halo), np.bool_)
        top, left = times * rows.start - halo, times * columns.start - halo
        _paint(solid.rows, solid.begin, solid.end, top, left, image)
        width, middle = _across(image != gaps, pixel)
        near = width[halo:-halo, halo:-halo][middle[halo:-halo, halo:-halo] & chosen]
        result.append(np.column_stack([near, np.ones(len(near))]))
    return np.concatenate(result)


def _windows(chosen: np.ndarray, side: int) -> Iterator[Window]:
    """Windows of an image, at most `side` pixels along a side, that contain all chosen pixels."""
    for y in range(0, chosen.shape[0], side):
        for x in range(0, chosen.shape[1], side):
            rows, columns = np.nonzero(chosen[y : y + side, x : x + side])
            if len(rows):
                low, high = (y + int(rows[0]), x + int(columns.min())), (int(rows[-1]), int(columns.max()))
                yield slice(low[0], y + high[0] + 1), slice(low[1], x + high[1] + 1)


def _across(region: np.ndarray, pixel: Pair) -> tuple[np.ndarray, np.ndarray]:
    """Width of a region at each pixel of its medial axis, and a mask of these pixels."""
    from scipy.ndimage import distance_transform_edt, maximum_filter

    if region.all():
        return np.zeros(region.shape), np.zeros(region.shape, bool)
    unit = min(pixel)
    # The centre of the nearest pixel is half a pixel beyond the outline.
    distance = np.maximum(distance_transform_edt(region, sampling=pixel[::-1]) - unit / 2, 0)
    slope = np.hypot(*np.gradient(distance, *pixel[::-1]))
    middle = (slope < 0.6) & region & (distance > maximum_filter(distance, 3) - 0.4 * unit)
    # Where two pixels are next to the axis, the axis lies between them.
    return 2 * distance + unit * (slope > 0.25), middle


@compiled
def count_pixels(rows, begin, end, times, count):  # type: ignore[no-untyped-def]
    """Count the pixels of runs in each coarse pixel.

    `times`: pixels along each side of a coarse pixel; `count`: int32 [-(-height // times), -(-width //
    times)].
    """
    for y in range(len(rows) - 1):
        line = count[y // times]
        for r in range(rows[y], rows[y + 1]):
            first, last = begin[r] // times, (end[r] - 1) // times
            line[first : last + 1] += times
            line[first] -= begin[r] - first * times
            line[last] -= (last + 1) * times - end[r]


@compiled
def _narrow(rows, begin, end, width, gaps, times, longest, narrow):  # type: ignore[no-untyped-def]
    """Mark coarse pixels with a row or a column that is solid, or empty, for at most `longest` pixels."""
    since = np.full(width, -longest[1] - 1)  # row of the last change in each column
    for y in range(len(rows) - 1):
        first, last = rows[y], rows[y + 1]
        for r in range(first, last - gaps):
            low, high = (end[r], begin[r + 1]) if gaps else (begin[r], end[r])
            if high - low <= longest[0]:
                narrow[y // times, low // times : (high - 1) // times + 1] = True
        # Columns that change between the row below and this one, by the ends of the runs of both.
        a, b, x, changed = rows[y - 1] if y else first, first, 0, False
        at_a, at_b = False, False
        while True:
            to_a = width if a == first or y == 0 else (end[a] if at_a else begin[a])
            to_b = width if b == last else (end[b] if at_b else begin[b])
            to = min(to_a, to_b)
            if changed:
                for column in range(x, to):
                    if at_b == gaps and y - since[column] <= longest[1]:
                        narrow[since[column] // times : (y - 1) // times + 1, column // times] = True
                    since[column] = y
            if to == width:
                break
            if to_a == to:
                a, at_a = a + at_a, not at_a
            if to_b == to:
                b, at_b = b + at_b, not at_b
            x, changed = to, at_a != at_b


@compiled
def _paint(rows, begin, end, top, left, image):  # type: ignore[no-untyped-def]
    """Paint the runs of a layer that an image shows, from row `top` and column `left` on."""
    for y in range(max(-top, 0), min(image.shape[0], len(rows) - 1 - top)):
        for r in range(rows[top + y], rows[top + y + 1]):
            image[y, max(begin[r] - left, 0) : max(end[r] - left, 0)] = True
