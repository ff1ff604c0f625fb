"""From an object to one that prints: each change is measured on samples of what the ones before it left.

Lengths are measured on samples, never taken from values, so a millimetre is a millimetre for any formula.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from ..errors import VolumeError
from ..formulas import Box, Node, box, cylinder, plane, transform
from ..kernel import Compilable
from ..scene import Print
from ..volume import Bricks, Plan, extent, sample_scene
from ..volume.grid import from_grid, to_grid
from ..work import Work
from .edits import edited

# What measures needs Numba and SciPy, which take as long to load as a small mesh: only where it is used.
if TYPE_CHECKING:
    from .components import Components, Connected
    from .samples import Samples

COARSE, FINE = 128, 640
"""Samples along the longest side that distances are measured on, at least and at most."""

SHARP = 6
"""Samples across what is to be thickened, closed or left standing, if the finest grid has as many."""

DUST = 1e-5
"""The share of the whole below which a body is dust: no strut is built to it, it is dropped."""

POCKET = 0.1
"""The share of the largest part of a hollow below which another one is not worth two holes."""

THIN = 1.0
"""mm2 of walls or gaps that samples may miss, from which finer ones are taken."""


Measure = Callable[[Plan], Box]


def printable(
    planned: Plan, size: float, how: Print, work: Work | None = None, measure: Measure | None = None
) -> tuple[Plan, float]:
    """A planned scene made printable, and its scale in mm per scene unit.

    size: mm, the longest side of what stays. measure: of an object, what box will be called its size, if not
    that of its field: a mesh has not all tips of a fractal. Samples with the voxel of `planned` are at the
    same points before and after. Raises `VolumeError` where nothing would be left, or a length is too small
    to be measured or larger than the object, `Cancelled`.
    """
    for name in ("bridge", "gap", "thickness", "hollow", "drain", "base", "raft"):
        if (length := getattr(how, name)) > size and (name != "drain" or how.hollow):
            raise VolumeError(f"{name} {length:g} mm: expected at most the object's size, {size:g} mm")
    run = _Run(planned, size, how, work or Work(), measure)
    for stage, change in run.changes():
        run.work.check()
        run.work.progress(stage, 0.0)
        run.put(change())
        run.work.progress(stage, 1.0)
    if (how.base or how.raft) and run.grown:
        run.weigh()
    return _standing(run.planned, how, run.scale), run.scale


@dataclass
class _Run:
    """The object as it is so far."""

    planned: Plan
    size: float
    how: Print
    work: Work
    measure: Measure | None
    scale: float = 1.0
    """mm per scene unit, known when it is known which bodies stay."""
    known: Connected | None = None
    """What is connected, once it was looked at."""

    @property
    def thing(self) -> Node | Compilable:
        return self.planned.root

    def put(self, thing: Node | Compilable) -> None:
        """The object is this now."""
        self.planned = replace(self.planned, root=thing)

    def bound(self) -> None:
        """Finds how large the object is now."""
        found = extent(self.thing, max(self.planned.box.size) / self.planned.voxel, self.work)
        self.planned = replace(self.planned, box=found.box, outer=found.outer, tips=found.tips)

    def weigh(self) -> None:
        """Its box is what is called its size."""
        if self.measure:
            self.planned = replace(self.planned, box=self.measure(self.planned))

    @property
    def grown(self) -> bool:
        """Whether something is added to its outside."""
        return bool(self.how.bridge or self.how.thickness)

    def changes(self) -> Iterator[tuple[str, Callable[[], Node | Compilable]]]:
        """What is asked for, in order."""
        how = self.how
        if how.cavities == "fill":
            yield "filling cavities", self.filled
        if how.keep == "largest":
            before = self.thing
            yield "keeping the largest", self.largest
            if self.thing is not before:
                self.bound()
        self.weigh()
        self.scale = self.size / max(self.planned.box.size)
        if how.gap:
            yield "closing gaps", self.closed
        if how.thickness:
            yield "thickening", self.thickened
        if how.bridge:
            yield "bridging", self.bridged
        if self.grown:
            middle = self.planned.outer.centre
            self.bound()
            self.planned = replace(self.planned, outer=self.planned.outer.about(middle))
            if how.thickness and self.known and self.known.solid.voxel < self.planned.voxel:
                yield "filling pores", self.unsealed
        if how.hollow:
            yield "hollowing", self.hollowed

    def sampled(self, length: float = np.inf) -> Bricks:
        """Samples of the object as it is, fine enough for a length in mm."""
        samples = min(max(COARSE, SHARP * self.size / length), FINE)
        if length < 2 * self.size / samples:
            least = 2 * self.size / samples
            raise VolumeError(f"{length:g} mm in {self.size:g} mm: expected at least {least:.3g} mm, or 0")
        from .connectivity import shown

        return shown(self.thing, self.planned.outer, max(self.planned.box.size), samples, self.work)

    def connected(self) -> Connected:
        """Samples that tell what is connected, and what is: taken once, for cavities, bodies and bridges."""
        from .components import Connected, components_of
        from .connectivity import resolved

        if self.known is None:
            coarse = self.sampled()
            found = components_of(coarse)
            unit = max(self.planned.box.size) / self.size
            bricks = resolved(self.thing, coarse, THIN * unit**2, len(_large(found)) > 1, self.work)
            self.known = Connected(bricks, found if bricks is coarse else components_of(bricks))
        return self.known

    def seen(self, length: float) -> Samples:
        """The same, as a field between the samples."""
        from .samples import Samples

        return Samples(self.sampled(length))

    def filled(self) -> Node | Compilable:
        """The space that nothing reaches becomes solid."""
        return self.without(self.connected().components.cavities)

    def without(self, cavities: np.ndarray) -> Node | Compilable:
        """These become solid."""
        from .border import nearer

        if not len(cavities):
            return self.thing
        found = self.connected()
        self.known = found.filled(cavities)
        return edited(self.thing, "add", nearer(found, cavities, np.array([0])))

    def largest(self) -> Node | Compilable:
        """Only the largest body stays."""
        from .border import nearer

        found = self.connected()
        bodies = found.components.bodies
        if len(bodies) == 1:
            return self.thing
        return edited(self.thing, "keep", nearer(found, bodies[:1], bodies[1:]))

    def bridged(self) -> Node | Compilable:
        """Struts between bodies, as few and as short as can be, and no dust."""
        from .border import nearer
        from .bridges import struts
        from .capsules import capsules

        found = self.connected()
        large = _large(found.components)
        dust = np.setdiff1d(found.components.bodies, large)
        start, end = struts(found.solid, found.components, large)
        if len(dust):
            self.put(edited(self.thing, "cut", nearer(found, dust, large)))
        if not len(start):
            return self.thing
        width = max(self.how.bridge, self.how.thickness) / self.scale
        return self.with_capsules(capsules(start, end, width / 2, found.solid), width)

    def unsealed(self) -> Node | Compilable:
        """What only samples as far apart as a mesh's seal becomes solid."""
        from .components import Connected

        fine, self.known = self.known, Connected.of(sample_scene(self.planned, self.work))
        return self.without(self.known.sealed(fine)) if fine else self.thing

    def closed(self) -> Node | Compilable:
        """Gaps are filled from face to face."""
        from .capsules import capsules
        from .thin_features import all_walls

        solid = self.seen(self.how.gap)
        found = all_walls(self.thing, solid, self.how.gap / self.scale, self.work, gaps=True)
        one = _apart(found.middle, solid.bricks.voxel)
        if not len(one):
            return self.thing
        radius = solid.bricks.voxel
        made = capsules(found.start[one], found.end[one], radius, solid.bricks)
        return self.with_capsules(made, 2 * radius)

    def thickened(self) -> Node | Compilable:
        """Balls as wide as the least thickness along the middle of all walls that are thinner: what opening
        with such a ball would take away (Serra 1982), along the part of the medial axis between opposite
        faces. Pores that they seal are filled.
        """
        from .capsules import capsules
        from .components import Connected
        from .samples import together
        from .thin_features import all_walls

        solid, least = self.seen(self.how.thickness), self.how.thickness / self.scale
        middle = all_walls(self.thing, solid, least, self.work).middle
        middle = middle[_apart(middle, solid.bricks.voxel)]
        if not len(middle):
            return self.thing
        balls = capsules(middle, middle, least / 2, solid.bricks)
        self.put(self.with_capsules(balls, least))
        before = Connected.of(solid.bricks)
        self.known = Connected.of(together(solid.bricks, balls.bricks))
        return self.without(self.known.sealed(before))

    def with_capsules(self, made: Samples, width: float) -> Node | Compilable:
        """With capsules so wide, which may join what was apart."""
        self.known = None
        self.planned = replace(self.planned, outer=self.planned.outer.grown(width))
        return edited(self.thing, "add", made)

    def hollowed(self) -> Node | Compilable:
        """Everything farther inside than the walls are thick is taken away, and two holes made into each part
        of that. With holes, parts under `POCKET` of the largest stay solid.
        """
        from .components import Connected, components_of
        from .samples import Samples, positions

        swept = to_grid(self.sampled(self.how.hollow)).redistance()
        hollow = from_grid(swept.offset(-self.how.hollow / self.scale))
        found = Connected(hollow, components_of(hollow))
        numbers, count = found.components.bodies, found.components.count
        if not len(numbers):
            raise VolumeError(f"walls of {self.how.hollow:g} mm leave nothing to hollow out")
        if not self.how.drain:
            return edited(self.thing, "cut", Samples(hollow))
        large = count[numbers] >= POCKET * count[numbers[0]]
        thing = edited(self.thing, "cut", Samples(found.without(numbers[~large])))
        for number in numbers[large]:
            at = (found.components.labels == number) & (hollow.values > -hollow.voxel)
            points = np.array(hollow.origin) + hollow.voxel * positions(hollow, *np.nonzero(at))
            for hole in self.drains(points, -hollow.values[at]):
                thing = edited(thing, "cut", hole)
        return thing

    def drains(self, hollow: np.ndarray, depth: np.ndarray) -> Iterator[Node]:
        """From the hollow's lowest point to the nearer side along x: one downwards would be shut by the
        plate. And from its highest point upwards, which hangs lowest on the printer. hollow: points in it,
        next to its wall, [n, 3]; depth: how far they are from it.
        """
        radius, outer = self.how.drain / self.scale / 2, self.planned.outer
        lowest, highest = (hollow[:, 2] - depth).argmin(), (hollow[:, 2] + depth).argmax()
        x, y, z = hollow[lowest].tolist()
        z -= float(depth[lowest])
        to = outer.hi[0] + radius if x - outer.lo[0] > outer.hi[0] - x else outer.lo[0] - radius
        side = cylinder(radius=radius, height=abs(to - x))
        yield transform(side, rotate=(0, 1, 0, 90), translate=((x + to) / 2, y, z + radius))
        x, y, z = hollow[highest].tolist()
        low, high = z - radius, outer.hi[2] + radius
        yield transform(cylinder(radius=radius, height=high - low), translate=(x, y, (low + high) / 2))


