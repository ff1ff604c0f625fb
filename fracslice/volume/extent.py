"""Bounds of an object: six proved sides, and the outermost points found by pattern search."""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass

import numpy as np

from .._native import Sides
from .._native import climb as climbed
from ..errors import EmptyError, VolumeError
from ..fields.box import Box, possible_cells
from ..fields.field import Field, Kernel
from ..fields.node import Node
from ..work import Work
from .bricks import values_at

SLANTS = np.stack(np.meshgrid((-1, 0, 1), (-1, 0, 1), 0.1 ** np.arange(0, 3.5, 0.5))).reshape(3, -1)
"""Steps straight along the last axis or slanted, [3, w]."""


def climb(
    kernel: Kernel, starts: np.ndarray, steps: np.ndarray, first: float, exact: float, work: Work
) -> np.ndarray:
    """Move interior points outwards as far as possible.

    Pattern search (Hooke and Jeeves 1961): a step is taken if it ends inside; if none does, the step length
    is halved.

    `starts`: float64 [3, n, k]; `steps`: [3, n, w]. Returns float64 [3, n, k].
    """
    work.check()
    starts, steps = np.ascontiguousarray(starts), np.ascontiguousarray(steps)
    return climbed(kernel.entry, starts, steps, SLANTS[2], first, exact, work.threads)


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

FINENESS = 4096
"""Accuracy of the proven sides, parts of the longest side, if `MOST` columns suffice; refined by `FINER`
while `LITTLE` suffice. The same for every use of the field: its size does not depend on a voxel.
"""

FINER = 16
LITTLE, MOST = 1 << 14, 1 << 17

CELLS = 1 << 18
"""Maximum number of cells in the proof that nothing is inside."""

PROVEN = 1e-6
"""Finest accuracy of the proven sides, as a fraction of the longest side: float32 proves nothing finer."""

EXACT = 2.5e-7
"""Last step of the outward search for tips, as a fraction of the longest side."""

SIGNS = np.repeat([-1, 1], 3)
"""Outward signs of the sides -x, -y, -z, x, y and z."""

STEPS = np.stack([sign * np.roll(SLANTS, side % 3 - 2, 0) for side, sign in enumerate(SIGNS)], 1)
"""Steps of the sides, [3, 6, w]."""

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


KEPT = 8
"""Number of formula trees whose extents are kept: jobs measure a scene for its size, depths and grid."""

_kept: OrderedDict[Node, Extent] = OrderedDict()


def extent(root: Field, work: Work | None = None) -> Extent:
    """Compute the bounds of the points where a field is negative, a property of the field alone.

    The Lipschitz bound of the field proves that nothing is farther than a `FINENESS`th of the longest side
    outside the box. Where that proof is too expensive (the bound is far too large, the feature is as thin as
    paper) the outer box is larger. Smooth faces, edges and tips are located to 1e-6 of the longest side. The
    box that the formulas state is doubled while the object leaves it: an offset or smooth union of a field
    that underestimates distances can.

    Parameters
    ----------
    root
        Field.
    work
        Execution settings.

    Returns
    -------
    Extent
        Bounds and outermost points; kept for the last formula trees.

    Raises
    ------
    SceneError
        For an element without an end.
    VolumeError
        If nothing is inside or the object is unbounded.
    Cancelled
        If the job was cancelled.
    """
    if not isinstance(root, Node):
        return _measured(root, work)
    result = _kept.pop(root, None) or _measured(root, work)
    _kept[root] = result
    while len(_kept) > KEPT:
        _kept.popitem(last=False)
    return result


def _measured(root: Field, work: Work | None) -> Extent:
    """See `extent`."""
    box, result = root.bounds.box, None
    if box.empty:
        raise VolumeError("the scene is empty: its elements have no point in common")
    if not box.finite:
        *axes, last = (a for a, s in zip("xyz", box.size, strict=True) if not np.isfinite(s))
        along = f"{', '.join(axes)} and {last}" if axes else last
        state = "".join(f", or state the box of {n} with @{n}.bounds" for n in root.bounds.boxless[:1])
        message = f"has no end along {along}; put <bounds> around it{state}"
        raise _endless(root.tree).fail(message) if root.tree else VolumeError(f"the field {message}")
    if (tips := root.tips) is not None:
        outer = _box(np.diagonal(tips.reshape(3, 2, 3), axis1=0, axis2=2))
        return Extent(outer, outer.grown(EXACT * max(outer.size)), tips)
    search = _Search(root, work or Work())
    for _ in range(TURNS):
        result = search.extent(box)
        if result and max(result.outer.size) > max(box.size) / 2:
            return result
        box = result.outer if result else box.grown(max(box.size) / 2)
    if not result:
        raise VolumeError("the object has no end that could be found; put <bounds> around it")
    return result


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
    within, search = _box(np.stack([points.min(1), points.max(1)])), _Search(root, work or Work())
    sides = search.sides(within)
    beneath = -voxel * BENEATH * SIGNS[:, None]
    near = points[:, None, :, None] + np.eye(3)[:, np.arange(6) % 3, None, None] * beneath[None, :, None]
    near = near.reshape(3, 6, -1)
    sides.learn(np.where(search.inside(near), near, np.nan))
    search.climb(sides, voxel / 2, EXACT * max(within.size))
    known = np.where(np.isfinite(sides.known), sides.known, sides.above)
    return within | _box((SIGNS * known).reshape(2, 3))


