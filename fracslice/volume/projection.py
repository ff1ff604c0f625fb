"""Vertices that lie on no grid edge are brought to the surface, each within a box of its own."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..kernel import Field
from ..work import Work, chunks
from .roots import Roots

NEAR, FOUND = 1e-9, 1e-8
"""A point with |f| below this share of a voxel is where it should be, for a corner has no gradient to follow;
one that is brought there shall have |f| below the other."""


@dataclass(frozen=True, eq=False)
class TrustRegions:
    """Where some points may go: low, high: corners of boxes, float64 [3, n], scene units; a box may be flat.
    other: points in the boxes or on their borders where the field has the other sign, or None. middle:
    points in the boxes amid the surface there, as far as it is known, or None.
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
) -> tuple[np.ndarray, np.ndarray]:
    """Brings points to the zero set, never out of their boxes.

    points: float64 [n, 3], scene units. trust_regions: those of points by number; the
    second argument says which are inside. A point moves along the gradient if the field changes its sign
    there within
    four of Newton's steps and the box, else straight towards its room's point of the other sign. Where the
    field is smooth close up it moves straight towards the middle if the surface lies between. One that
    comes no nearer stays, and so does what lies on the surface already, such as an exact corner. Returns the
    numbers of those that did not, int64 [k], and where they are now, float64 [k, 3].
    """
    kernel, work = root.kernel("cpu", "float64"), work or Work()
    guess, exact = Roots(root, "float32", voxel), Roots(root, "float64", voxel)

    def task(part: slice) -> tuple[np.ndarray, np.ndarray]:
        values = kernel.points(*points[part].T)
        away = np.flatnonzero(np.abs(values) > NEAR * voxel)
        if not len(away):
            return away, np.empty((0, 3))
        own = guess.padded(away)
        return part.start + away, brought(part.start + own, values[own])[:, : len(away)].T

    def brought(which: np.ndarray, f: np.ndarray) -> np.ndarray:
        p, region = np.ascontiguousarray(points[which].T), trust_regions(which, f < 0)
        ways = np.concatenate([p, guess.lead(_relative(p, region))])
        t, miss = exact.aimed(ways, guess.found(ways.astype(np.float32)))
        left = np.flatnonzero(miss > FOUND)
        if len(left):
            left = exact.padded(left)
            slow = ways.take(left, 1)
            t[left], miss[left] = exact.aimed(slow, exact.found(slow))
        there = np.clip(p + t * ways[3:], region.low, region.high)
        return np.where(miss * voxel < np.abs(f), there, p)

    found = work.collect(task, chunks(len(points), 1 << 14))
    if not found:
        return np.empty(0, np.int64), np.empty((0, 3))
    numbers, places = zip(*found, strict=True)
    return np.concatenate(numbers), np.concatenate(places)


def anywhere(which: np.ndarray, inside: np.ndarray) -> TrustRegions:
    """Rooms without borders."""
    return TrustRegions(np.full((3, len(which)), -np.inf), np.full((3, len(which)), np.inf))


def _relative(p: np.ndarray, region: TrustRegions) -> np.ndarray:
    """What `Roots.lead` takes: float32 holds distances better than places."""
    rows = np.empty((15, p.shape[1]), np.float32)
    rows[:3], rows[3:6], rows[6:9] = p, p - region.low, region.high - p
    rows[9:12] = np.nan if region.other is None else region.other - p
    rows[12:] = np.nan if region.middle is None else region.middle - p
    return rows
