"""Projection of vertices that lie on no grid edge to the surface, each within its own trust region."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..kernel import Field
from ..work import Work, chunks
from .roots import Roots

NEAR, CONVERGED = 1e-9, 1e-8
"""Values of |f| in voxels: below `NEAR` a point needs no projection (a corner has no gradient to follow); a
projected point should be below `FOUND`.
"""


@dataclass(frozen=True, eq=False)
class TrustRegions:
    """Boxes that points must not leave.

    Attributes
    ----------
    low, high
        Corners of the boxes, float64 [3, n], scene units; a box may be flat.
    other
        Points in the boxes or on their boundaries where the field has the opposite sign, [3, n], or None.
    middle
        Points in the boxes in the middle of the known part of the surface there, [3, n], or None.
    """

    low: np.ndarray
    high: np.ndarray
    other: np.ndarray | None = None
    middle: np.ndarray | None = None


def project(
    root: Field,
    points: np.ndarray,
    trust_regions: Callable[[np.ndarray, np.ndarray], TrustRegions],
    voxel: float,
    work: Work | None = None,
) -> None:
    """Project points, in place, to the zero set within their trust regions.

    A point moves along the gradient if the field changes its sign there within four Newton steps and the box,
    else straight towards the point of opposite sign of its trust region. Where the field is smooth nearby, it
    moves straight towards the middle if the surface lies between. A point that would come no nearer stays, as
    does a point already on the surface, such as an exact corner.

    Parameters
    ----------
    root
        Field.
    points
        Points, float64 [n, 3], scene units.
    trust_regions
        Function of point numbers and of a mask of the interior ones, returns their trust regions. It may
        read these points, not others.
    voxel
        Voxel size, scene units.
    work
        Execution settings.

    Raises
    ------
    Cancelled
        If the job was cancelled; some points are moved then.
    """
    work = work or Work()
    kernel = root.kernel(work.device, "float64")
    guess, exact = (Roots(root, precision, voxel, work.device) for precision in ("float32", "float64"))

    def task(part: slice) -> None:
        values = kernel.points(*points[part].T)
        away = np.flatnonzero(np.abs(values) > NEAR * voxel)
        if len(away):
            own = guess.padded(away)
            points[part.start + away] = brought(part.start + own, values[own])[:, : len(away)].T

    def brought(which: np.ndarray, f: np.ndarray) -> np.ndarray:
        p, region = np.ascontiguousarray(points[which].T), trust_regions(which, f < 0)
        rays = np.concatenate([p, guess.lead(_relative(p, region))])
        t, miss = exact.aimed(rays, guess.find(rays.astype(np.float32)))
        left = np.flatnonzero(miss > CONVERGED)
        if len(left):
            left = exact.padded(left)
            slow = rays.take(left, 1)
            t[left], miss[left] = exact.aimed(slow, exact.find(slow))
        there = np.clip(p + t * rays[3:], region.low, region.high)
        return np.where(miss * voxel < np.abs(f), there, p)

    work.map(task, chunks(len(points), kernel.batch >> 3))


def anywhere(which: np.ndarray, inside: np.ndarray) -> TrustRegions:
    """Return unbounded trust regions.

    Parameters
    ----------
    which
        Point numbers, [n].
    inside
        Mask of the interior points, [n]; not used.

    Returns
    -------
    TrustRegions
        Infinite boxes.
    """
    return TrustRegions(np.full((3, len(which)), -np.inf), np.full((3, len(which)), np.inf))


def _relative(p: np.ndarray, region: TrustRegions) -> np.ndarray:
    """Argument of `Roots.lead`: positions relative to the points, since float32 resolves distances better
    than positions.
    """
    rows = np.empty((15, p.shape[1]), np.float32)
    rows[:3], rows[3:6], rows[6:9] = p, p - region.low, region.high - p
    rows[9:12] = np.nan if region.other is None else region.other - p
    rows[12:] = np.nan if region.middle is None else region.middle - p
    return rows