def _endless(node: Node) -> Node:
    """Innermost element without an end."""
    inner = next((child for child in node.fields if not child.bounds.box.finite), None)
    return _endless(inner) if inner else node


class _Search:
    """Search for the sides of a field's object."""

    def __init__(self, root: Field, work: Work) -> None:
        conservative = root.conservative()
        self.kernel, self.work, bounds = root.kernel(), work, conservative.bounds
        self.far = not bounds.exterior_only
        self.free, self.lipschitz = conservative.kernel(), bounds.lipschitz

    def sides(self, region: Box) -> Sides:
        """Sides of the object within a box."""
        bound = self.free.entry, self.lipschitz, self.far
        return Sides(self.kernel.entry, *bound, region.lo, region.hi, self.work.threads)

    def inside(self, points: np.ndarray) -> np.ndarray:
        """Mask of the interior points, bool [...], of points [3, ...]."""
        mask: np.ndarray = values_at(self.kernel, points.reshape(3, -1), self.work) < 0
        return mask.reshape(points.shape[1:])

    def why_empty(self, box: Box) -> str:
        """Message that nothing was found inside: a proof that all is outside, or what may be the case."""
        if possible_cells(lambda points: self.free.points(*points), self.lipschitz, box, CELLS)[0].size:
            return "there is no surface: no point is inside; expected thicker parts or less cut away"
        return "the scene is empty: every point is outside; expected less cut away"

    def climb(self, sides: Sides, first: float, exact: float) -> None:
        """Move the tips of all sides outwards."""
        sides.learn(climb(self.kernel, sides.best, STEPS, first, exact, self.work))

    def extent(self, box: Box) -> Extent | None:
        """Extent of the object if `box` contains it, else None."""
        longest = max(box.size) or 1.0
        sides = self.sides(box.grown(MARGIN * longest))
        cells = (np.indices((FIRST,) * 3).reshape(3, -1) + SHIFT) / FIRST
        points = np.array(box.lo)[:, None] + cells * np.array(box.size)[:, None]
        _learn(sides, points[:, self.inside(points)])
        step, exact = longest / FIRST, EXACT * longest
        aim, finest, most = longest / FINENESS, PROVEN * longest, MOST
        for share in () if self.far else BOLD:
            self.climb(sides, step, exact)
            sides.guess(share, exact, LITTLE)
        while True:
            self.climb(sides, step, exact)
            sides.prove(aim, most)
            if not np.isfinite(sides.known).all():
                raise EmptyError(self.why_empty(box))
            _learn(sides, sides.best[:, :, 0])
            if aim <= finest or (sides.spent >= LITTLE).all():
                break
            step, aim, most = aim, max(aim / FINER, finest), LITTLE
        self.climb(sides, aim, exact)
        limits, longest_out = np.array([box.lo, box.hi]), MARGIN / 2 * longest
        reach, above = ((SIGNS * heights).reshape(2, 3) for heights in (sides.known, sides.above))
        outwards = SIGNS.reshape(2, 3)
        if (outwards * (reach - limits) > longest_out).any():
            return None
        inner = _box(np.where(np.abs(reach - limits) <= 2 * exact, limits, reach + outwards * exact / 2))
        outer = _box(above) | inner.grown(exact)
        return Extent(inner, outer.about(inner.centre), np.ascontiguousarray(sides.best[:, :, 0]))


def _learn(sides: Sides, points: np.ndarray) -> None:
    """Add interior points [3, n] to all sides."""
    sides.learn(np.ascontiguousarray(np.broadcast_to(points[:, None], (3, 6, points.shape[1]))))


def _box(corners: np.ndarray) -> Box:
    lo, hi = corners.tolist()
    return Box(tuple(lo), tuple(hi))
