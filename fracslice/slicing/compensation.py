"""Compensation: outlines moved outwards or inwards. Importing Numba for it takes as long as a small job."""

from __future__ import annotations

import math

import numpy as np

from ..common.compiled import compiled


def compensate(image: np.ndarray, by: float, pixel: tuple[float, float]) -> np.ndarray:
    """Move the outlines of a coverage image outwards.

    A pixel's coverage is taken as its distance to the outline, in pixels, and grows with that distance: grey
    dilation with a cone. Exact for outlines along an axis, within a fifth of a pixel for all others.

    `image`: uint8 [ny, nx]; `by` in mm; `pixel`: width and height of a pixel, mm. Returns uint8 [ny, nx].
    """
    unit = math.sqrt(pixel[0] * pixel[1])
    amount, reach = abs(by) / unit, math.ceil(abs(by) / min(pixel)) + 1
    dy, dx = np.mgrid[-reach : reach + 1, -reach : reach + 1]
    cone = 255 * (amount - np.hypot(dy * pixel[1], dx * pixel[0]) / unit)
    grown = np.empty_like(image)
    _dilate(image if by > 0 else 255 - image, cone, grown)
    return grown if by > 0 else 255 - grown


@compiled
def _dilate(image, cone, out):  # type: ignore[no-untyped-def]
    """Dilate an image with a cone."""
    ny, nx = image.shape
    reach = cone.shape[0] // 2
    out[:] = image
    for y in range(ny):
        for x in range(nx):
            a = image[y, x]
            if a == 0:
                continue
            beside = image[max(y - 1, 0) : y + 2, max(x - 1, 0) : x + 2]
            if beside.size == 9 and beside.min() == 255:
                continue
            for v in range(max(y - reach, 0), min(y + reach + 1, ny)):
                for u in range(max(x - reach, 0), min(x + reach + 1, nx)):
                    new = min(a + cone[v - y + reach, u - x + reach], 255.0)
                    if new > out[v, u]:
                        out[v, u] = np.uint8(new + 0.5)
