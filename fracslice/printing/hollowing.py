"""Hollows of an object, and the holes that drain them."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..fields.field import Field
from ..formulas import Box, Node, cylinder, transform, union
from ..volume import Bricks, Drain
from ..volume.bricks import from_grid, to_grid
from .components import components_of
from .samples import Samples, positions

POCKET = 0.1
"""Fraction of the largest hollow's volume below which another hollow stays solid instead of being drained."""


def hollows(solid: Bricks, wall: float, drain: float, outer: Box) -> tuple[list[Field], tuple[Drain, ...]]:
    """Hollows to cut, everything deeper than the wall, and two drain holes for each of them.

    With drain holes, hollows under `POCKET` of the largest stay solid.

    `wall`, `drain`, `outer` in scene units.
    """
    inner = from_grid(to_grid(solid).redistance().offset(-wall))
    components = components_of(inner)
    numbers, count = components.bodies, components.count
    if not len(numbers):
        return [], ()
    if not drain:
        return [Samples(inner)], ()
    large, holes = count[numbers] >= POCKET * count[numbers[0]], list[Drain]()
    for number in numbers[large]:
        at = (components.labels == number) & (inner.values > -inner.voxel)
        points = np.array(inner.origin) + inner.voxel * positions(inner, *np.nonzero(at))
        holes += _drains(points, -inner.values[at], drain / 2, outer, inner.voxel)
    cuts = [Samples(components.without(numbers[~large])), union(*map(_cylinder, holes))]
    return cuts, tuple(holes)


def _drains(
    hollow: np.ndarray, depth: np.ndarray, radius: float, outer: Box, voxel: float
) -> Iterator[Drain]:
    """Drain holes of one hollow: one sideways, one upwards.

    The first leads from the lowest point to the nearer side along x, as the plate would close a hole
    downwards. The second leads upwards from the highest point, which hangs lowest on the printer. hollow:
    points in the hollow next to its wall, [n, 3]. depth: their distances from the wall, [n].
    """
    (x, y, _), z = _middle(hollow, hollow[:, 2] - depth, voxel)
    to = outer.hi[0] + radius if x - outer.lo[0] > outer.hi[0] - x else outer.lo[0] - radius
    yield Drain((x, y, z + radius), (to, y, z + radius), radius)
    (x, y, _), z = _middle(hollow, -hollow[:, 2] - depth, voxel)
    yield Drain((x, y, -z - radius), (x, y, outer.hi[2] + radius), radius)


def _middle(points: np.ndarray, low: np.ndarray, voxel: float) -> tuple[list[float], float]:
    """Middle of the lowest points, within half a voxel, and the lowest value.

    The floor of a box has no lowest point. A hole in its corner would cut the box's edge. A middle that is
    farther than a voxel from all of them, as of a ring, is not over the floor: the nearest point then is.
    """
    floor = points[low <= low.min() + voxel / 2]
    middle = floor.mean(axis=0)
    away = np.square(floor - middle).sum(axis=1)
    at = middle if away.min() <= voxel**2 else floor[away.argmin()]
    return at.tolist(), float(low.min())


def _cylinder(drain: Drain) -> Node:
    """Cylinder of a drain hole, which runs along x or z."""
    (x, y, low), (to, _, high) = drain.start, drain.end
    if to != x:
        side = cylinder(radius=drain.radius, height=abs(to - x))
        return transform(side, rotate=(0, 1, 0, 90), translate=((x + to) / 2, y, low))
    return transform(cylinder(radius=drain.radius, height=high - low), translate=(x, y, (low + high) / 2))
