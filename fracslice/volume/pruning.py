"""Cells of a lattice that are free of the surface, and the bricks that remain.

Top down, a cell is discarded if no sign change is in it or within a voxel of it: by the field at its centre,
``|f| > L * (half diagonal + voxel)``, or else by an enclosure of the field's values on all of it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from ..formulas.field import Bounds, Cells
from ..kernel import Kernel
from ..work import Work, chunks
from .lattice import BRICK, Lattice
from .states import CANDIDATE, EMPTY, FULL, QUEUED, States, where

COARSEST = 16
"""Bricks along a cell of the first level: 128 voxels, as in OpenVDB's tree."""

ENCLOSURE = 4
"""Evaluations that an enclosure counts as; it costs 1.5 to 8."""

BATCH = 1 << 15
"""Cells per task: in smaller ones threads wait for the interpreter."""

LOOKED_AT = 1 << 12
"""Unsampled bricks whose proofs are looked for where a measured bound discarded them."""


@dataclass(frozen=True)
class Proofs:
    """Proofs of cells by enclosures."""

    cells: Cells | None  # proofs; None: there are none
    only: bool = False  # true if a measured bound discards nothing


@dataclass
class Pruning:
    """Evaluations that discard cells."""

    kernel: Kernel  # kernel of the scene
    conservative: Kernel  # kernel to prune by
    bounds: Bounds  # bounds of the field to prune by
    lattice: Lattice  # sampling grid
    work: Work  # execution settings
    # proofs of the cells that a proved bound does not discard; None: none are tried
    proofs: Proofs | None = None
    evaluations: int = 0  # points evaluated

    @property
    def everywhere(self) -> bool:
        """True if the inside is sampled, too, where it is not proved to be full."""
        return not self.bounds.exterior_only or self.is_strict

    @property
    def is_strict(self) -> bool:
        """True if nothing is discarded without a proof."""
        return self.proofs is not None and self.proofs.only

    @property
    def _cost(self) -> int:
        """Evaluations that a try to prove a cell counts as."""
        return ENCLOSURE if self.proofs and self.proofs.cells else 0

    def share(self, states: States) -> float | None:
        """Return the share of the unsampled bricks whose sign is proved; None if it is not known.

        Where a measured bound discarded them, proofs of a few thousand are looked for.
        """
        if self.everywhere:
            return 1.0
        bare = states.where(lambda part: states.flat[part] < QUEUED, self.work)
        if self.proofs is None or not len(bare):
            return None
        some = bare[np.linspace(0, len(bare) - 1, min(len(bare), LOOKED_AT)).astype(np.intp)]
        indices = self._centres(states.places(some), 1)
        empty, full = (np.empty(len(some), bool) for _ in range(2))

        def task(part: slice) -> int:
            empty[part], full[part] = self._proved(indices[:, part], BRICK)
            return self._cost * len(some[part])

        self._run(task, len(some))
        return float(np.where(states.flat[some] == EMPTY, empty, full).mean())

    def probe(self) -> tuple[States, np.ndarray]:
        """Discard cells from the coarsest level down.

        Returns bool [n].
        """
        size = COARSEST
        grid = np.full([-(-n // size) for n in self.lattice.bricks], CANDIDATE, np.uint8)
        while True:
            cells = self._candidates(grid)
            outside = np.empty(len(cells), bool)
            self._run(partial(self._examine, grid, cells, outside, size), len(cells))
            if size == 1:
                return States.within(grid, self.work), outside[grid.reshape(-1)[cells] == CANDIDATE]
            size //= 2
            grid = self._halved(grid, size)

    def _candidates(self, grid: np.ndarray) -> np.ndarray:
        """Flat indices of the cells that are not discarded."""
        flat = grid.reshape(-1)
        return where(lambda part: flat[part] == CANDIDATE, 0, len(flat), self.work)

    def _halved(self, grid: np.ndarray, size: int) -> np.ndarray:
        """States of cells of `size` bricks, from those of cells twice as large."""
        x, y, z = (-(-n // size) for n in self.lattice.bricks)
        result = np.empty((x, y, z), np.uint8)

        def task(layer: int) -> None:
            result[2 * layer : 2 * layer + 2] = grid[layer].repeat(2, 0).repeat(2, 1)[:y, :z]

        self.work.map(task, range(len(grid)))
        return result

    def _run(self, task: Callable[[slice], int], count: int) -> None:
        """Run a task on ranges of things. It returns its evaluations."""
        self.evaluations += sum(self.work.collect(task, chunks(count, BATCH)))

    def _examine(
        self, grid: np.ndarray, cells: np.ndarray, outside: np.ndarray, size: int, part: slice
    ) -> int:
        """Set the states of some cells of `size` bricks, and whether the centres of bricks are outside."""
        indices = self._centres(np.stack(np.unravel_index(cells[part], grid.shape)), size)
        f = self.conservative.points(*self._points(indices))
        states, spent = self._states(indices, f, size)
        grid.reshape(-1)[cells[part]] = states
        if size == 1 and self.conservative is self.kernel:
            outside[part] = ~(f < 0)
        elif size == 1:
            (near,) = np.nonzero(states == CANDIDATE)
            outside[part.start + near] = ~(self.kernel.points(*self._points(indices[:, near])) < 0)
            spent += len(near)
        return len(f) + spent

    def _centres(self, cells: np.ndarray, size: int) -> np.ndarray:
        """Grid indices of the centres of cells of `size` bricks."""
        return size * BRICK * cells + (size * BRICK - 1) / 2

    def _states(self, indices: np.ndarray, f: np.ndarray, size: int) -> tuple[np.ndarray, int]:
        """States of cells of `size` bricks around given points, from the values there, and evaluations."""
        states, spent = np.full(len(f), CANDIDATE, np.uint8), 0
        if not self.is_strict or not self.bounds.exterior_only:
            reach = self._reach(size * BRICK)
            states[f > reach] = EMPTY
            if not self.bounds.exterior_only:
                states[f < -reach] = FULL
        if self.proofs and self.everywhere:
            (left,) = np.nonzero(states == CANDIDATE)
            empty, full = self._proved(indices[:, left], size * BRICK)
            states[left[empty]], states[left[full]] = EMPTY, FULL
            spent = self._cost * len(left)
        return states, spent

    def _proved(self, indices: np.ndarray, size: int) -> tuple[np.ndarray, np.ndarray]:
        """Masks of the cells of `size` samples around given points that are proved empty, and full."""
        assert self.proofs
        if self.proofs.cells is None or not indices.size:
            none = np.zeros(indices.shape[1], bool)
            return none, none
        return self.proofs.cells(self._points(indices), self.lattice.voxel * (size + 1) / 2)

    def _points(self, indices: np.ndarray) -> np.ndarray:
        """Points [3, n] at positions in grid indices, scene units."""
        points = np.empty((3, len(indices[0])))
        for row, start, along in zip(points, self.lattice.origin, indices, strict=True):
            np.add(start, self.lattice.voxel * along, out=row)
        return points

    def inside(self, states: States, bricks: np.ndarray, offsets: np.ndarray) -> np.ndarray:
        """Test whether grid points are inside.

        `bricks`: int [n]; `offsets`: int [3, n]. Returns bool [n].
        """
        result = np.empty(len(bricks), bool)

        def task(part: slice) -> int:
            indices = states.places(bricks[part]) * BRICK + offsets[:, part]
            result[part] = self.kernel.points(*self._points(indices)) < 0
            return len(bricks[part])

        self._run(task, len(bricks))
        return result

    def emptied(self, states: States, bricks: np.ndarray) -> np.ndarray:
        """Prove bricks empty by their eight subcells: few evaluations to save 512.

        `bricks`: int [n]. Returns bool [n].
        """
        size, result = BRICK // 2, np.empty(len(bricks), bool)
        middle = np.indices((2, 2, 2)).reshape(3, 8, 1) * size + (size - 1) / 2

        def task(part: slice) -> int:
            indices = (states.places(bricks[part])[:, None] * BRICK + middle).reshape(3, -1)
            empty, spent = np.zeros(indices.shape[1], bool), 0
            if not (self.is_strict and self.bounds.exterior_only):
                empty = self.conservative.points(*self._points(indices)) > self._reach(size)
                spent = len(empty)
            if self.proofs and self.everywhere:
                (left,) = np.nonzero(~empty)
                empty[left] = self._proved(indices[:, left], size)[0]
                spent += self._cost * len(left)
            result[part] = empty.reshape(8, -1).min(0)
            return spent

        self._run(task, len(bricks))
        return result

    def _reach(self, size: int) -> float:
        """Least |f| at the centre of a cell of `size` samples that excludes a sign change within a voxel of
        it.
        """
        return self.bounds.lipschitz * float(np.sqrt(3)) * self.lattice.voxel * (size + 1) / 2
