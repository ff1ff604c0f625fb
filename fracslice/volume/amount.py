"""How much of an object there is, by its field alone, and how fine samples have to be to show it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from ..formulas import Box
from ..formulas.algebra import length
from ..formulas.field import Bounds
from ..kernel import Field, Kernel
from ..kernel.cells import possible_cells
from ..work import Work
from .values import values_at

POINTS = 1 << 18
CELLS = 1 << 16
MOST_EACH = 64
"""Points in a cell."""

TOLERANCE = 0.01
"""The share of an object's volume that samples may lack, or add."""

SURE = 3.0
"""Standard errors that a difference must have."""

SEEN = 1 << 11
"""Inside points that are looked at for how fine samples must be."""

FINER = 2, 4, 8, 16, 32
MARGIN = 1.5
"""How much thicker than the spacing a wall should be: before, a slanted one has a sample here and there."""


@dataclass(frozen=True, eq=False)
class VolumeEstimate:
    """An object's volume and its standard error, scene units^3. inside: the points [3, n] that were inside of
    it, in cells that are not wholly.
    """

    volume: float
    error: float
    inside: np.ndarray

    def off(self, made: float) -> float:
        """The share of the volume that what was made of it has more, or, negative, lacks; 0 where that is
        within the tolerance, or not sure.
        """
        sure = abs(made - self.volume) > max(SURE * self.error, TOLERANCE * self.volume)
        return made / self.volume - 1 if sure and self.volume else 0.0


def amount(root: Field, boxes: list[Box], work: Work | None = None) -> VolumeEstimate:
    """The volume of what is inside boxes that do not overlap: stratified random points, always the same.

    Of each box the cells that are proven empty are left out, and where the field bounds distances inside,
    too, those that are proven full are counted (Cochran 1977, "Sampling Techniques", chapter 5). Raises
    `Cancelled`.
    """
    work, conservative = work or Work(), root.conservative()
    kernel, bound = root.kernel(), conservative.kernel()
    parts = [_part(kernel, bound, conservative.bounds, box, len(boxes), work) for box in boxes]
    return VolumeEstimate(
        sum(part.volume for part in parts),
        math.hypot(*(part.error for part in parts)),
        np.concatenate([part.inside for part in parts], axis=1),
    )


def _part(
    kernel: Kernel, conservative: Kernel, bounds: Bounds, box: Box, boxes: int, work: Work
) -> VolumeEstimate:
    """One box' share."""
    cells, values, step = possible_cells(
        lambda p: values_at(conservative, p, work), bounds.lipschitz, box, CELLS // boxes
    )
    full = (values < -bounds.lipschitz * length(step) / 2) & (not bounds.exterior_only)
    cells, whole = cells[:, ~full], int(full.sum())
    each = min(max(POINTS // boxes // max(cells.shape[1], 1), 2), MOST_EACH)
    rng = np.random.default_rng(0)
    points = cells[:, :, None] + step[:, None, None] * rng.uniform(-0.5, 0.5, (*cells.shape, each))
    inside = (values_at(kernel, points.reshape(3, -1), work) < 0).reshape(-1, each)
    share, room = inside.mean(axis=1), float(step.prod())
    error = math.sqrt(float((share * (1 - share)).sum()) / (each - 1))
    return VolumeEstimate(room * (whole + float(share.sum())), room * error, points[:, inside])


def finer(
    root: Field,
    found: VolumeEstimate,
    off: float,
    origin: tuple[float, float, float],
    spacing: tuple[float, float, float],
    work: Work | None = None,
) -> int | None:
    """How many times nearer samples should be, for them to lack less than the tolerance; None if more often
    than they can be.

    off: the share of the volume that is wrong. origin, spacing: of the samples, scene units. What is lost is
    in proportion to the inside points between eight outside samples; if there are hardly any, it is by
    facets, as the square of the spacing.
    """
    kernel, rng = root.kernel(), np.random.default_rng(1)
    points = found.inside[:, rng.integers(found.inside.shape[1], size=SEEN)]

    def lost(times: float) -> float:
        step = np.array(spacing)[:, None, None] / times
        start = np.array(origin)[:, None, None]
        corners = np.indices((2, 2, 2)).reshape(3, 1, 8)
        samples = start + step * (np.floor((points[:, :, None] - start) / step) + corners)
        outside = values_at(kernel, samples.reshape(3, -1), work or Work()) >= 0
        return float(outside.reshape(-1, 8).all(axis=1).mean())

    now = lost(1)
    if now < abs(off) / 4:
        return next((times for times in FINER if abs(off) < TOLERANCE * times**2), None)
    return next((times for times in FINER if lost(times / MARGIN) * abs(off) < TOLERANCE * now), None)
