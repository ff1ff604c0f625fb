"""Extreme points of a solid in given directions, by pattern search."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

STEPS = 256
"""Largest number of steps."""

SLANTS = np.stack(np.meshgrid((-1, 0, 1), (-1, 0, 1), 0.1 ** np.arange(0, 3.5, 0.5))).reshape(3, -1)
"""Steps straight along the last axis or slanted, [3, w]."""


def climb(
    inside: Callable[[np.ndarray], np.ndarray],
    starts: np.ndarray,
    ways: np.ndarray,
    first: float,
    exact: float,
) -> np.ndarray:
    """Move interior points outwards as far as possible.

    Pattern search (Hooke and Jeeves 1961): a step is taken if it ends inside; if none does, the step length
    is halved. All points move at once.

    Parameters
    ----------
    inside
        Predicate of points [3, m], returns bool [m].
    starts
        Interior points for each of n directions, float64 [3, n, k].
    ways
        `SLANTS` rotated to each direction, [3, n, w].
    first, exact
        First and last step length.

    Returns
    -------
    ndarray
        Final points, float64 [3, n, k].
    """
    found, going = starts.copy(), np.arange(starts.shape[1])
    step = np.full(len(going), first)
    for _ in range(STEPS):
        if not len(going):
            break
        here = found[:, going]
        tried = here[..., None] + step[going, None, None] * ways[:, going, None]
        gain = np.where(inside(tried.reshape(3, -1)).reshape(tried.shape[1:]), SLANTS[2], 0.0)
        best = gain.argmax(2)[..., None]
        free = np.take_along_axis(gain, best, 2)[..., 0] > 0
        found[:, going] = np.where(free, np.take_along_axis(tried, best[None], 3)[..., 0], here)
        stuck = ~free.any(1)
        done = stuck & (step[going] < exact)
        step[going[stuck]] /= 2
        going = going[~done]
    return found
