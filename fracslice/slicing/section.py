"""The plane of a layer: the field in it, and points of outlines."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..kernel import Kernel
from ..rows import Rows


@dataclass(frozen=True, eq=False)
class CrossSection:
    """kernel: of the field. z: of the layer. frame: (x0, y0, dx, dy) of the lattice. Scene units."""

    kernel: Kernel
    z: float
    frame: np.ndarray

    def __call__(self, points: np.ndarray) -> np.ndarray:
        """The field at points of the lattice, float64 [n, 2]."""
        x, y = self.frame[:2, None] + self.frame[2:, None] * points.T
        return self.kernel.points(x, y, np.full(len(points), self.z))


@dataclass(frozen=True, eq=False)
class Vertices(Rows):
    """Points of contours, lattice units, float64 [n, 2]; the crossing that each is or comes after, int64 [n];
    and how far it is on the way to the next one, float64 [n], 0 to 1.
    """

    points: np.ndarray
    after: np.ndarray
    share: np.ndarray

    @classmethod
    def none(cls) -> Vertices:
        """No points at all."""
        return cls(np.empty((0, 2)), np.empty(0, np.int64), np.empty(0))


def keys(pixels: np.ndarray) -> np.ndarray:
    """A number for each pixel, int64 [n, 2]."""
    found: np.ndarray = (pixels[:, 0] << 32) + pixels[:, 1]
    return found


def alone(pixels: np.ndarray) -> np.ndarray:
    """Whether each pixel, int64 [n, 2], is there only once."""
    _, which, count = np.unique(keys(pixels), return_inverse=True, return_counts=True)
    return np.asarray(count[which] == 1)


def free(pixels: np.ndarray, beside: np.ndarray, taken: np.ndarray) -> np.ndarray:
    """Whether something of each pixel may be in another one, int64 [n, 2] both: if it is the same, or a next
    one that nothing else reaches and that is none of those taken.
    """
    away = np.abs(beside - pixels).sum(1)
    found: np.ndarray = (away == 0) | ((away == 1) & alone(beside) & ~np.isin(keys(beside), keys(taken)))
    return found
