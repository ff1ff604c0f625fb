"""Vertices that lie on no grid edge are brought to the surface, each within a box of its own."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..formulas.registry import Node
from ..kernel import Compilable, Kernel, compile_scene
from ..work import Work, chunks
from .roots import Roots
from .values import values_at

NEAR = 1e-6
"""A point with |f| below this share of a voxel is where it should be: a corner has no gradient to follow."""

FLAT = 0.1
"""Slopes below this are taken for it, so that no step is longer than ten times |f|."""

REACH = 1e-4
"""The step of the differences, in voxels. They are central, so that at an edge neither side is preferred."""


TIGHT = 1e-6
"""A point nearer to its box' border, in voxels, slides along it."""


@dataclass(frozen=True, eq=False)
class Rooms:
    """Where some points may go: low, high: corners of boxes, float64 [3, n], scene units; a box may be flat.
    other: points in the boxes or on their borders where the field has the other sign, or None.
    """

    low: np.ndarray
    high: np.ndarray
    other: np.ndarray | None = None


def settle(
    root: Node | Compilable,
    points: np.ndarray,
    rooms: Callable[[np.ndarray, np.ndarray], Rooms],
    voxel: float,
    work: Work | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Brings points to the zero set, never out of their boxes.

    points: float64 [n, 3], scene units. rooms: the rooms of those with these numbers, which are inside where
    the second argument says so. A point moves along the gradient if the field changes its sign there within
    four of Newton's steps and the box, else straight towards its room's point of the other sign. One that
    comes no nearer stays, and so does what lies on the surface already, such as an exact corner. Returns the
    numbers of those that did not, int64 [k], and where they are now, float64 [k, 3].
    """
    kernel, work = compile_scene(root, "float64"), work or Work()
    guess, exact = Roots(root, "float32", voxel), Roots(root, "float64", voxel)
    values = values_at(kernel, points.T, work)
    away = np.flatnonzero(np.abs(values) > NEAR * voxel)
    settled = np.empty((len(away), 3))

    def task(part: slice) -> None:
        which = guess.padded(away[part])
        p, f = np.ascontiguousarray(points[which].T), values[which]
        room = rooms(which, f < 0)
        ways = np.concatenate([p, _ends(kernel, p, f, room, voxel) - p])
        t, _, miss = exact.polished(ways, guess.found(ways.astype(np.float32)))
        left = np.flatnonzero(miss > NEAR)
        if len(left):
            left = exact.padded(left)
            slow = ways.take(left, 1)
            t[left], _, miss[left] = exact.polished(slow, exact.found(slow))
        moved = np.clip(p + t * ways[3:], room.low, room.high)
        nearer = miss * voxel < np.abs(f)
        settled[part] = np.where(nearer, moved, p).T[: part.stop - part.start]

    work.map(task, chunks(len(away), 1 << 13))
    return away, settled


def anywhere(which: np.ndarray, inside: np.ndarray) -> Rooms:
    """Rooms without borders."""
    return Rooms(np.full((3, len(which)), -np.inf), np.full((3, len(which)), np.inf))


def _ends(kernel: Kernel, p: np.ndarray, f: np.ndarray, room: Rooms, voxel: float) -> np.ndarray:
    """How far points [3, n] with these values are to be looked at, [3, n]."""
    x, y, z = p
    e = REACH * voxel
    ahead = kernel.points(x + e, y, z), kernel.points(x, y + e, z), kernel.points(x, y, z + e)
    behind = kernel.points(x - e, y, z), kernel.points(x, y - e, z), kernel.points(x, y, z - e)
    slope = (np.stack(ahead) - np.stack(behind)) / (2 * e)
    space = np.where((slope > 0) == (f < 0), room.high - p, p - room.low)
    slope *= space > TIGHT * voxel
    step = slope * (-4 * f / np.maximum((slope * slope).sum(0), FLAT**2))
    with np.errstate(divide="ignore", invalid="ignore"):
        end: np.ndarray = p + step * (space / np.abs(step)).min(0, where=step != 0, initial=1.0)
    if room.other is None:
        return end
    changes = (kernel.points(*end) < 0) != (f < 0)
    found: np.ndarray = np.where(changes, end, room.other)
    return found
