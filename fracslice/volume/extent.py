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
"""Cells of the last level; a flat face has ever more of them."""

STARTS = 16
STEPS = 256
EXACT = 1e-6
"""Of the longest side: the last step that the outermost points known take outwards."""


@dataclass(frozen=True)
class Extent:
    """The object's box, as near as it was found, and a box that surely encloses it."""

    box: Box
    outer: Box


def extent(kernel: Kernel, facts: Facts, work: Work | None = None) -> Extent:
    """The box of the points where the field is negative: smooth faces and edges to 1e-6 of the longest side,
    the tips of a fractal to 1/4000 or better.

    Cells that cannot be inside (``f > L * half diagonal``), or that do not reach beyond an inside point known
    already, are dropped; the rest are cut in eight. Then the surface is climbed from the outermost inside
    points. The box that the formulas promise is doubled as long as the object reaches its border (an offset
    or smooth union of a field that underestimates distances can).
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
    lo, hi, starts = np.full(3, np.inf), np.full(3, -np.inf), np.empty((4, 0))
    offsets = np.array(np.meshgrid(*[(-0.25, 0.25)] * 3)).reshape(3, 1, 8)
    for level in range(LEVELS):
        f = values_at(kernel, centres, work)
        inside = f < 0
        if level == 0 and (inside & rim).any():
            return None
        if inside.any():
            lo, hi = np.minimum(lo, centres[:, inside].min(1)), np.maximum(hi, centres[:, inside].max(1))
            starts = _outermost(np.column_stack([starts, [*centres[:, inside], f[inside]]]))
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
    reach = _climbed(kernel, starts, float(step.max()), work)
    lo, hi = np.minimum(lo, -reach[0]), np.maximum(hi, reach[1])
    return Extent(_box(lo, hi), _box(np.minimum(outer_lo, lo), np.maximum(outer_hi, hi)))


def _outermost(found: np.ndarray) -> np.ndarray:
    """Of points and their values [4, n] those from which the surface is farthest out along an axis, if values
    are distances; `STARTS` for each side of each axis.
    """
    reach = np.concatenate([found[:3] + found[3], -found[:3] + found[3]])
    order = np.argsort(reach, axis=1, kind="stable")[:, :STARTS]
    chosen: np.ndarray = found[:, np.unique(order)]
    return chosen


def _climbed(kernel: Kernel, starts: np.ndarray, first: float, work: Work) -> np.ndarray:
    """How far the object reaches along each axis, downwards and upwards: [2, 3].

    starts: inside points and their values [4, n]. From those nearest to a side steps outwards, straight or
    aslant, are taken as long as they end inside, `first` long at first, then shorter ones (pattern search:
    Hooke and Jeeves 1961). All sides at once.
    """
    exact = EXACT * float(np.ptp(starts[:3], axis=1).max())
    slants = 0.1 ** np.arange(0, 3.5, 0.5)
    aslant = np.stack(np.meshgrid((-1, 0, 1), (-1, 0, 1), slants)).reshape(3, -1)
    # [side, coordinate, way], and [side, coordinate, point, way]
    ways = np.stack([side * np.roll(aslant, axis - 2, 0) for side in (-1, 1) for axis in range(3)])
    outwards = np.concatenate([-starts[:3], starts[:3]])
    order = np.argsort(starts[3] - outwards, axis=1, kind="stable")[:, :STARTS]
    here = np.moveaxis(starts[:3, order], 0, 1)[..., None]
    step = np.full((6, 1, 1, 1), first)
    for _ in range(STEPS):
        tried = here + step * ways[:, :, None, :]
        points = np.moveaxis(tried, 1, 0)
        inside = values_at(kernel, points.reshape(3, -1), work).reshape(points.shape[1:]) < 0
        gain = np.where(inside, aslant[2], 0.0)[:, None]
        best = gain.argmax(3, keepdims=True)
        here = np.where(gain.max(3, keepdims=True) > 0, np.take_along_axis(tried, best, 3), here)
        stuck = ~gain.any((2, 3), keepdims=True)
        if (stuck & (step < exact)).all():
            break
        step[stuck & (step >= exact)] /= 2
    # The face lies between that point and the next one, half a step on average.
    ahead = np.stack([here[side, side % 3, :, 0] for side in range(6)]).reshape(2, 3, -1)
    reach: np.ndarray = (ahead * [[[-1]], [[1]]]).max(2) + step.reshape(2, 3) / 2
    return reach


def _box(lo: np.ndarray, hi: np.ndarray) -> Box:
    return Box(tuple(lo.tolist()), tuple(hi.tolist()))
