"""Preparation for printing: thickness, bridges, base and raft, each measured on samples of the previous
result.

Distances come from the field where its values are distances, else from its samples by fast sweeping (Zhao
2004): a millimetre is a millimetre for any formula.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from ..errors import VolumeError
from ..fields.field import Field
from ..formulas import Box, box, plane, transform
from ..records import DUST
from ..scene import Print
from ..volume import Bricks, Plan, extent, sample_scene
from ..volume.amount import Sizing
from ..volume.bricks import values_at
from ..work import Work
from .edits import edited_field
from .walls import SLACK, ThinWalls

if TYPE_CHECKING:
    from .walls import Samples, SolidComponents, Walls

# Measuring needs SciPy, whose import takes as long as a small mesh: import where needed.

COARSE, FINE = 128, 640
"""Minimum and maximum number of samples along the longest side for measuring lengths."""

SHARP = 6
"""Samples across a length to thicken, close or keep, as far as `FINE` permits."""

COVERED = 0.75**0.5
"""Distance of any point of a medial surface to the nearest middle of a wall, samples: rays start where grid
lines along the axis nearest to the normal cross the surface.
"""

THIN = 1.0
"""Area of walls or gaps that samples may miss, from which finer samples are taken, mm^2."""


@dataclass
class Preparation:
    """The object during its edits."""

    planned: Plan
    sizing: Sizing
    how: Print
    work: Work
    scale: float
    """mm per scene unit."""
    measured: bool = False
    """Whether walls that stay too thin are looked for."""
    known: SolidComponents | None = None
    """Components, once computed."""
    meshed: Bricks | None = None
    """Samples of the object as the mesh has them, once taken."""
    thin: Walls | None = None
    """Walls that thickening left thinner than the minimum thickness, if anything was thickened."""
    spot: float = 0.0
    """Distance of the samples that they were measured on, mm."""

    @property
    def size(self) -> float:
        """Approximate longest side, mm."""
        return self.sizing.longest

    @property
    def root(self) -> Field:
        """The current field."""
        return self.planned.root

    def put(self, root: Field) -> None:
        """Replace the current field."""
        self.planned = replace(self.planned, root=root)

    def bound(self) -> None:
        """Recompute the extent of the object."""
        extents = extent(self.root, self.work)
        self.planned = replace(self.planned, box=extents.box, outer=extents.outer, tips=extents.tips)

    def enlarged(self) -> None:
        """Recompute the extent around the same centre, so that samples stay at the same points."""
        middle = self.planned.outer.centre
        self.bound()
        self.planned = replace(self.planned, outer=self.planned.outer.about(middle))

    def sampled(self, length: float = np.inf) -> Bricks:
        """Samples of the current object, fine enough for a length in mm."""
        samples = min(max(COARSE, SHARP * self.size / length), FINE)
        if length < 2 * self.size / samples:
            least = 2 * self.size / samples
            raise VolumeError(
                f"a length of {length:g} mm is too small for an object of {self.size:g} mm: "
                f"expected at least {least:.3g} mm, or 0"
            )
        from .thin_features import sampled_object

        return sampled_object(self.root, self.planned.outer, max(self.planned.box.size), samples, self.work)

    def connected(self) -> SolidComponents:
        """Components of samples that resolve connectivity; shared by cavities, bodies and bridges."""
        from .walls import components_of

        if self.known is None:
            coarse = self.sampled()
            components = components_of(coarse)
            bricks = coarse if self.told(components) else self.resolved(coarse, components)
            self.known = components if bricks is coarse else components_of(bricks)
        return self.known

    def told(self, components: SolidComponents) -> bool:
        """True if a mesh of these samples would choose its bodies by them: so does a coarser one."""
        return not self.measured and self.how.whole and components.tells_bodies

    def resolved(self, coarse: Bricks, components: SolidComponents) -> Bricks:
        """Samples that resolve what these may miss."""
        from .thin_features import resolve_connectivity

        least = THIN * (max(self.planned.box.size) / self.size) ** 2
        return resolve_connectivity(self.root, coarse, least, len(large_bodies(components)) > 1, self.work)

    def seen(self, length: float) -> Samples:
        """The samples of `sampled` as an interpolated field."""
        from .walls import Samples

        return Samples(self.sampled(length))


def large_bodies(components: SolidComponents) -> np.ndarray:
    """Bodies that are not dust.

    Returns int64 [k].
    """
    bodies = components.bodies
    return np.asarray(bodies[components.count[bodies] > DUST * components.count[components.inside].sum()])


def standing(made: Plan, how: Print, scale: float, work: Work) -> Plan:
    """Cut off the base and add the raft, unless it is under supports.

    The raft extends a tenth of the longest side beyond the object, and half its height into it.

    `how` in mm; `scale`: mm per scene unit.
    """
    root, extents, outer = made.root, made.box, made.outer
    (x0, y0, z0), (x1, y1, z1) = extents.lo, extents.hi
    base, raft = how.base / scale, how.raft / scale if how.supports == "none" else 0.0
    if 0 < raft < made.voxel:
        raise VolumeError(
            f"a raft of {how.raft:g} mm: expected at least a voxel, {made.voxel * scale:.4g} mm"
        )
    if base:
        z0 += base
        if z0 >= z1:
            raise VolumeError(f"a base of {base * scale:g} mm leaves nothing of the object")
        root = edited_field(root, "keep", plane(normal=(0, 0, -1), offset=-z0))
        left = extent(root, work).box  # the widest part may be cut off
        (x0, y0, _), (x1, y1, _) = left.lo, left.hi
        extents = Box((x0, y0, z0), (x1, y1, z1))
    if raft:
        rim = max(extents.size) / 10
        lying = Box((x0 - rim, y0 - rim, z0 - raft / 2), (x1 + rim, y1 + rim, z0 + raft / 2))
        root = edited_field(root, "add", transform(box(size=lying.size), translate=lying.centre))
        extents, outer = extents | lying, (outer | lying).about(outer.centre)
    return replace(made, root=root, box=extents, outer=outer)


REPEATS = 4
"""Maximum number of times that fragments are joined."""

ROUNDS = 8
"""Maximum number of times that what thickening left thin is thickened."""

ACROSS = 1.5
"""Least number of samples of the mesh across the minimum thickness by which thinner walls are found."""


def apply_print_edits(
    planned: Plan, size: Sizing, how: Print, scale: float, work: Work, measured: bool
) -> Plan:
    """Make the changes of a `Print`; see `fracslice.printing.printable`."""
    for name in ("bridge", "gap", "thickness", "hollow", "drain", "base", "raft"):
        if (length := getattr(how, name)) > size.longest and (name != "drain" or how.hollow or how.drain_at):
            raise VolumeError(
                f"{name} {length:g} mm: expected at most the object's size, {size.longest:g} mm"
            )
    job = _Edits(planned, size, how, work, scale, measured)
    for stage, change in job.changes():
        job.work.check()
        job.work.progress(stage, 0.0)
        job.put(change())
        job.work.progress(stage, 1.0)
    made = standing(job.planned, how, job.scale, job.work)
    if how.drain and (how.hollow or how.drain_at):
        from .drains import drained

        made = drained(made, how, job.scale, job.work)
    if not measured or job.thin is None:
        return made
    thin, low = job.thin, made.box.lo[2]
    thin = thin.chosen(thin.middle[:, 2] > low)  # not cut off
    middle = scale * (thin.middle - (*made.box.centre[:2], low))
    note = ThinWalls(scale * thin.width, scale**2 * thin.area, middle).note(how.thickness, job.spot)
    return replace(made, notes=(*made.notes, *note))


class _Edits(Preparation):
    """The edits."""

    @property
    def grown(self) -> bool:
        """True if an edit adds to the outside."""
        return bool(self.how.bridge or self.how.thickness)

    def changes(self) -> Iterator[tuple[str, Callable[[], Field]]]:
        """The requested edits in order: name of the stage, and function that returns the edited field."""
        how = self.how
        if how.cavities == "fill":
            yield "filling cavities", self.filled
        if how.bodies is not None:
            before = self.root
            yield "keeping the largest", self.largest
            if self.root is not before:
                self.bound()
        if how.gap:
            yield "closing gaps", self.closed
        if how.thickness:
            yield "thickening", self.thickened
        if how.bridge:
            yield "bridging", self.bridged
        if self.grown:
            self.enlarged()
            yield "joining fragments", self.rejoined
            if how.thickness and self.known and self.known.solid.voxel < self.planned.voxel:
                yield "filling pores", self.unsealed
            if self.measured and self.thin is not None and self.meshed:
                yield "measuring the thickness", self.measure_thickness
        if how.hollow:
            yield "hollowing", self.hollowed

    def filled(self) -> Field:
        """Fill enclosed cavities."""
        return self.without(self.connected().cavities)

    def without(self, cavities: np.ndarray) -> Field:
        """Fill the given cavities."""
        from .bridging import nearer

        if not len(cavities):
            return self.root
        components = self.connected()
        self.known = components.filled(cavities)
        return edited_field(self.root, "add", nearer(components, cavities, np.array([0])))

    def largest(self) -> Field:
        """Keep only the largest bodies."""
        from .bridging import nearer

        components = self.connected()
        first, others = np.split(components.bodies, [self.how.bodies or 0])
        if not len(others):
            return self.root
        return edited_field(self.root, "keep", nearer(components, first, others))

    def bridged(self) -> Field:
        """Join bodies by struts of minimum total length, and drop dust."""
        from .bridging import bridging_struts, capsules, nearer

        components = self.connected()
        large = large_bodies(components)
        dust = np.setdiff1d(components.bodies, large)
        start, end = bridging_struts(components, large)
        if len(dust):
            self.put(edited_field(self.root, "cut", nearer(components, dust, large)))
        if not len(start):
            return self.root
        return self.with_capsules(capsules(start, end, self.width / 2, components.solid), self.width)

    @property
    def width(self) -> float:
        """Diameter of struts and minimum thickness of walls, scene units."""
        return max(self.how.bridge, self.how.thickness) / self.scale

    def rejoined(self) -> Field:
        """Join the fragments of bodies that the voxels of the mesh break, and drop broken tips."""
        from .bridging import capsules, fragments, nearer
        from .walls import components_of

        known, voxel = self.known, max(self.planned.voxel, max(self.planned.box.size) / FINE)
        for _ in range(REPEATS if known or self.how.bridge else 0):
            self.meshed = sample_scene(replace(self.planned, voxel=voxel), self.work)
            meshed = components_of(self.meshed)
            if not meshed.tells_bodies:  # crumbs of walls; `thickness` is for them
                break
            tips, others, (start, end) = fragments(meshed, None if self.how.bridge else known)
            if len(tips):
                self.put(edited_field(self.root, "cut", nearer(meshed, tips, others)))
            if not len(start):
                break
            grid = replace(meshed.solid, voxel=min(voxel, self.width / SHARP))
            self.put(self.with_capsules(capsules(start, end, self.width / 2, grid), self.width))
            self.known = known
            self.enlarged()
        return self.root

    def unsealed(self) -> Field:
        """Fill cavities that are sealed only at the sample spacing of the mesh."""
        from .walls import components_of

        fine, self.known = self.known, components_of(sample_scene(self.planned, self.work))
        filled = self.without(self.known.sealed(fine)) if fine else self.root
        self.meshed = self.known.solid
        return filled

    def measure_thickness(self) -> Field:
        """Find the walls that are still too thin on the samples of the mesh, if these resolve them."""
        bricks = self.meshed
        if bricks and ACROSS * bricks.voxel < self.how.thickness / self.scale:
            found = self.thinner(bricks)
            inside = values_at(self.root.kernel(), found.middle.T, self.work) < 0  # not in tips that are cut
            self.thin = found.chosen(inside)
        return self.root

    def closed(self) -> Field:
        """Fill gaps from face to face."""
        from .bridging import capsules
        from .thin_features import all_walls

        solid = self.seen(self.how.gap)
        gaps = all_walls(self.root, solid, self.how.gap / self.scale, self.work, gaps=True)
        one = _space_points(gaps.middle, solid.bricks.voxel)
        if not len(one):
            return self.root
        radius = solid.bricks.voxel
        made = capsules(gaps.start[one], gaps.end[one], radius, solid.bricks)
        return self.with_capsules(made, 2 * radius)

    def thickened(self) -> Field:
        """Add balls along the medial axis of thinner walls, which are as wide as the minimum thickness where
        they meet.

        They restore what opening with such a ball would remove (Serra 1982), along the part of the medial
        axis between opposite faces. Bodies that touch are joined. Necks between balls are walls in turn.
        Pores that this seals are filled.
        """
        from .bridging import Capsules, capsules, contacts
        from .thin_features import all_walls
        from .walls import components_of, together

        solid, least, root = self.seen(self.how.thickness), self.how.thickness / self.scale, self.root
        middle = all_walls(root, solid, least, self.work).middle
        middle = middle[_space_points(middle, solid.bricks.voxel)]
        before, start, end = components_of(solid.bricks), *np.empty((2, 0, 3))
        if not root.bounds.exterior_only:
            start, end = contacts(before, large_bodies(before), root.kernel(), self.work)
        if not len(middle) + len(start):
            return root
        start, end = np.concatenate([middle, start]), np.concatenate([middle, end])
        radius = math.hypot(least / 2, COVERED * solid.bricks.voxel)
        balls = added = capsules(start, end, radius, solid.bricks)
        self.put(self.with_capsules(balls, least))
        made = together(solid.bricks, balls.bricks)
        self.thin = self.thinner(made, added.bricks)
        for _ in range(ROUNDS):
            middle = self.thin.middle
            if not len(middle):
                break
            middle = middle[_space_points(middle, made.voxel)]
            added = capsules(middle, middle, radius, made)
            balls = Capsules(together(balls.bricks, added.bricks), radius)
            self.put(edited_field(root, "add", balls))
            made = together(made, added.bricks)
            self.thin = self.thinner(made, added.bricks)
        self.known = components_of(made)
        return self.without(self.known.sealed(before))

    def thinner(self, made: Bricks, added: Bricks | None = None) -> Walls:
        """Walls of the current object thinner than the minimum, on samples of it; with `added`, in the bricks
        of these alone.
        """
        self.spot = made.voxel * self.scale
        from .walls import Samples, project_faces, rows_of, walls

        least, rows = self.how.thickness / self.scale, None if added is None else rows_of(made, added)
        found = walls(Samples(made), least, self.work, rows=rows)
        found = project_faces(self.root, found, made.voxel, self.work)
        return found.chosen(found.width < (1 - SLACK) * least)

    def with_capsules(self, made: Samples, width: float) -> Field:
        """Add capsules of a width in scene units. They may connect components, which are forgotten."""
        self.known = None
        self.planned = replace(self.planned, outer=self.planned.outer.grown(width))
        return edited_field(self.root, "add", made)

    def hollowed(self) -> Field:
        """Remove everything deeper than the wall thickness, and drill drain holes."""
        from .edits import hollows

        samples, how, root = self.sampled(self.how.hollow), self.how, self.root
        drain = 0.0 if self.how.drain_at and self.how.drain_at != "auto" else how.drain / self.scale
        cuts, drains = hollows(samples, how.hollow / self.scale, drain, self.planned.outer)
        if not cuts:
            raise VolumeError(f"walls of {how.hollow:g} mm leave nothing to hollow out")
        for cut in cuts:
            before, root = root, edited_field(root, "cut", cut)
        self.planned = replace(self.planned, drains=drains, undrilled=before if drains else None)
        return root


def _space_points(points: np.ndarray, voxel: float) -> np.ndarray:
    """Numbers of points, one in each occupied cell of a quarter voxel, ordered along x, then y, then z."""
    if not len(points):
        return np.empty(0, np.int64)
    cells = np.round(4 * points / voxel).astype(np.int64)
    cells -= cells.min(0)
    _, first = np.unique(np.ravel_multi_index(tuple(cells.T), tuple(cells.max(0) + 1)), return_index=True)
    return np.asarray(first)
