"""Cells of a lattice that are free of the surface, and the bricks that remain.

Top down, a cell is discarded if no sign change is in it or within a voxel of it: by the field at its centre,
``|f| > L * (half diagonal + voxel)``, or else by an enclosure of the field's values on all of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..formulas.field import Bounds, Cells
from ..kernel import Kernel
from ..work import Work, chunks
from .lattice import BRICK, Lattice
from .states import CANDIDATE, EMPTY, FULL, QUEUED, States
from .values import values_at

COARSEST = 16
"""Bricks along a cell of the first level: 128 voxels, as in OpenVDB's tree."""

ENCLOSURE = 4
"""Evaluations that an enclosure counts as; it costs 1.5 to 8."""

BATCH = 1 << 12
"""Cells per task."""

LOOKED_AT = 1 << 12
"""Unsampled bricks whose proofs are looked for where a measured bound discarded them."""


@dataclass(frozen=True)
class Proofs:
    """Proofs of cells by enclosures.

    Attributes
    ----------
    cells
        Proofs; None: there are none.
    only
        True if a measured bound discards nothing.
    """

    cells: Cells | None
    only: bool = False


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
    proofs
        Proofs of the cells that a proved bound does not discard; None: none are tried.
    evaluations
        Points evaluated.
    """

    kernel: Kernel
    conservative: Kernel
    bounds: Bounds
    lattice: Lattice
    work: Work
    proofs: Proofs | None = None
    evaluations: int = 0

    @property
    def everywhere(self) -> bool:
        """True if the inside is sampled, too, where it is not proved to be full."""
        return not self.bounds.exterior_only or self.is_strict

    @property
    def is_strict(self) -> bool:
        """True if nothing is discarded without a proof."""
        return self.proofs is not None and self.proofs.only

    def share(self, states: States) -> float | None:
        """Return the share of the unsampled bricks whose sign is proved; None if it is not known.

        Where a measured bound discarded them, proofs of a few thousand are looked for.

        Parameters
        ----------
        states
            States of all bricks.

        Returns
        -------
        float or None
            Share.
        """
        if self.everywhere:
            return 1.0
        bare = np.flatnonzero(states.flat < QUEUED)
        if self.proofs is None or not len(bare):
            return None
        some = bare[np.linspace(0, len(bare) - 1, min(len(bare), LOOKED_AT)).astype(np.intp)]
        empty, full = self._proved(self._centres(states.places(some), 1), BRICK)
        return float(np.where(states.flat[some] == EMPTY, empty, full).mean())

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
            indices = self._centres(np.stack(cells), size)
            f = self.values_at(indices, self.conservative)
            grid[cells] = self._states(indices, f, size)
            if size == 1:
                break
            size //= 2
            shape = tuple(slice(-(-n // size)) for n in self.lattice.bricks)
            grid = grid.repeat(2, 0).repeat(2, 1).repeat(2, 2)[shape]
        near = grid[cells] == CANDIDATE
        own = f[near] if self.conservative is self.kernel else self.values_at(indices[:, near], self.kernel)
        return States.within(grid), ~(own < 0)

    def _centres(self, cells: np.ndarray, size: int) -> np.ndarray:
        """Grid indices of the centres of cells of `size` bricks."""
        return size * BRICK * cells + (size * BRICK - 1) / 2

    def _states(self, indices: np.ndarray, f: np.ndarray, size: int) -> np.ndarray:
        """States of cells of `size` bricks around given points, from the values there."""
        states = np.full(len(f), CANDIDATE, np.uint8)
        if not self.is_strict or not self.bounds.exterior_only:
            reach = self._reach(size * BRICK)
            states[f > reach] = EMPTY
            if not self.bounds.exterior_only:
                states[f < -reach] = FULL
        if self.proofs and self.everywhere:
            (left,) = np.nonzero(states == CANDIDATE)
            empty, full = self._proved(indices[:, left], size * BRICK)
            states[left[empty]], states[left[full]] = EMPTY, FULL
        return states

    def _proved(self, indices: np.ndarray, size: int) -> tuple[np.ndarray, np.ndarray]:
        """Masks of the cells of `size` samples around given points that are proved empty, and full."""
        assert self.proofs
        cells, points = self.proofs.cells, self._points(indices)
        half = self.lattice.voxel * (size + 1) / 2
        empty, full = (np.zeros(points.shape[1], bool) for _ in range(2))
        if cells is None:
            return empty, full

        def task(part: slice) -> None:
            empty[part], full[part] = cells(points[:, part], half)

        self.work.map(task, chunks(len(empty), BATCH))
        self.evaluations += ENCLOSURE * len(empty)
        return empty, full

    def _points(self, indices: Sequence[np.ndarray] | np.ndarray) -> np.ndarray:
        """Points [3, n] at positions in grid indices, scene units."""
        points = np.empty((3, len(indices[0])))
        for row, start, along in zip(points, self.lattice.origin, indices, strict=True):
            np.add(start, self.lattice.voxel * along, out=row)
        return points

    def values_at(self, indices: Sequence[np.ndarray] | np.ndarray, kernel: Kernel) -> np.ndarray:
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
        points = self._points(indices)
        self.evaluations += points.shape[1]
        return values_at(kernel, points, self.work)

    def emptied(self, places: np.ndarray) -> np.ndarray:
        """Prove bricks empty by their eight subcells: few evaluations to save 512.

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
        indices = (places[:, None] * BRICK + middle).reshape(3, -1)
        empty = np.zeros(indices.shape[1], bool)
        if not (self.is_strict and self.bounds.exterior_only):
            empty[self.values_at(indices, self.conservative) > self._reach(size)] = True
        if self.proofs and self.everywhere:
            left = ~empty
            empty[left] = self._proved(indices[:, left], size)[0]
        found: np.ndarray = empty.reshape(8, -1).min(0)
        return found

    def _reach(self, size: int) -> float:
        """Least |f| at the centre of a cell of `size` samples that excludes a sign change within a voxel of
        it.
        """
        return self.bounds.lipschitz * float(np.sqrt(3)) * self.lattice.voxel * (size + 1) / 2
