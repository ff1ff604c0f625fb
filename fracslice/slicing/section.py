"""The field in the plane of a layer, and vertices of contours."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..common.rows import Rows
from ..kernel import Kernel


@dataclass(frozen=True, eq=False)
class CrossSection:
    """The field in the plane of a layer.

    Attributes
    ----------
    kernel : Kernel
        Kernel of the field.
    z : float
        Height of the plane, scene units.
    frame : float64 [4]
        (x0, y0, dx, dy) of the lattice, scene units.
    """

    kernel: Kernel
    z: float
    frame: np.ndarray

    def __call__(self, points: np.ndarray) -> np.ndarray:
        """Field at points of the lattice.

        Parameters
        ----------
        points : float64 [n, 2]
            Points, lattice units.

        Returns
        -------
        [n]
            Values, in the kernel's dtype.
        """
        x, y = self.frame[:2, None] + self.frame[2:, None] * points.T
        return self.kernel.points(x, y, np.full(len(points), self.z))


@dataclass(frozen=True, eq=False)
class Vertices(Rows):
    """Vertices of contours.

    Attributes
    ----------
    points : float64 [n, 2]
        Positions, lattice units.
    after : int64 [n]
        The crossing that each vertex is or follows.
    share : float64 [n]
        Fraction of the distance to the next crossing, 0 to 1.
    """

    points: np.ndarray
    after: np.ndarray
    share: np.ndarray

    @classmethod
    def none(cls) -> Vertices:
        """An empty record."""
        return cls(np.empty((0, 2)), np.empty(0, np.int64), np.empty(0))


def keys(pixels: np.ndarray) -> np.ndarray:
    """Unique number of each pixel.

    Parameters
    ----------
    pixels : int64 [n, 2]
        Columns and rows.

    Returns
    -------
    int64 [n]
        The numbers.
    """
    result: np.ndarray = (pixels[:, 0] << 32) + pixels[:, 1]
    return result


def alone(pixels: np.ndarray) -> np.ndarray:
    """Find pixels that occur once.

    Parameters
    ----------
    pixels : int64 [n, 2]
        Columns and rows.

    Returns
    -------
    bool [n]
        True if no other row is the same pixel.
    """
    _, which, count = np.unique(keys(pixels), return_inverse=True, return_counts=True)
    return np.asarray(count[which] == 1)


def free(pixels: np.ndarray, beside: np.ndarray, taken: np.ndarray) -> np.ndarray:
    """Find vertices that may leave their pixel, or stay in it.

    Parameters
    ----------
    pixels : int64 [n, 2]
        The pixel of each vertex.
    beside : int64 [n, 2]
        The pixel that it is to be in.
    taken : int64 [m, 2]
        Pixels with contours or corners.

    Returns
    -------
    bool [n]
        True if both pixels are the same, or adjacent and the other is neither taken nor wanted by another
        vertex.
    """
    away = np.abs(beside - pixels).sum(1)
    result: np.ndarray = (away == 0) | ((away == 1) & alone(beside) & ~np.isin(keys(beside), keys(taken)))
    return result
