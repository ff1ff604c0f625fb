"""From a field to sparse samples around its surface, and to OpenVDB."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..formulas.box import Box
from ..formulas.registry import Facts, Node
from ..kernel import Compilable, Kernel
from ..kernel.depth import resolve_depths, visible
from ..kernel.devices import compile_for
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
]


@dataclass(frozen=True, eq=False)
class Plan:
    """What is about to be sampled: the scene with all depths known, the object's box, a box that surely
    encloses it, its outermost points [3, 6], and the voxel, all in scene units. notes: what the voxel is too
    large for, in words."""

    root: Node | Compilable
    box: Box
    outer: Box
    tips: np.ndarray
    voxel: float
    notes: tuple[str, ...] = ()


def plan(root: Node, resolution: float, work: Work | None = None) -> Plan:
    """Finds the object's size and the depths that a resolution needs.

    resolution: voxels along the object's longest side (need not be whole). Raises `VolumeError`.
    """
    size, finite = max(root.facts.box.size), root.facts.box.finite
    while True:
        rough = resolve_depths(root, size / resolution) if finite else root
        found = extent(rough, resolution, work)
        # A step more makes a solid of a large bailout much smaller, and then its depth was chosen too low.
        if rough is root or max(found.box.size) > size / 4:
            break
        size = max(found.box.size)
    voxel = max(found.box.size) / resolution
    shown, notes = visible(resolve_depths(root, voxel), voxel)
    return Plan(shown, found.box, found.outer, found.tips, voxel, notes)


def sample_scene(planned: Plan, work: Work | None = None) -> Bricks:
    """Samples a planned scene around its surface, or takes the samples that were kept of it.

    Raises `VolumeError`, `Cancelled`.
    """
    work = work or Work()
    lattice = Lattice.around(planned.outer, planned.voxel)

    fresh: list[Bricks] = []

    def made() -> Arrays:
        kernel, facts, guard = _fields(planned, work)
        bricks = sample(kernel, facts, lattice, work, guard)
        fresh.append(bricks)
        return {"ijk": bricks.ijk, "values": bricks.values, "index": bricks.index}

    kept = stored(work.store, ("samples", work.device, lattice), planned.root, made)
    if fresh:
        return fresh[0]
    return Bricks(lattice.origin, lattice.voxel, kept["ijk"], kept["values"], kept["index"])


def sample_scene_signs(planned: Plan, work: Work | None = None) -> SignBricks:
    """As `sample_scene`, of each sample only its sign."""
    work = work or Work()
    lattice = Lattice.around(planned.outer, planned.voxel)
    kernel, facts, guard = _fields(planned, work)
    return sample_signs(kernel, facts, lattice, work, guard)


def _fields(planned: Plan, work: Work) -> tuple[Kernel, Facts, Kernel]:
    """What is sampled, the facts of what is pruned by, and what is pruned by: mostly the same."""
    root = planned.root
    guard = root.guard()
    return compile_for(work.device, root), guard.facts, compile_for(work.device, guard)
