"""From a field to sparse samples around its surface, and to OpenVDB."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

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


AnyBricks = TypeVar("AnyBricks", Bricks, SignBricks)

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
    """Samples of a planned scene around its surface, taken now or kept in the store.

    Raises `VolumeError`, `Cancelled`.
    """
    return _sampled(planned, work or Work(), sample, Bricks, "values")


def sample_scene_signs(planned: Plan, work: Work | None = None) -> SignBricks:
    """As `sample_scene`; of each sample only its sign, which is all that the exact surface takes."""
    return _sampled(planned, work or Work(), sample_signs, SignBricks, "signs")


def _sampled(
    planned: Plan, work: Work, take: Callable[..., AnyBricks], kind: type[AnyBricks], held: str
) -> AnyBricks:
    """held: the name of the arrays that the bricks hold besides their places."""
    lattice, fresh = planned.lattice, list[AnyBricks]()

    def made() -> Arrays:
        kernel, bounds, conservative = _fields(planned, work)
        bricks = take(kernel, bounds, lattice, work, conservative)
        fresh.append(bricks)
        return {name: getattr(bricks, name) for name in ("ijk", held, "index")}

    kept = stored(work.store, ("samples", held, work.device, lattice), planned.root, made)
    return fresh[0] if fresh else kind(lattice.origin, lattice.voxel, kept["ijk"], kept[held], kept["index"])


def _fields(planned: Plan, work: Work) -> tuple[Kernel, Bounds, Kernel]:
    """What is sampled, the bounds of what is pruned by, and what is pruned by: mostly the same."""
    root = planned.root
    conservative = root.conservative()
    return root.kernel(work.device), conservative.bounds, conservative.kernel(work.device)
