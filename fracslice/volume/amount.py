"""Volume of an object estimated from its field, and the sample spacing that resolves it."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from ..fields.algebra import length
from ..fields.box import possible_cells
from ..fields.field import Bounds, Field, Kernel
from ..formulas import Box, Node
from ..records import DUST
from ..work import Work, chunks
from .lattice import values_at

POINTS = 1 << 18
"""Random points in all boxes."""

CELLS = 1 << 16
"""Largest number of cells in all boxes."""

MOST_EACH = 64
"""Largest number of random points per cell."""

AT_ONCE = 1 << 14
"""Approximate number of random points evaluated together."""

TOLERANCE = 0.01
"""Tolerated volume error of the samples, as a fraction of the object's volume."""

SURE = 3.0
"""Standard errors by which a difference is significant."""

SEEN = 1 << 11
"""Interior points tested to choose a sample spacing."""

FINER = 2, 4, 8, 16, 32
"""Refinement factors to choose from."""

SCATTERED = 0.5
"""Fraction of the points of an element without samples beside them from which it is lost."""

PARTS = 32
"""Largest number of elements that are looked for one by one."""

FEWEST, EACH = 8, 64
"""Number of interior points of an element below which it has random points of its own, and number tested."""

MARGIN = 1.5
"""Required ratio of wall thickness to sample spacing: below it, a slanted wall is sampled only here and
there.
"""


@dataclass(frozen=True, eq=False)
class VolumeEstimate:
    """Monte Carlo estimate of an object's volume."""

    volume: float  # volume, scene units^3
    error: float  # standard error of the volume, scene units^3
    # random points inside the object, float64 [3, n], scene units, in cells that are not proven full
    inside: np.ndarray

    def off(self, made: float) -> float:
        """Return the relative error of a reproduced volume.

        `made`: scene units^3.
        """
        sure = abs(made - self.volume) > max(SURE * self.error, TOLERANCE * self.volume)
        return made / self.volume - 1 if sure and self.volume else 0.0

    def some(self, count: int = SEEN) -> np.ndarray:
        """Interior points drawn at random, always the same ones, with repetitions, float64 [3, count]."""
        return self.inside[:, np.random.default_rng(1).integers(self.inside.shape[1], size=count)]


