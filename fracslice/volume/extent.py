"""How large the object itself is: branch and bound on the field."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..errors import VolumeError
from ..formulas.box import Box
from ..formulas.registry import Facts
from ..kernel import Kernel
from ..work import Work
from .values import values_at

FIRST = 16
"""Cells along each axis of the first level; the outermost lie beyond the box that the formulas promise."""

LEVELS = 9
GROWTHS = 6
MOST = 1_000_000
"""Cells of the last level. A flat face has ever more of them; then its place is known a little less exactly.
"""


@dataclass(frozen=True)
class Extent:
    """The object's box, as near as it was found, and a box that surely encloses it."""

    box: Box
    outer: Box


def extent(kernel: Kernel, facts: Facts, work: Work | None = None) -> Extent:
    """The box of the points where the field is negative, its faces to about 1/4000 of the longest side; 1/500
    if flat.

    Cells that cannot be inside (``f > L * half diagonal``), or that do not reach beyond an inside point known
    already, are dropped; the rest are cut in eight. The box that the formulas promise is doubled as long as
    the object reaches its border (an offset or smooth union of a field that underestimates distances can).
    Raises `VolumeError` if nothing is inside, or the object has no end.
    """
    box = facts.box
    if box.empty:
        raise VolumeError("the scene is empty: its elements have no point in common")
    if not box.finite:
        axes = [a for a, s in zip("xyz", box.size, strict=True) if not np.isfinite(s)]
        raise VolumeError(f"the scene has no end along {' and '.join(axes)}; put <bounds> around it")
    for _ in range(GROWTHS):
        found = _search(kernel, facts, box, work or Work())
        if found:
            return found
        box = box.grown(max(box.size) / 2)
    raise VolumeError("the object has no end that could be found; put <bounds> around it")


def _search(kernel: Kernel, facts: Facts, box: Box, work: Work) -> Extent | None:
    """The object's extent within `box`; None if it reaches into the cells on the border."""
    longest = max(box.size) or 1.0
    half = np.maximum(np.array(box.size), longest * 1e-3) / 2 * FIRST / (FIRST - 2)
    step = 2 * half / FIRST
    cells = np.indices((FIRST,) * 3).reshape(3, -1)
    centres = np.array(box.centre)[:, None] - half[:, None] + step[:, None] * (cells + 0.5)
    rim = ((cells == 0) | (cells == FIRST - 1)).any(0)
    lo, hi = np.full(3, np.inf), np.full(3, -np.inf)
    offsets = np.array(np.meshgrid(*[(-0.25, 0.25)] * 3)).reshape(3, 1, 8)
    for level in range(LEVELS):
        f = values_at(kernel, centres, work)
        inside = f < 0
        if level == 0 and (inside & rim).any():
            return None
        if inside.any():
            lo, hi = np.minimum(lo, centres[:, inside].min(1)), np.maximum(hi, centres[:, inside].max(1))
        possible = ~(f > facts.lipschitz * np.linalg.norm(step) / 2)
        reach = step[:, None] / 2
        beyond = ((centres + reach > hi[:, None]) | (centres - reach < lo[:, None])).any(0)
        centres = centres[:, possible & beyond]
        if level == LEVELS - 1 or (8 * centres.shape[1] > MOST and level > 3):
            break
        centres = (centres[:, :, None] + offsets * step[:, None, None]).reshape(3, -1)
        step = step / 2
    if not (lo <= hi).all():
        raise VolumeError("there is no surface: nothing in the scene is inside")
    outer_lo = np.minimum(lo, centres.min(1, initial=np.inf)) - step / 2
    outer_hi = np.maximum(hi, centres.max(1, initial=-np.inf)) + step / 2
    # A face lies between the outermost inside centre and the next one, half a cell on average.
    return Extent(_box(lo - step / 2, hi + step / 2), _box(outer_lo, outer_hi))


def _box(lo: np.ndarray, hi: np.ndarray) -> Box:
    return Box(tuple(lo.tolist()), tuple(hi.tolist()))
