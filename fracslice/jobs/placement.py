"""The map from the scene to print space."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Placement:
    """Map from the scene to print space: ``mm = scale * scene units + offset``.

    Attributes
    ----------
    scale : float
        mm per scene unit.
    offset : tuple of float
        Translation, mm.
    """

    scale: float
    offset: tuple[float, float, float]

    def mm(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Transform points from the scene to print space.

        Parameters
        ----------
        points : ndarray of float64, shape (n, 3)
            Points, scene units.

        Returns
        -------
        ndarray of float64, shape (n, 3)
            Points, mm.
        """
        placed: NDArray[np.float64] = points * self.scale + np.array(self.offset)
        return placed

    def units(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Transform points from print space to the scene.

        Parameters
        ----------
        points : ndarray of float64, shape (n, 3)
            Points, mm.

        Returns
        -------
        ndarray of float64, shape (n, 3)
            Points, scene units.
        """
        axes = np.ascontiguousarray(points.T)  # three long rows: NumPy is slow on many short ones
        scene: NDArray[np.float64] = ((axes - np.array(self.offset)[:, None]) / self.scale).T
        return scene
