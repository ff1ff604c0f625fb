"""How large the object itself is: branch and bound on the field."""

from __future__ import annotations

import numpy as np

from ..errors import VolumeError
from ..formulas.box import Box
from ..formulas.registry import Facts
from ..kernel import CpuKernel
from ..work import Work, chunks

FIRST = 16
"""Cells along each axis of the first level; the outermost lie beyond the box that the formulas promise."""

LEVELS = 9
GROWTHS = 6
WIDEST = 2000
"""Cells that are kept per direction and level. A flat face has more, and any of them will do."""


def extent(kernel: CpuKernel, facts: Facts, work: Work | None = None) -> Box:
    """The box of the points where the field is negative, its faces to about 1/5000 of the longest side.

    Cells that cannot be inside (``f > L * half diagonal``), or that do not reach beyond an inside point known already, are
    dropped; of too many, those that may reach furthest are kept; they are cut in eight. The box that the formulas promise is doubled as long as the object reaches its
    border (an offset or smooth union of a field that underestimates distances can). Raises `VolumeError` if nothing is
    inside, or the object has no end.
    """
    box = facts.box
    if box.empty:
        raise VolumeError("the scene is empty: its elements have no point in common")
    if not box.finite:
        axes = [a for a, s in zip("xyz", box.size, strict=True) if not np.isfinite(s)]
        raise VolumeError(f"the scene has no end along {' and '.join(axes)}; put <bounds> around it")
    for _ in range(GROWTHS):
        found, at_border = _search(kernel, facts, box, work or Work())
        if not at_border:
            return found
        box = box.grown(max(box.size) / 2)
    raise VolumeError("the object has no end that could be found; put <bounds> around it")


def _search(kernel: CpuKernel, facts: Facts, box: Box, work: Work) -> tuple[Box, bool]:
    """The object's box within `box`, and whether it reaches into the cells on the border."""
    longest = max(box.size) or 1.0
    half = np.maximum(np.array(box.size), longest * 1e-3) / 2 * FIRST / (FIRST - 2)
    step = 2 * half / FIRST
    cells = np.indices((FIRST,) * 3).reshape(3, -1)
    centres = np.array(box.centre)[:, None] - half[:, None] + step[:, None] * (cells + 0.5)
    rim = ((cells == 0) | (cells == FIRST - 1)).any(0)
    lo, hi = np.full(3, np.inf), np.full(3, -np.inf)
    offsets = np.array(np.meshgrid(*[(-0.25, 0.25)] * 3)).reshape(3, 1, 8)
    for level in range(LEVELS):
        f = _values(kernel, centres, work)
        inside = f < 0
        if level == 0 and (inside & rim).any():
            return box, True
        if inside.any():
            lo, hi = np.minimum(lo, centres[:, inside].min(1)), np.maximum(hi, centres[:, inside].max(1))
        possible = ~(f > facts.lipschitz * np.linalg.norm(step) / 2)
        centres = centres[:, possible & _furthest(centres, np.where(possible, f, np.inf), step, lo, hi)]
        if level < LEVELS - 1:
            centres = (centres[:, :, None] + offsets * step[:, None, None]).reshape(3, -1)
            step = step / 2
    if not (lo <= hi).all():
        raise VolumeError("there is no surface: nothing in the scene is inside")
    # The true face lies between the outermost inside point and half a cell beyond.
    return Box(tuple((lo - step / 4).tolist()), tuple((hi + step / 4).tolist())), False


def _furthest(centres: np.ndarray, f: np.ndarray, step: np.ndarray, lo: np.ndarray, hi: np.ndarray) -> np.ndarray:
    """The cells that may hold the outermost point in one of the six directions."""
    kept = np.zeros(len(f), bool)
    for axis in range(3):
        for sign, best in ((1, hi[axis]), (-1, -lo[axis])):
            reach = sign * centres[axis] + step[axis] / 2
            rows = np.flatnonzero(reach > best)
            if len(rows) > WIDEST:
                score = reach[rows] - np.maximum(f[rows], 0)
                rows = rows[np.argpartition(-score, WIDEST)[:WIDEST]]
            kept[rows] = True
    return kept


def _values(kernel: CpuKernel, points: np.ndarray, work: Work) -> np.ndarray:
    f = np.empty(points.shape[1], kernel.dtype)

    def task(part: slice) -> None:
        f[part] = kernel.points(*points[:, part])

    work.map(task, chunks(len(f), 1 << 15))
    return f
