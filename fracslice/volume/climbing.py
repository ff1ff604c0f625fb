"""Extreme points of a solid in given directions, by pattern search."""

from __future__ import annotations

import numpy as np

from .._native import climb as climbed
from ..kernel import Kernel
from ..work import Work

SLANTS = np.stack(np.meshgrid((-1, 0, 1), (-1, 0, 1), 0.1 ** np.arange(0, 3.5, 0.5))).reshape(3, -1)
"""Steps straight along the last axis or slanted, [3, w]."""


def climb(
    kernel: Kernel, starts: np.ndarray, steps: np.ndarray, first: float, exact: float, work: Work
) -> np.ndarray:
    """Move interior points outwards as far as possible.

    Pattern search (Hooke and Jeeves 1961): a step is taken if it ends inside; if none does, the step length
    is halved.

    Parameters
    ----------
    kernel
        Kernel of the field.
    starts
        Interior points for each of n directions, float64 [3, n, k].
    steps
        `SLANTS` rotated to each direction, [3, n, w].
    first, exact
        First and last step length.
    work
        Execution settings.

    Returns
    -------
    ndarray
        Final points, float64 [3, n, k].

    Raises
    ------
    Cancelled
        If the job was cancelled.
    """
    work.check()
    starts, steps = np.ascontiguousarray(starts), np.ascontiguousarray(steps)
    return climbed(kernel.entry, starts, steps, SLANTS[2], first, exact, work.threads)
