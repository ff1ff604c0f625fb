"""Cells of a lattice that are free of the surface, and the bricks that remain.

Top down, a cell is discarded if no sign change is in it or within a voxel of it: by the field at its centre,
``|f| > L * (half diagonal + voxel)``, or else by an enclosure of the field's values on all of it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, partial

import numpy as np

from ..fields.field import Bounds, Cells, Kernel
from ..work import Work, chunks
from .bricks import BRICK, INSIDE, OUTSIDE, Lattice

FACES = [(axis, step) for axis in range(3) for step in (-1, 1)]

ALL = np.uint64(0xFFFFFFFFFFFFFFFF)
_OF_A_SLAB = {
    (1, -1): np.uint64(0xFF),
    (1, 1): np.uint64(0xFF << 56),
    (2, -1): np.uint64(0x0101010101010101),
    (2, 1): np.uint64(0x8080808080808080),
}
"""Bits on a face of a slab of constant x: bit 8 y + z."""


@dataclass(frozen=True, eq=False)
class SignFaces:
    """Sign bits of bricks."""

    signs: np.ndarray  # sign bits, uint8 [n, 8, 8], C-contiguous: bit z of byte (x, y) is set inside

    @cached_property
    def slabs(self) -> np.ndarray:
        """One 64-bit word per slab of constant x, uint64 [8, n]."""
        return np.ascontiguousarray(self.signs.reshape(-1, 64).view("<u8").T)

    @cached_property
    def either(self) -> np.ndarray:
        """Bits set in any slab, uint64 [n]."""
        result: np.ndarray = np.bitwise_or.reduce(self.slabs)
        return result

    @cached_property
    def both(self) -> np.ndarray:
        """Bits set in all slabs, uint64 [n]."""
        result: np.ndarray = np.bitwise_and.reduce(self.slabs)
        return result

    @property
    def anywhere(self) -> tuple[np.ndarray, np.ndarray]:
        """Masks of the bricks with interior samples and with exterior samples, bool [n] each."""
        return self.either != 0, self.both != ALL

    def shown(self, axis: int, step: int) -> tuple[np.ndarray, np.ndarray]:
        """Test the outermost layer of samples on one side.

        Returns bool [n] each.
        """
        if axis == 0:
            layer = self.slabs[7 if step > 0 else 0]
            return layer != 0, layer != ALL
        bits = _OF_A_SLAB[axis, step]
        return (self.either & bits) != 0, (self.both & bits) != bits


EMPTY, CANDIDATE, FULL, QUEUED, BORDER = range(5)

RANGE = 1 << 20
"""Bricks per task."""


@dataclass(frozen=True, eq=False)
class States:
    """States of a lattice's bricks with one layer of border around them, addressed by flat index."""

    # states, uint8 [(bx + 2) (by + 2) (bz + 2)], z fastest. Those outside the lattice are `BORDER`, so that
    # every brick has six neighbours at constant offsets
    flat: np.ndarray
    shape: tuple[int, ...]  # dimensions (bx + 2, by + 2, bz + 2)

    @classmethod
    def within(cls, grid: np.ndarray, work: Work) -> States:
        """Pad the states of a lattice's bricks by a border.

        `grid`: uint8 [bx, by, bz].
        """
        padded = np.full([n + 2 for n in grid.shape], BORDER, np.uint8)

        def task(layer: int) -> None:
            padded[layer + 1, 1:-1, 1:-1] = grid[layer]

        work.map(task, range(len(grid)))
        return cls(padded.reshape(-1), padded.shape)

    def step(self, axis: int, step: int) -> int:
        """Return the flat offset between bricks."""
        return step * (self.shape[1] * self.shape[2], self.shape[2], 1)[axis]

    def places(self, numbers: np.ndarray) -> np.ndarray:
        """Convert flat indices to brick coordinates.

        `numbers`: int [n]. Returns int [3, n].
        """
        return np.stack(np.unravel_index(numbers, self.shape)) - 1

    def where(self, test: Callable[[slice], np.ndarray], work: Work) -> np.ndarray:
        """Find the bricks that pass a test.

        Returns int [n].
        """
        layer = self.step(0, 1)
        return where(test, layer, self.flat.size - layer, work)

    def beside(self, part: slice, kinds: Sequence[int]) -> np.ndarray:
        """Test whether a face of bricks borders on a brick of some states."""
        result = np.zeros(part.stop - part.start, bool)
        for step in (self.step(*face) for face in FACES):
            seen = self.flat[part.start + step : part.stop + step]
            for kind in kinds:
                result |= seen == kind
        return result

    def inner(self, flat: np.ndarray, work: Work) -> np.ndarray:
        """Remove the border of an array like `flat`.

        Returns array [bx, by, bz].
        """
        grid = flat.reshape(self.shape)[1:-1, 1:-1, 1:-1]
        result = np.empty(grid.shape, flat.dtype)

        def task(layer: int) -> None:
            result[layer] = grid[layer]

        work.map(task, range(len(grid)))
        return result


def where(test: Callable[[slice], np.ndarray], first: int, end: int, work: Work) -> np.ndarray:
    """Find the numbers of a range that pass a test.

    Returns int [n].
    """
    parts = [slice(first + part.start, first + part.stop) for part in chunks(end - first, RANGE)]
    numbers = work.collect(lambda part: part.start + np.flatnonzero(test(part)), parts)
    return np.concatenate([np.empty(0, np.intp), *numbers])


ROWS = 1 << 15
"""Bricks per task."""

IN, OUT = 12, 13
"""Bits of bricks with interior and with exterior samples, behind two bits of each face."""


def crossed_bricks(
    states: States, numbers: np.ndarray, signs: np.ndarray, work: Work
) -> tuple[np.ndarray, np.ndarray]:
    """Find the bricks that are touched by a grid edge with a sign change.

    `numbers`: int [n]; `signs`: their sign bits, uint8 [n, 8, 8]. Returns int [k]; int32.
    """
    index = sides(states, work)
    index[numbers] = np.arange(len(numbers))
    shown, kept = np.empty(len(numbers), np.uint16), np.empty(len(numbers), bool)

    def show(part: slice) -> None:
        faces = SignFaces(signs[part])
        bits = [side for face in FACES for side in faces.shown(*face)] + [*faces.anywhere]
        shown[part] = sum(bit.astype(np.uint16) << place for place, bit in enumerate(bits))

    def keep(part: slice) -> None:
        own = shown[part]
        kept[part] = (own >> IN) & (own >> OUT) & 1
        (plain,) = np.nonzero(~kept[part])
        rows = part.start + plain
        for number, (axis, step) in enumerate(FACES):
            other = index[numbers[rows] + states.step(axis, step)]
            facing = 2 * (number ^ 1) + ((own[plain] >> IN) & 1)  # its bit of the other side
            kept[rows] |= (other >= 0) & ((shown[other] >> facing) & 1).astype(bool)

    for task in (show, keep):
        work.map(task, chunks(len(numbers), ROWS))
    index[numbers] = np.where((shown >> IN) & 1, INSIDE, OUTSIDE)
    order = np.flatnonzero(kept)
    order = order[np.argsort(numbers[order])]
    index[numbers[order]] = np.arange(len(order))
    return order, index


def sides(states: States, work: Work) -> np.ndarray:
    """Sides of unsampled bricks.

    Returns int32.
    """
    index = np.empty(states.flat.shape, np.int32)

    def task(part: slice) -> None:
        index[part] = np.where(states.flat[part] == EMPTY, np.int32(OUTSIDE), np.int32(INSIDE))

    work.map(task, chunks(len(index), RANGE))
    return index


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
