"""Bounds of an object: six proven sides, and the outermost points found."""

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
"""Attempts to enlarge the searched box because the object leaves it, or to shrink it."""

MARGIN = 1 / 14
"""Margin searched beyond the box that the formulas state, as a fraction of the longest side."""

FIRST = 16
"""Points along each axis tested first."""

SHIFT = np.array([[0.5497], [0.2451], [0.4302]])
"""Position of these points within a step; it lies in no plane of symmetry."""

BOLD = 0.15, 0.4
"""Fractions of the Lipschitz bound of an escape-time fractal, whose values are a fifth of the distance, for
the search for tips before anything is proven.
"""

SHARE = 0.25
"""Accuracy of the proven sides in voxels, if `MOST` columns suffice; refined by `FINER` while `LITTLE`
suffice.
"""

FINER = 16
LITTLE, MOST = 1 << 14, 1 << 17

EXACT = 2.5e-7
"""Last step of the outward search for tips, as a fraction of the longest side."""

OUTWARDS = np.array([[-1], [1]])
"""Signs of the lower and upper sides."""

BENEATH = np.array([0.0, 1e-3, 0.01, 0.1, 0.5])
"""Depths beneath a vertex in voxels, tested for an interior point."""


@dataclass(frozen=True, eq=False)
class Extent:
    """Bounds of an object.

    Attributes
    ----------
    box
        Approximate bounds, scene units.
    outer
        Conservative bounds with the same centre, scene units.
    tips
        Outermost points of the object along -x, -y, -z, x, y and z, float64 [3, 6], scene units.
    """

    box: Box
    outer: Box
    tips: np.ndarray


def extent(root: Field, resolution: float, work: Work | None = None) -> Extent:
    """Compute the bounds of the points where a field is negative.

    The Lipschitz bound of the field proves that nothing is farther than a quarter of a voxel outside the box.
    Where that proof is too expensive (the bound is far too large, the feature is as thin as paper) the outer
    box is larger. Smooth faces, edges and tips are located to 1e-6 of the longest side. The box that the
    formulas state is doubled while the object leaves it: an offset or smooth union of a field that
    underestimates distances can.

    Parameters
    ----------
    root
        Field.
    resolution
        Voxels along the longest side.
    work
        Execution settings.

    Returns
    -------
    Extent
        Bounds and outermost points.

    Raises
    ------
    VolumeError
        If nothing is inside or the object is unbounded.
    Cancelled
        If the job was cancelled.
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
    """Compute the approximate bounds of the components that contain some points on or near the surface.

    The search steps outwards by less than a voxel, from the points inside or, where a point is outside, from
    at most half a voxel beneath it.

    Parameters
    ----------
    root
        Field.
    points
        Points on or near the surface, float64 [3, n], scene units.
    voxel
        Voxel size, scene units.
    work
        Execution settings.

    Returns
    -------
    Box
        Bounds, scene units.
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
    """Six sides in the order of the tips of an extent."""
    return [Side(field, region, axis, sign, UNKNOWN) for sign in (-1, 1) for axis in range(3)]


def _search(field: FreeSpace, box: Box, resolution: float) -> Extent | None:
    """Extent of the object if `box` contains it, else None."""
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
    """Move the tips of all sides outwards."""
    ways = np.stack([side.sign * np.roll(SLANTS, side.axis - 2, 0) for side in sides], 1)
    here = climb(field.inside, np.stack([side.best for side in sides], 1), ways, first, exact)
    for side, points in zip(sides, here.swapaxes(0, 1), strict=True):
        side.learn(points)


def _box(corners: np.ndarray) -> Box:
    lo, hi = corners.tolist()
    return Box(tuple(lo), tuple(hi))
