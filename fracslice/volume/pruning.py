"""Cells of a lattice that the field's bound proves free of the surface, and the bricks that remain.

Top down, a cell is discarded if the field at its centre proves that no sign change is in it or within a voxel
of it: ``|f| > L * (half diagonal + voxel)``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..formulas.field import Bounds
from ..kernel import Kernel
from ..work import Work
from .lattice import BRICK, Lattice
from .states import CANDIDATE, EMPTY, FULL, States
from .values import values_at

COARSEST = 16
"""Bricks along a cell of the first level: 128 voxels, as in OpenVDB's tree."""


@dataclass
class Pruning:
    """Evaluations that discard cells.

    Attributes
    ----------
    kernel
        Kernel of the scene.
    conservative
        Kernel to prune by.
    bounds
        Bounds of the field to prune by.
    lattice
        Sampling grid.
    work
        Execution settings.
    evaluations
        Points evaluated.
    """

    kernel: Kernel
    conservative: Kernel
    bounds: Bounds
    lattice: Lattice
    work: Work
    evaluations: int = 0

    def probe(self) -> tuple[States, np.ndarray]:
        """Discard cells from the coarsest level down.

        Returns
        -------
        States
            State of every brick.
        ndarray
            For each candidate, in order, whether its centre is outside, bool [n].
        """
        size = COARSEST
        grid = np.full([-(-n // size) for n in self.lattice.bricks], CANDIDATE, np.uint8)
        while True:
            cells = np.nonzero(grid == CANDIDATE)
            f, reach = self._centres(cells, size, self.conservative), self._reach(size * BRICK)
            full = (f < -reach) & (not self.bounds.exterior_only)
            near = ~((f > reach) | full)
            grid[cells] = np.where(near, CANDIDATE, np.where(full, FULL, EMPTY))
            if size == 1:
                break
            size //= 2
            shape = tuple(slice(-(-n // size)) for n in self.lattice.bricks)
            grid = grid.repeat(2, 0).repeat(2, 1).repeat(2, 2)[shape]
        if self.conservative is self.kernel:
            own = f[near]
        else:
            own = self._centres(tuple(c[near] for c in cells), 1, self.kernel)
        return States.within(grid), ~(own < 0)

    def _centres(self, cells: tuple[np.ndarray, ...], size: int, kernel: Kernel) -> np.ndarray:
        """Field at the centres of cells of `size` bricks."""
        return self.values_at([size * BRICK * c + (size * BRICK - 1) / 2 for c in cells], kernel)

    def values_at(self, indices: Sequence[np.ndarray], kernel: Kernel) -> np.ndarray:
        """Evaluate a field.

        Parameters
        ----------
        indices
            Positions in grid indices, three arrays [n].
        kernel
            Kernel of the field.

        Returns
        -------
        ndarray
            Field values, [n].
        """
        points = np.empty((3, len(indices[0])))
        for row, start, along in zip(points, self.lattice.origin, indices, strict=True):
            np.add(start, self.lattice.voxel * along, out=row)
        self.evaluations += points.shape[1]
        return values_at(kernel, points, self.work)

    def emptied(self, places: np.ndarray) -> np.ndarray:
        """Prove bricks empty by their eight subcells: 8 evaluations to save 512.

        Parameters
        ----------
        places
            Bricks, [3, n].

        Returns
        -------
        ndarray
            Mask of the empty ones, bool [n].
        """
        size = BRICK // 2
        middle = np.indices((2, 2, 2)).reshape(3, 8, 1) * size + (size - 1) / 2
        f = self.values_at((places[:, None] * BRICK + middle).reshape(3, -1), self.conservative)
        empty: np.ndarray = f.reshape(8, -1).min(0) > self._reach(size)
        return empty

    def _reach(self, size: int) -> float:
        """Least |f| at the centre of a cell of `size` samples that excludes a sign change within a voxel of
        it.
        """
        return self.bounds.lipschitz * float(np.sqrt(3)) * self.lattice.voxel * (size + 1) / 2