def amount(root: Field, boxes: list[Box], work: Work | None = None) -> VolumeEstimate:
    """Estimate the volume inside disjoint boxes by stratified random points with a fixed seed.

    Cells that are proven empty are skipped. Cells that are proven full are counted whole, where the field
    bounds distances inside too (Cochran 1977, "Sampling Techniques", chapter 5).

    `boxes` in scene units.
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
    """Estimate the volume inside one of `boxes` boxes."""
    cells, values, step = possible_cells(
        lambda p: values_at(conservative, p, work), bounds.lipschitz, box, CELLS // boxes
    )
    full = (values < -bounds.lipschitz * length(step) / 2) & (not bounds.exterior_only)
    cells, whole = cells[:, ~full], int(full.sum())
    each = min(max(POINTS // boxes // max(cells.shape[1], 1), 2), MOST_EACH)
    count, cell = cells.shape[1], float(step.prod())
    share = np.empty(count)

    def task(part: slice) -> np.ndarray:
        points = np.empty((3, part.stop - part.start, each))
        for axis, row in enumerate(points):  # numbers of one sequence, for any division of the cells
            numbers = np.random.Generator(np.random.PCG64(0).advance((axis * count + part.start) * each))
            row[:] = cells[axis, part, None] + step[axis] * numbers.uniform(-0.5, 0.5, row.shape)
        inside = kernel.points(*points) < 0
        share[part] = inside.mean(axis=1)
        return points[:, inside]

    pieces = work.collect(task, chunks(count, max(AT_ONCE // each, 1)))
    error = math.sqrt(float((share * (1 - share)).sum()) / (each - 1))
    inside = np.concatenate([np.empty((3, 0)), *pieces], axis=1)
    return VolumeEstimate(cell * (whole + float(share.sum())), cell * error, inside)


def finer(
    root: Field,
    estimate: VolumeEstimate,
    off: float,
    origin: tuple[float, float, float],
    spacing: tuple[float, float, float],
    work: Work | None = None,
) -> int | None:
    """Return the refinement factor of the samples that brings the volume error below the tolerance.

    The missing volume is proportional to the fraction of interior points whose eight surrounding samples are
    all outside. If that fraction is small, the error comes from faceting and is proportional to the square of
    the spacing.

    `origin`, `spacing` in scene units.
    """
    points = estimate.some()

    def lost(times: float) -> float:
        return lost_share(root, points, origin, spacing, times, work)

    now = lost(1)
    if now < abs(off) / 4:
        return next((times for times in FINER if abs(off) < TOLERANCE * times**2), None)
    return next((times for times in FINER if lost(times / MARGIN) * abs(off) < TOLERANCE * now), None)


def lost_share(
    root: Field,
    points: np.ndarray,
    origin: tuple[float, float, float],
    spacing: tuple[float, float, float],
    times: float = 1.0,
    work: Work | None = None,
) -> float:
    """Return the fraction of interior points whose eight surrounding samples are all outside.

    `points`: float64 [3, n], scene units.
    """
    step = np.array(spacing)[:, None, None] / times
    start = np.array(origin)[:, None, None]
    corners = np.indices((2, 2, 2)).reshape(3, 1, 8)
    samples = start + step * (np.floor((points[:, :, None] - start) / step) + corners)
    outside = values_at(root.kernel(), samples.reshape(3, -1), work or Work()) >= 0
    return float(outside.reshape(-1, 8).all(axis=1).mean())


def scattered(
    root: Field,
    estimate: VolumeEstimate,
    origin: tuple[float, float, float],
    spacing: tuple[float, float, float],
    work: Work | None = None,
) -> list[tuple[Node, np.ndarray, float]]:
    """Find the elements of a scene of several that samples miss: at most of their points.

    Returns float64 [3, n], scene units.
    """
    found = []
    for part in parts(root.tree) if root.tree else ():
        low, high = (np.array(corner)[:, None] for corner in (part.bounds.box.lo, part.bounds.box.hi))
        near = estimate.inside[:, ((estimate.inside >= low) & (estimate.inside <= high)).all(axis=0)]
        own = replace(estimate, inside=near[:, values_at(part.kernel(), near, work or Work()) < 0])
        if own.inside.shape[1] < FEWEST:
            own = amount(part, [part.bounds.box], work)
            if own.volume < DUST * estimate.volume or not own.inside.size:
                continue
        points = own.some(EACH)
        if (missed := lost_share(root, points, origin, spacing, 1.0, work)) >= SCATTERED:
            found.append((part, points, missed))
    return found


def parts(node: Node) -> list[Node]:
    """Elements of sharp unions, if they are at most `PARTS`."""
    if node.formula.name != "union" or node["smooth"]:
        return []
    children = [part for child in node.fields for part in parts(child) or [child]]
    return children if len(children) <= PARTS else []


SMALLEST_CAVITY = 27
"""Cells of the smallest cavity; smaller ones are noise of the grid."""


def count_sealed(root: Field, outer: Box, cell: float, work: Work) -> tuple[int, float]:
    """Count the components of the empty space that no outside cell reaches.

    `outer`, `cell` in scene units. Returns cubed scene units.
    """
    from scipy.ndimage import label

    counts = [int(np.ceil(side / cell)) for side in outer.size]
    x, y, z = (low + cell * (np.arange(n) + 0.5) for low, n in zip(outer.lo, counts, strict=True))
    kernel, empty = root.kernel(), np.ones([n + 2 for n in counts], bool)
    yy, zz = np.meshgrid(y, z, indexing="ij")
    for i, at in enumerate(x.tolist()):
        work.check()
        empty[i + 1, 1:-1, 1:-1] = kernel.points(np.full_like(yy, at), yy, zz) >= 0
    sizes = np.bincount(label(empty)[0].ravel())
    sizes = sizes[2:]  # after the solid and the outside
    kept = sizes[sizes >= SMALLEST_CAVITY]
    return len(kept), float(kept.sum()) * cell**3
