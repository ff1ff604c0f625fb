"""How large the object itself is: what is proved of its six sides, and how near it comes to that."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..errors import VolumeError
from ..formulas.box import Box
from ..kernel import Field
from ..work import Work
from .climbing import SLANTS, climb
from .sides import UNKNOWN, FreeSpace, Side

TURNS = 8
"""How often what is searched is made larger, for the object goes on there, or smaller."""

MARGIN = 1 / 14
"""Of the longest side: how far beyond the box that formulas promise is searched."""

FIRST = 16
"""Points along each axis that are looked at first."""

SHIFT = np.array([[0.5497], [0.2451], [0.4302]])
"""Of a step: where they lie, which is in no plane of symmetry."""

BOLD = 0.15, 0.4
"""Of the bound of an escape-time fractal, by which its values are a fifth of the distance: shares by
which its tips are looked for before anything is proved.
"""

SHARE = 0.25
"""Of a voxel: how near sides are proved, if `MOST` columns do; and `FINER` times finer while `LITTLE` do."""

FINER = 16
LITTLE, MOST = 1 << 14, 1 << 17

EXACT = 2.5e-7
"""Of the longest side: the last step that tips are taken outwards."""

OUTWARDS = np.array([[-1], [1]])
BENEATH = np.array([0.0, 1e-3, 0.01, 0.1, 0.5])
"""Voxels beneath a vertex: the first of them that is inside is where its body is entered."""


@dataclass(frozen=True, eq=False)
class Extent:
    """The object's box, as near as it was found; one with the same middle that surely encloses it; and the
    points of the object that are farthest out along -x, -y, -z, x, y and z: float64 [3, 6].
    """

    box: Box
    outer: Box
    tips: np.ndarray


def extent(root: Field, resolution: float, work: Work | None = None) -> Extent:
    """The box of the points where a scene's field is negative.

    resolution: voxels along the longest side. Nothing is farther than a quarter of a voxel outside the box,
    as the scene's bound proves; where that takes too much (a bound that is far too large, something as thin
    as paper) the outer box is larger. Smooth faces, edges and tips are found to 1e-6 of the longest side. The
    box that the formulas promise is doubled as long as the object goes on beyond it (an offset or smooth
    union of a field that underestimates distances can). Raises `VolumeError` if nothing is inside, or the
    object has no end.
    """
    box, found = root.bounds.box, None
    if box.empty:
        raise VolumeError("the scene is empty: its elements have no point in common")
    if not box.finite:
        *axes, last = (a for a, s in zip("xyz", box.size, strict=True) if not np.isfinite(s))
        along = f"{', '.join(axes)} and {last}" if axes else last
        state = "".join(f", or state the box of {n} with @{n}.bounds" for n in root.bounds.boxless[:1])
        raise VolumeError(f"the scene has no end along {along}; put <bounds> around it{state}")
    field = _free_space(root, work or Work())
    for _ in range(TURNS):
        found = _search(field, box, resolution)
        if found and max(found.outer.size) > max(box.size) / 2:
            return found
        box = found.outer if found else box.grown(max(box.size) / 2)
    if not found:
        raise VolumeError("the object has no end that could be found; put <bounds> around it")
    return found


def reached(root: Field, points: np.ndarray, voxel: float, work: Work | None = None) -> Box:
    """The box of what is connected with points on or near an object's surface, as near as it was found.

    points: float64 [3, n], scene units. From those that are inside, or from half a voxel beneath those that
    are not, steps of less than a voxel go outwards.
    """
    field = _free_space(root, work or Work())
    found = _box(np.stack([points.min(1), points.max(1)]))
    exact = EXACT * max(found.size)
    sides = _sides(field, found)
    for side in sides:
        beneath = np.zeros((3, len(BENEATH)))
        beneath[side.axis] = -side.sign * voxel * BENEATH
        near = (points[:, :, None] + beneath[:, None]).reshape(3, -1)
        side.learn(near[:, field.inside(near)])
    _climb(field, sides, voxel / 2, exact)
    known = [s.known if np.isfinite(s.known) else s.above for s in sides]
    return found | _box(OUTWARDS * np.reshape(known, (2, 3)))


def _free_space(root: Field, work: Work) -> FreeSpace:
    conservative = root.conservative()
    bounds = conservative.bounds
    return FreeSpace(root.kernel(), conservative.kernel(), bounds.lipschitz, not bounds.exterior_only, work)


def _sides(field: FreeSpace, region: Box) -> list[Side]:
    """In the order of an extent's tips."""
    return [Side(field, region, axis, sign, UNKNOWN) for sign in (-1, 1) for axis in range(3)]


def _search(field: FreeSpace, box: Box, resolution: float) -> Extent | None:
    """The object's extent, if it is in `box`; None if it goes on beyond it."""
    longest = max(box.size) or 1.0
    sides = _sides(field, box.grown(MARGIN * longest))
    cells = (np.indices((FIRST,) * 3).reshape(3, -1) + SHIFT) / FIRST
    points = np.array(box.lo)[:, None] + cells * np.array(box.size)[:, None]
    _learn(sides, points[:, field.inside(points)])
    step, aim, exact, most = longest / FIRST, SHARE * longest / resolution, EXACT * longest, MOST
    for share in () if field.far else BOLD:
        _climb(field, sides, step, exact)
        for side in sides:
            side.guess(share, exact, LITTLE)
    while True:
        _climb(field, sides, step, exact)
        for side in sides:
            side.prove(aim, most)
        if not np.isfinite([side.known for side in sides]).all():
            raise VolumeError("there is no surface: nothing in the scene is inside")
        _learn(sides, np.stack([side.tip for side in sides], 1))
        if aim <= exact or all(side.spent >= LITTLE for side in sides):
            break
        step, aim, most = aim, max(aim / FINER, exact), LITTLE
    _climb(field, sides, aim, exact)
    limits = np.array([box.lo, box.hi])
    reach = OUTWARDS * np.reshape([side.known for side in sides], (2, 3))
    above = OUTWARDS * np.reshape([side.above for side in sides], (2, 3))
    if (OUTWARDS * (reach - limits) > MARGIN / 2 * longest).any():
        return None
    found = _box(np.where(np.abs(reach - limits) <= 2 * exact, limits, reach + OUTWARDS * exact / 2))
    outer = _box(above) | found.grown(exact)
    return Extent(found, outer.about(found.centre), np.stack([side.tip for side in sides], 1))


def _learn(sides: list[Side], points: np.ndarray) -> None:
    for side in sides:
        side.learn(points)


def _climb(field: FreeSpace, sides: list[Side], first: float, exact: float) -> None:
    """Takes all sides' tips outwards as far as they go."""
    ways = np.stack([side.sign * np.roll(SLANTS, side.axis - 2, 0) for side in sides], 1)
    here = climb(field.inside, np.stack([side.best for side in sides], 1), ways, first, exact)
    for side, points in zip(sides, here.swapaxes(0, 1), strict=True):
        side.learn(points)


def _box(corners: np.ndarray) -> Box:
    lo, hi = corners.tolist()
    return Box(tuple(lo), tuple(hi))
