"""Rays through a field, and where it first turns negative along them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..common.compiled import compiled
from ..common.rows import Rows

ROUNDS = 400
"""Maximum number of steps along a ray."""


@dataclass(frozen=True, eq=False)
class Rays(Rows):
    """Rays that start next to a surface and pass through it.

    Attributes
    ----------
    start, directions : float64 [n, 3]
        Origins, scene units, and unit directions.
    area : float64 [n]
        Surface that each ray represents.
    enter, leave : float64 [n]
        Distances along the ray to the beginning and the end of a thin wall or gap.
    """

    start: np.ndarray
    directions: np.ndarray
    area: np.ndarray
    enter: np.ndarray
    leave: np.ndarray

    def points(self, s: np.ndarray) -> np.ndarray:
        """Points at distances `s` along the rays, [3, n]."""
        return np.asarray(self.start.T + s * self.directions.T)

    def some_points(self, which: np.ndarray, s: np.ndarray) -> np.ndarray:
        """Points at distances `s` along the rays of these numbers, [3, n]."""
        points: np.ndarray = _points(self.start, self.directions, which, s)
        return points


def first_negative(
    field: Callable[[np.ndarray, np.ndarray], np.ndarray],
    begin: np.ndarray,
    end: np.ndarray,
    bound: float,
    least: float,
) -> np.ndarray:
    """Distance along each ray at which a field first turns negative.

    Steps follow the distance (sphere tracing, Hart 1996). Over the last step the field is taken as linear.

    Parameters
    ----------
    field : callable
        Values from numbers of rays and distances along them.
    begin, end : float64 [n]
        Distances between which the field is followed.
    bound : float
        Lipschitz bound of the field.
    least : float
        Length of the last step.

    Returns
    -------
    float64 [n]
        Distances; beyond `end` where the field does not turn negative.
    """
    s, before, todo = begin + least, begin.copy(), np.arange(len(begin))
    high, low = np.full((2, len(begin)), least * bound / 2)
    for _ in range(ROUNDS):
        f = field(todo, s[todo])
        on, below = todo[f >= 0], todo[f < 0]
        before[on], high[on], low[below] = s[on], f[f >= 0], f[f < 0]
        s[on] += np.maximum(high[on] / bound, least)
        far = below[s[below] - before[below] > 1.01 * least]
        s[far] = (before[far] + s[far]) / 2
        todo = np.concatenate([on[s[on] < end[on]], far])
        if not len(todo):
            break
    s[todo] = end[todo]
    negative = s < end
    share = low[negative] / (low[negative] - high[negative])
    s[negative] -= share * (s[negative] - before[negative])
    return s


@compiled
def _points(start, directions, which, s):  # type: ignore[no-untyped-def]
    """Points at distances `s` along some rays, [3, n]."""
    points = np.empty((3, len(s)))
    for i in range(len(s)):
        for axis in range(3):
            points[axis, i] = start[which[i], axis] + s[i] * directions[which[i], axis]
    return points
