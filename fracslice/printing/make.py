"""Make an object printable by field edits, each measured on samples of the previous result.

Distances come from the field where its values are distances, else from its samples by fast sweeping (Zhao
2004): a millimetre is a millimetre for any formula.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from ..errors import VolumeError
from ..kernel import Field
from ..meshjob import DUST
from ..scene import Print
from ..volume import Bricks, Plan, extent, sample_scene
from ..volume.sizing import Sizing
from ..work import Work
from .edits import edited_field
from .standing import standing

# Measuring needs Numba and SciPy, whose import takes as long as a small mesh: import where needed.
if TYPE_CHECKING:
    from .components import Components
    from .samples import Samples

COARSE, FINE = 128, 640
"""Minimum and maximum number of samples along the longest side for measuring lengths."""

SHARP = 6
"""Samples across a length to thicken, close or keep, as far as `FINE` permits."""

THIN = 1.0
"""Area of walls or gaps that samples may miss, from which finer samples are taken, mm^2."""


def printable(planned: Plan, size: Sizing, how: Print, work: Work | None = None) -> tuple[Plan, float]:
    """Make a planned scene printable.

    Samples with the voxel of `planned` lie at the same points before and after.

    Parameters
    ----------
    planned : Plan
        The scene.
    size : Sizing
        Size of the bodies that stay, measured on the field before anything is cut off or added.
    how : Print
        Changes to make.
    work : Work, optional
        Threads, progress and cancellation.

    Returns
    -------
    plan : Plan
        The printable scene.
    scale : float
        mm per scene unit.

    Raises
    ------
    VolumeError
        If nothing would be left, or a length is too small to measure or larger than the object.
    Cancelled
        When the work is cancelled.
    """
    for name in ("bridge", "gap", "thickness", "hollow", "drain", "base", "raft"):
        if (length := getattr(how, name)) > size.longest and (name != "drain" or how.hollow):
            raise VolumeError(
                f"{name} {length:g} mm: expected at most the object's size, {size.longest:g} mm"
            )
    job = _Preparation(planned, size, how, work or Work())
    for stage, change in job.changes():
        job.work.check()
        job.work.progress(stage, 0.0)
        job.put(change())
        job.work.progress(stage, 1.0)
    return standing(job.planned, how, job.scale), job.scale


@dataclass
class _Preparation:
    """The object during its edits."""

    planned: Plan
    sizing: Sizing
    how: Print
    work: Work
    scale: float = 1.0
    """mm per scene unit, set once the bodies that stay are known."""
    known: Components | None = None
    """Components, once computed."""

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
        extents = extent(self.root, max(self.planned.box.size) / self.planned.voxel, self.work)
        self.planned = replace(self.planned, box=extents.box, outer=extents.outer, tips=extents.tips)

    @property
    def grown(self) -> bool:
        """True if an edit adds to the outside."""
        return bool(self.how.bridge or self.how.thickness)

    def changes(self) -> Iterator[tuple[str, Callable[[], Field]]]:
        """The requested edits in order: name of the stage, and function that returns the edited field."""
        how = self.how
        if how.cavities == "fill":
            yield "filling cavities", self.filled
        if how.keep == "largest":
            before = self.root
            yield "keeping the largest", self.largest
            if self.root is not before:
                self.bound()
        self.scale = self.sizing.scale(self.planned.box)
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
        """Samples of the current object, fine enough for a length in mm."""
        samples = min(max(COARSE, SHARP * self.size / length), FINE)
        if length < 2 * self.size / samples:
            least = 2 * self.size / samples
            raise VolumeError(f"{length:g} mm in {self.size:g} mm: expected at least {least:.3g} mm, or 0")
        from .connectivity import shown

        return shown(self.root, self.planned.outer, max(self.planned.box.size), samples, self.work)

    def connected(self) -> Components:
        """Components of samples that resolve connectivity; shared by cavities, bodies and bridges."""
        from .components import components_of
        from .connectivity import resolved

        if self.known is None:
            coarse = self.sampled()
            components = components_of(coarse)
            unit = max(self.planned.box.size) / self.size
            bricks = resolved(self.root, coarse, THIN * unit**2, len(_large(components)) > 1, self.work)
            self.known = components if bricks is coarse else components_of(bricks)
        return self.known

    def seen(self, length: float) -> Samples:
        """The samples of `sampled` as an interpolated field."""
        from .samples import Samples

        return Samples(self.sampled(length))

    def filled(self) -> Field:
        """Fill enclosed cavities."""
        return self.without(self.connected().cavities)

    def without(self, cavities: np.ndarray) -> Field:
        """Fill the given cavities."""
        from .border import nearer

        if not len(cavities):
            return self.root
        components = self.connected()
        self.known = components.filled(cavities)
        return edited_field(self.root, "add", nearer(components, cavities, np.array([0])))

    def largest(self) -> Field:
        """Keep only the largest body."""
        from .border import nearer

        components = self.connected()
        first, others = np.split(components.bodies, [1])
        if not len(others):
            return self.root
        return edited_field(self.root, "keep", nearer(components, first, others))

    def bridged(self) -> Field:
        """Join bodies by struts of minimum total length, and drop dust."""
        from .border import nearer
        from .bridges import struts
        from .capsules import capsules

        components = self.connected()
        large = _large(components)
        dust = np.setdiff1d(components.bodies, large)
        start, end = struts(components, large)
        if len(dust):
            self.put(edited_field(self.root, "cut", nearer(components, dust, large)))
        if not len(start):
            return self.root
        width = max(self.how.bridge, self.how.thickness) / self.scale
        return self.with_capsules(capsules(start, end, width / 2, components.solid), width)

    def unsealed(self) -> Field:
        """Fill cavities that are sealed only at the sample spacing of the mesh."""
        from .components import components_of

        fine, self.known = self.known, components_of(sample_scene(self.planned, self.work))
        return self.without(self.known.sealed(fine)) if fine else self.root

    def closed(self) -> Field:
        """Fill gaps from face to face."""
        from .capsules import capsules
        from .thin_features import all_walls

        solid = self.seen(self.how.gap)
        gaps = all_walls(self.root, solid, self.how.gap / self.scale, self.work, gaps=True)
        one = _spaced(gaps.middle, solid.bricks.voxel)
        if not len(one):
            return self.root
        radius = solid.bricks.voxel
        made = capsules(gaps.start[one], gaps.end[one], radius, solid.bricks)
        return self.with_capsules(made, 2 * radius)

    def thickened(self) -> Field:
        """Add balls as wide as the minimum thickness along the medial axis of thinner walls.

        They restore what opening with such a ball would remove (Serra 1982), along the part of the medial
        axis between opposite faces. Pores that they seal are filled.
        """
        from .capsules import capsules
        from .components import components_of
        from .samples import together
        from .thin_features import all_walls

        solid, least = self.seen(self.how.thickness), self.how.thickness / self.scale
        middle = all_walls(self.root, solid, least, self.work).middle
        middle = middle[_spaced(middle, solid.bricks.voxel)]
        if not len(middle):
            return self.root
        balls = capsules(middle, middle, least / 2, solid.bricks)
        self.put(self.with_capsules(balls, least))
        before = components_of(solid.bricks)
        self.known = components_of(together(solid.bricks, balls.bricks))
        return self.without(self.known.sealed(before))

    def with_capsules(self, made: Samples, width: float) -> Field:
        """Add capsules of a width in scene units. They may connect components, which are forgotten."""
        self.known = None
        self.planned = replace(self.planned, outer=self.planned.outer.grown(width))
        return edited_field(self.root, "add", made)

    def hollowed(self) -> Field:
        """Remove everything deeper than the wall thickness, and drill drain holes."""
        from .hollowing import hollows

        samples, how, root = self.sampled(self.how.hollow), self.how, self.root
        cuts, drains = hollows(samples, how.hollow / self.scale, how.drain / self.scale, self.planned.outer)
        if not cuts:
            raise VolumeError(f"walls of {how.hollow:g} mm leave nothing to hollow out")
        self.planned = replace(self.planned, drains=drains)
        for cut in cuts:
            root = edited_field(root, "cut", cut)
        return root


def _spaced(points: np.ndarray, voxel: float) -> np.ndarray:
    """Numbers of points, one in each occupied cell of a quarter voxel, ordered along x, then y, then z."""
    if not len(points):
        return np.empty(0, np.int64)
    cells = np.round(4 * points / voxel).astype(np.int64)
    cells -= cells.min(0)
    _, first = np.unique(np.ravel_multi_index(tuple(cells.T), tuple(cells.max(0) + 1)), return_index=True)
    return np.asarray(first)


def _large(components: Components) -> np.ndarray:
    """Numbers of the bodies that are not dust."""
    bodies = components.bodies
    return np.asarray(bodies[components.count[bodies] > DUST * components.count[components.inside].sum()])
