"""Sampled bricks that the surface crosses."""

from __future__ import annotations

import numpy as np

from ..work import Work, chunks
from .bricks import INSIDE, OUTSIDE
from .faces import FACES, SignFaces
from .states import EMPTY, RANGE, States

ROWS = 1 << 15
"""Bricks per task."""

IN, OUT = 12, 13
"""Bits of bricks with interior and with exterior samples, behind two bits of each face."""


def crossed(
    states: States, numbers: np.ndarray, signs: np.ndarray, work: Work
) -> tuple[np.ndarray, np.ndarray]:
    """Find the bricks that are touched by a grid edge with a sign change.

    Parameters
    ----------
    states
        States of all bricks.
    numbers
        Flat indices of the sampled bricks, int [n].
    signs
        Their sign bits, uint8 [n, 8, 8].
    work
        Execution settings.

    Returns
    -------
    ndarray
        Rows of these bricks among the sampled ones, by ascending flat index, int [k].
    ndarray
        Number of each of them, and the side of each other brick, int32, like `states.flat`.
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

    Returns
    -------
    ndarray
        `OUTSIDE` or `INSIDE`, int32, like `states.flat`.
    """
    index = np.empty(states.flat.shape, np.int32)

    def task(part: slice) -> None:
        index[part] = np.where(states.flat[part] == EMPTY, np.int32(OUTSIDE), np.int32(INSIDE))

    work.map(task, chunks(len(index), RANGE))
    return index
