"""From a field to sparse samples around its surface, and to OpenVDB."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..formulas.box import Box
from ..formulas.field import Bounds
from ..formulas.registry import Node
from ..kernel import Field, Kernel
from ..kernel.depth import depth_notes, resolve_depths, visible
from ..store import Arrays, stored
from ..work import Work
from .bricks import Bricks, SignBricks
from .extent import Extent, extent, reached
from .lattice import Lattice
from .sampler import sample, sample_signs

__all__ = [
    "Bricks",
    "Extent",
    "Lattice",
    "Plan",
    "SignBricks",
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


DETAIL = 256
"""The finest detail of automatic depths, along the object's longest side: a mesh shows it if nothing else is
asked for. The next step would move most of the surface by less than half of it."""

COARSE = 64
"""Voxels along the longest side that its length is known to a quarter of, for depths to follow from it."""


@dataclass(frozen=True, eq=False)
class Plan:
    """What is about to be sampled: the scene with all depths known, the object's box, a box that surely
    encloses it, its outermost points [3, 6], and the voxel, all in scene units. notes: what the voxel is too
    large for, in words. depths: those that were automatic, such as "mandelbulb 5"."""

    root: Field
    box: Box
    outer: Box
    tips: np.ndarray
    voxel: float
    notes: tuple[str, ...] = ()
    depths: tuple[str, ...] = ()

    @property
    def lattice(self) -> Lattice:
        """The grid that it is sampled on."""
        return Lattice.around(self.outer, self.voxel, self.box)


def plan(root: Node, resolution: float, work: Work | None = None) -> Plan:
    """Finds the object's size and depths, and leaves out what a resolution cannot show.

    resolution: voxels along the object's longest side (need not be whole). Raises `VolumeError`.
    """
    known = with_depths(root, work)
    found = extent(known, resolution, work)
    voxel = max(found.box.size) / resolution
    shown, notes = visible(known, voxel)
    return Plan(shown, found.box, found.outer, found.tips, voxel, notes, depth_notes(root, known))


def with_depths(root: Node, work: Work | None = None) -> Node:
    """The scene with every automatic depth replaced by a number.

    The depths follow from the object alone, whatever it is sampled for: a mesh, layers and what checks them
    are of the same solid. Raises `VolumeError`.
    """
    if not root.bounds.box.finite:
        return root
    size = max(root.bounds.box.size)
    known = resolve_depths(root, size / DETAIL)
    # A deeper solid is smaller, so that finer detail counts, until no depth changes any more.
    while known is not root:
        size = min(size, max(extent(known, COARSE, work).box.size))
        deeper = resolve_depths(root, size / DETAIL)
        if deeper == known:
            break
        known = deeper
    return known


def sample_scene(planned: Plan, work: Work | None = None) -> Bricks:
    """Samples a planned scene around its surface, or takes the samples that were kept of it.

    Raises `VolumeError`, `Cancelled`.
    """
    work = work or Work()
    lattice = planned.lattice

    fresh: list[Bricks] = []

    def made() -> Arrays:
        kernel, bounds, conservative = _fields(planned, work)
        bricks = sample(kernel, bounds, lattice, work, conservative)
        fresh.append(bricks)
        return {"ijk": bricks.ijk, "values": bricks.values, "index": bricks.index}

    kept = stored(work.store, ("samples", work.device, lattice), planned.root, made)
    if fresh:
        return fresh[0]
    return Bricks(lattice.origin, lattice.voxel, kept["ijk"], kept["values"], kept["index"])


def sample_scene_signs(planned: Plan, work: Work | None = None) -> SignBricks:
    """As `sample_scene`, of each sample only its sign."""
    work = work or Work()
    lattice = planned.lattice
    kernel, bounds, conservative = _fields(planned, work)
    return sample_signs(kernel, bounds, lattice, work, conservative)


def _fields(planned: Plan, work: Work) -> tuple[Kernel, Bounds, Kernel]:
    """What is sampled, the bounds of what is pruned by, and what is pruned by: mostly the same."""
    root = planned.root
    conservative = root.conservative()
    return root.kernel(work.device), conservative.bounds, conservative.kernel(work.device)
