"""State of each brick during sampling, and the bricks that the surface crosses."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..work import Work, chunks
from .bricks import INSIDE, OUTSIDE

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


def distinct(numbers: np.ndarray) -> np.ndarray:
    """Sort flat indices and remove duplicates. `numpy.unique` uses hashes, which take five times as long.

    `numbers`: int [n]. Returns int [m].
    """
    ordered = np.sort(numbers)
    fresh = np.ones(len(ordered), bool)
    fresh[1:] = ordered[1:] != ordered[:-1]
    return np.asarray(ordered[fresh])


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
