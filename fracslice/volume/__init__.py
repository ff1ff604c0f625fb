"""Sparse sampling of a field around its surface, and export to OpenVDB."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import TypeVar

import numpy as np

from ..errors import VolumeError
from ..formulas.box import Box, Triple
from ..formulas.field import Bounds
from ..formulas.registry import Node
from ..kernel import Field, Kernel
from ..kernel.depth import advised, depth_notes, resolve_depths, visible
from ..meshjob import RESOLUTION
from ..store import Arrays, stored
from ..work import Work
from .bricks import Bricks, SignBricks
from .exploration import Evaluate
from .extent import Extent, extent, reached
from .lattice import Lattice
from .pruning import Proofs
from .sampler import sample, sample_signs

__all__ = [
    "Bricks",
    "Drain",
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

COARSE = 64
"""Voxels along the longest side for the first estimate of the size, accurate to a quarter of a voxel, from
which depths follow.
"""

MANY = 64**3
"""Bricks of a lattice from which cells are proved."""


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
    with advised(known or root.tree, max(root.bounds.box.size) / resolution):
        extents = extent(known or root, resolution, work)
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
        size = min(size, max(extent(known, COARSE, work).box.size))
        deeper = resolve_depths(root, size / RESOLUTION)
        if deeper == known:
            break
        known = deeper
    return known


def sample_scene(planned: Plan, work: Work | None = None) -> Bricks:
    """Sample a planned scene around its surface, or read the samples from the cache.

    Parameters
    ----------
    planned
        Scene, bounds and voxel size.
    work
        Execution settings.

    Returns
    -------
    Bricks
        Samples around the surface.

    Raises
    ------
    VolumeError
        If there is no surface or it leaves the lattice.
    Cancelled
        If the job was cancelled.
    """
    return _sampled(planned, work or Work(), sample, Bricks, "values")


def sample_scene_signs(
    planned: Plan, work: Work | None = None, evaluate: Evaluate | None = None
) -> SignBricks:
    """Sample a planned scene as `sample_scene` does, but keep only the signs.

    Signs suffice to extract the exact surface.

    Parameters
    ----------
    planned
        Scene, bounds and voxel size.
    work
        Execution settings.
    evaluate
        As for `sample_signs`.

    Returns
    -------
    SignBricks
        Signs of the samples around the surface.

    Raises
    ------
    VolumeError
        If there is no surface or it leaves the lattice.
    Cancelled
        If the job was cancelled.
    """
    take = partial(sample_signs, evaluate=evaluate)
    return _sampled(planned, work or Work(), take, SignBricks, "signs")


def _sampled(
    planned: Plan, work: Work, take: Callable[..., AnyBricks], kind: type[AnyBricks], held: str
) -> AnyBricks:
    """Sample a planned scene or read it from the cache. `held` names the array that the bricks hold besides
    positions and index.
    """
    lattice, fresh = planned.lattice, list[AnyBricks]()

    def made() -> Arrays:
        kernel, bounds, conservative = _fields(planned, work)
        with advised(planned.root.tree, planned.voxel):
            bricks = take(kernel, bounds, lattice, work, conservative, _proofs(planned))
        fresh.append(bricks)
        arrays = {name: getattr(bricks, name) for name in ("ijk", held, "index")}
        return {**arrays, "proved": np.array([np.nan if bricks.proved is None else bricks.proved])}

    kept = stored(work.store, ("samples", held, work.device, lattice, planned.proved), planned.root, made)
    if fresh:
        return fresh[0]
    (proved,) = kept["proved"].tolist()
    known = None if np.isnan(proved) else proved
    return kind(lattice.origin, lattice.voxel, kept["ijk"], kept[held], kept["index"], proved=known)


def _proofs(planned: Plan) -> Proofs | None:
    """Proofs to sample with: for a small lattice, compiling them takes longer than they save."""
    if not planned.proved and math.prod(planned.lattice.bricks) < MANY:
        return None
    cells = planned.root.cells()
    return Proofs(cells, planned.proved) if cells or planned.proved else None


def _fields(planned: Plan, work: Work) -> tuple[Kernel, Bounds, Kernel]:
    """Kernel to sample, and bounds and kernel to prune by; mostly the same field."""
    root = planned.root
    conservative = root.conservative()
    return root.kernel(work.device), conservative.bounds, conservative.kernel(work.device)