def _apart(points: np.ndarray, voxel: float) -> np.ndarray:
    """Numbers of points of which no two are in the same quarter of a voxel, along x, then y, then z."""
    if not len(points):
        return np.empty(0, np.int64)
    cells = np.round(4 * points / voxel).astype(np.int64)
    cells -= cells.min(0)
    _, first = np.unique(np.ravel_multi_index(tuple(cells.T), tuple(cells.max(0) + 1)), return_index=True)
    return np.asarray(first)


def _large(components: Components) -> np.ndarray:
    """The numbers of the bodies that are no dust."""
    bodies = components.bodies
    return np.asarray(bodies[components.count[bodies] > DUST * components.count[components.inside].sum()])


def _standing(made: Plan, how: Print, scale: float) -> Plan:
    """With its bottom cut off and a raft under it.

    The raft reaches a tenth of the longest side beyond the object, and half its height into it.
    """
    thing, found, outer = made.root, made.box, made.outer
    (x0, y0, z0), (x1, y1, z1) = found.lo, found.hi
    base, raft = how.base / scale, how.raft / scale
    if 0 < raft < made.voxel:
        raise VolumeError(
            f"a raft of {how.raft:g} mm: expected at least a voxel, {made.voxel * scale:.4g} mm"
        )
    if base:
        z0 += base
        if z0 >= z1:
            raise VolumeError(f"a base of {base * scale:g} mm leaves nothing of the object")
        thing = edited(thing, "keep", plane(normal=(0, 0, -1), offset=-z0))
        found = Box((x0, y0, z0), (x1, y1, z1))
    if raft:
        rim = max(found.size) / 10
        lying = Box((x0 - rim, y0 - rim, z0 - raft / 2), (x1 + rim, y1 + rim, z0 + raft / 2))
        thing = edited(thing, "add", transform(box(size=lying.size), translate=lying.centre))
        found, outer = found | lying, (outer | lying).about(outer.centre)
    return replace(made, root=thing, box=found, outer=outer)
