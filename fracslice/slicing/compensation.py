"""Compensation: outlines moved outwards or inwards."""

from __future__ import annotations

import math

import numpy as np

from .._slices import dilated


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
    grown = dilated(image if by > 0 else 255 - image, cone)
    return grown if by > 0 else 255 - grown
