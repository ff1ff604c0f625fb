"""Field edits: one field changed by another, its own values kept exact; hollows and the holes that drain
them; the part of a scene around the bodies that stay.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np

from ..common.cache import key
from ..fields.box import Box
from ..fields.devices import ArrayField
from ..fields.field import Bounds, Cells, Device, Field, Kernel, Precision
from ..formulas import Node, cylinder, difference, intersection, transform, union
from ..formulas import box as box_node
from ..volume import Bricks, Drain, Plan, extent
from ..volume.amount import Sizing, box_of_the_rest
from ..volume.bricks import from_grid, to_grid
from ..work import Work
from .bridging import clusters, nearer
from .thin_features import resolve_connectivity, sampled_object
from .walls import Samples, SolidComponents, components_of, positions

Does = Literal["cut", "add", "keep"]
_FOLDED = {"cut": difference, "add": union, "keep": intersection}


@dataclass(frozen=True, eq=False)
class EditedField(ArrayField):
    """A field changed by another field."""

    root: Field  # the field to change
    does: Does  # subtract the other field's inside, add it, or intersect with it
    shape: Field  # the other field

    @cached_property
    def bounds(self) -> Bounds:
        """Bounds of both fields together; the box encloses an added shape."""
        own, other = self.root.bounds, self.shape.bounds
        return Bounds(
            own.box | other.box if self.does == "add" else own.box,
            max(own.lipschitz, other.lipschitz),
            own.exterior_only or other.exterior_only,
            max(own.steepening, other.steepening),
            own.boxless,
            tuple(dict.fromkeys([*own.measured, *other.measured])),
        )

    @property
    def key(self) -> str:
        """`Field.key`."""
        return key(self.root.key, self.does, self.shape.key)

    @property
    def proved_box(self) -> Box:
        """`Field.proved_box`."""
        own = self.root.proved_box
        return own | self.shape.proved_box if self.does == "add" else own

    def conservative(self) -> EditedField:
        """`Field.conservative`. A cut shape stays exact: a conservative one would cut too much."""
        shape = self.shape if self.does == "cut" else self.shape.conservative()
        return EditedField(self.root.conservative(), self.does, shape)

    def cells(self, precision: Precision = "float32") -> Cells | None:
        """`Field.cells`."""
        root, shape = self.root.cells(precision), self.shape.cells(precision)
        return _CompositeCells(root, self.does, shape) if root and shape else None

    def kernel(self, device: Device = "cpu", precision: Precision = "float32") -> Kernel:
        """`Field.kernel`, always on the CPU."""
        return _Composite(self.root.kernel("cpu", precision), self.does, self.shape.kernel("cpu", precision))


@dataclass(frozen=True, eq=False)
class _CompositeCells:
    """`fields.field.Cells` of an edited field."""

    root: Cells
    does: Does
    shape: Cells

    def __call__(self, centres: np.ndarray, half: float) -> tuple[np.ndarray, np.ndarray]:
        (empty, full), (no, yes) = self.root(centres, half), self.shape(centres, half)
        if self.does == "cut":
            no, yes = yes, no
        return (empty & no, full | yes) if self.does == "add" else (empty | no, full & yes)


class _Composite(Kernel):
    """Kernel of an edited field."""

    def __init__(self, root: Kernel, does: Does, shape: Kernel) -> None:
        self.dtype, self.batch = root.dtype, min(root.batch, shape.batch)
        self._root, self._does, self._shape = root, does, shape

    def points(self, x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
        """`Kernel.points`."""
        f, g = self._root.points(x, y, z), self._shape.points(x, y, z)
        change = np.minimum if self._does == "add" else np.maximum
        changed: np.ndarray = change(f, -g if self._does == "cut" else g)
        return changed


def edited_field(root: Field, does: Does, shape: Field) -> Field:
    """Apply an edit to a field."""
    if root.tree and shape.tree:
        return _FOLDED[does](root.tree, shape.tree)
    return EditedField(root, does, shape)


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


SAMPLES = 128, 384, 640
"""Samples along the longest side, as many as it takes to tell bodies from crumbs of thin walls."""

MARGIN = 4
"""Minimum margin around the bodies, samples."""

SPARE = 0.1
"""Margin around the bodies for tips thinner than a sample, as a fraction of their longest side."""

FRAMED = 0.75
"""Size of the part around the bodies, as a fraction of the sampled part, that ends the search."""

ROUNDS = 16
"""Maximum number of parts that are sampled, each within the one before."""


def frame_bodies(planned: Plan, size: Sizing, count: int, work: Work) -> Plan:
    """Plan the part of a scene around its largest bodies.

    The size of the object is that of the bodies that stay. Bodies that are much smaller than the whole scene
    need samples of their own: the part around them is sampled again, until they fill it.

    The voxel in mm is that of `planned`.
    """
    made, region = planned, planned.outer
    for _ in range(ROUNDS):
        components = _resolve_components(made, work)
        bodies = components.bodies
        if len(bodies) <= count:
            break
        chosen = components.box(bodies[:count])
        margin = max(MARGIN * components.solid.voxel, SPARE * max(chosen.size))
        near, part = (chosen.grown(by) & planned.outer for by in (margin / 2, margin))
        if region & near == near and max(part.size) > FRAMED * max(region.size):
            made = _keep_bodies(made, components, count, work)
            break
        frame = transform(box_node(size=part.size), translate=part.centre)
        made, region = _intersect_plan(planned, frame, max(part.size) / SAMPLES[0], work), part
    return replace(made, voxel=planned.voxel * size.scale(planned.box) / size.scale(made.box))


def _resolve_components(planned: Plan, work: Work) -> SolidComponents:
    """Components of samples that tell bodies from crumbs."""
    root, outer, longest = planned.root, planned.outer, max(planned.outer.size)
    for samples in SAMPLES:
        bricks = sampled_object(root, outer, longest, samples, work)
        components = components_of(bricks)
        if components.tells_bodies:
            return components
    return components_of(resolve_connectivity(root, bricks, 0.0, True, work))


def _keep_bodies(planned: Plan, components: SolidComponents, count: int, work: Work) -> Plan:
    """Plan with the exact box of the bodies that stay, cut off from those that touch them."""
    chosen, others = np.split(components.bodies, [count])
    cluster, voxel = clusters(components), components.solid.voxel
    if not planned.root.bounds.exterior_only and np.isin(cluster[others], cluster[chosen]).any():
        return _intersect_plan(planned, nearer(components, chosen, others), voxel, work)
    whole, rest = (np.array([b.lo, b.hi]) for b in map(components.box, (components.bodies, chosen)))
    seen, tips = replace(planned, voxel=voxel), components.outermost(chosen)
    return replace(planned, box=box_of_the_rest(seen, whole, rest, tips, work))


def _intersect_plan(planned: Plan, kept: Field, voxel: float, work: Work) -> Plan:
    """Plan of the part of a scene inside another field."""
    root = edited_field(planned.root, "keep", kept)
    extents = extent(root, work)
    return replace(planned, root=root, box=extents.box, outer=extents.outer, tips=extents.tips, voxel=voxel)
