"""Sparse sampling of a field around its surface, and export to OpenVDB."""

from __future__ import annotations

from dataclasses import dataclass, replace
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np

from ..common.messages import format_count, place, significant
from ..errors import VolumeError
from ..fields.box import Box, Triple
from ..fields.depth import depth_notes, resolve_depths, visible, with_depth_advice
from ..fields.field import Field
from ..fields.registry import Node
from ..records import RESOLUTION
from ..work import Work
from .bricks import Lattice
from .extent import Extent, extent, reached

if TYPE_CHECKING:
    from .bricks import Bricks, SignBricks
    from .sampler import sample, sample_scene, sample_scene_signs, sample_signs

__all__ = [
    "Bricks",
    "Drain",
    "Extent",
    "Lattice",
    "Pillars",
    "Plan",
    "SignBricks",
    "Supports",
    "extent",
    "plan",
    "reached",
    "resolve_depths",
    "sample",
    "sample_scene",
    "sample_scene_signs",
    "sample_signs",
    "with_depths",
]

_SAMPLING = {
    "Bricks": "bricks",
    "SignBricks": "bricks",
    "sample": "sampler",
    "sample_scene": "sampler",
    "sample_scene_signs": "sampler",
    "sample_signs": "sampler",
}
"""Modules of what samples, by name: layers and pictures need a plan alone."""


def __getattr__(name: str) -> Any:
    """Load what samples at its first use."""
    if name not in _SAMPLING:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f".{_SAMPLING[name]}", __name__), name)


@dataclass(frozen=True)
class Drain:
    """Drain hole of a hollow, scene units.

    Attributes
    ----------
    start, end
        Ends of its axis, in the hollow and outside.
    radius
        Radius.
    """

    start: Triple
    end: Triple
    radius: float


@dataclass(frozen=True, eq=False)
class Pillars:
    """What supports are made of, scene units.

    Attributes
    ----------
    beams
        Balls at both ends of each beam, float64 [n, 2, 4]: centre and radius.
    floor
        Height below which no beam is.
    raft
        Half spaces of the plate below, float64 [k, 4]: a, b, c and d of a x + b y + c z <= d; none, none.
    """

    beams: np.ndarray
    floor: float
    raft: np.ndarray


@dataclass(frozen=True, eq=False)
class Supports:
    """Supports of an object. Volumes and areas in mm3 and mm2.

    Attributes
    ----------
    carried
        The object without them.
    node
        The supports, scene units.
    pillars
        What they are made of.
    tip
        Diameter of a contact, mm.
    tips
        Number of tips.
    inner
        Number of those whose branch ends on the object.
    volume
        Volume, with the feet and the raft.
    scars
        Area of all contacts.
    bare
        Places in holes without exit, which have no support, as none could be taken out, float64 [n, 3], mm;
        once both are joined, from the middle of the object and above the lowest point.
    box
        Bounds of both together, scene units; None before they are joined.
    """

    carried: Field
    node: Node
    pillars: Pillars
    tip: float
    tips: int
    inner: int
    volume: float
    scars: float
    bare: np.ndarray
    box: Box | None = None

    def distances(self, points: np.ndarray) -> np.ndarray:
        """Distances of points from the supports.

        Parameters
        ----------
        points
            Points, float64 [n, 3], scene units.

        Returns
        -------
        float32 [n]
            Distances, scene units; negative inside.
        """
        return self.node.kernel().points(*points.T.astype(np.float32))

    def __str__(self) -> str:
        """A line on them."""
        inner = f", {self.inner} of them from the object itself" if self.inner else ""
        tips = f"{format_count(self.tips, 'tip')} of {self.tip:g} mm{inner}"
        volume, scars = significant(self.volume), significant(self.scars)
        made = f"supports: {tips}; {volume} mm3, scars of {scars} mm2"
        if not len(self.bare):
            return made
        count = format_count(len(self.bare), "place has none", "places have none")
        lowest = place(self.bare[self.bare[:, 2].argmin()].tolist())
        return f"{made}; {count}, in holes without exit, the lowest at {lowest} mm (--cavities fill, or --up)"


@dataclass(frozen=True, eq=False)
class Plan:
    """Scene with resolved depths, its bounds and its voxel size.

    Attributes
    ----------
    root
        Scene to sample.
    box
        Bounds of the object, scene units.
    outer
        Conservative bounds of the object, scene units.
    tips
        Outermost points of the object, float64 [3, 6], scene units.
    voxel
        Voxel size, scene units.
    notes
        Details that the voxel is too large to resolve, as text.
    depths
        Automatic depths, such as "mandelbulb 5".
    drains
        Drain holes.
    undrilled
        The object without its drain holes, if there are any.
    supports
        Supports, if there are any.
    proved
        True if nothing is skipped without a proof.
    """

    root: Field
    box: Box
    outer: Box
    tips: np.ndarray
    voxel: float
    notes: tuple[str, ...] = ()
    depths: tuple[str, ...] = ()
    drains: tuple[Drain, ...] = ()
    undrilled: Field | None = None
    supports: Supports | None = None
    proved: bool = False

    @property
    def strict(self) -> Plan:
        """The same plan, with nothing skipped but by a proof: the box that the formulas state is sampled."""
        stated = self.root.proved_box
        if not stated.finite:
            raise VolumeError("no box is proved to hold the object: expected <bounds> around it")
        outer = self.outer | stated
        return replace(self, outer=outer.about(self.box.centre), proved=True)

    @property
    def lattice(self) -> Lattice:
        """Sampling grid of the plan."""
        return Lattice.around(self.outer, self.voxel, self.box)


def plan(root: Field, resolution: float, work: Work | None = None) -> Plan:
    """Measure the object, resolve automatic depths and drop detail below the resolution.

    Parameters
    ----------
    root
        Scene.
    resolution
        Voxels along the object's longest side; need not be an integer.
    work
        Execution settings.

    Returns
    -------
    Plan
        Scene, bounds and voxel size.

    Raises
    ------
    VolumeError
        If the scene is empty or unbounded.
    Cancelled
        If the job was cancelled.
    """
    tree = root.tree
    known = with_depths(tree, work) if tree else None
    with with_depth_advice(known or root.tree, max(root.bounds.box.size) / resolution):
        extents = extent(known or root, work)
    voxel = max(extents.box.size) / resolution
    planned = Plan(known or root, extents.box, extents.outer, extents.tips, voxel)
    if tree is None or known is None:
        return planned
    shown, notes = visible(known, voxel)
    return replace(planned, root=shown, notes=notes, depths=depth_notes(tree, known))


def with_depths(root: Node, work: Work | None = None) -> Node:
    """Replace every automatic depth by a number.

    A mesh of default resolution shows the finest detail: one more iteration would move most of the surface by
    less than half a voxel.

    Depths depend on the object only, not on the use of the samples: meshes, layers and checks describe the
    same solid.

    Parameters
    ----------
    root
        Scene.
    work
        Execution settings.

    Returns
    -------
    Node
        Scene with resolved depths; `root` itself if it is unbounded.

    Raises
    ------
    VolumeError
        If the extent of the object cannot be determined.
    """
    if not root.bounds.box.finite:
        return root
    size = max(root.bounds.box.size)
    known = resolve_depths(root, size / RESOLUTION)
    # A deeper solid is smaller and needs finer detail; iterate until the depths are stable.
    while known is not root:
        size = min(size, max(extent(known, work).box.size))
        deeper = resolve_depths(root, size / RESOLUTION)
        if deeper == known:
            break
        known = deeper
    return known
