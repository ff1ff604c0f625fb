"""Samples of a planned scene, or those of an earlier job."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from ..formulas.field import Bounds
from ..kernel import Kernel
from ..kernel.depth import advised
from ..store import Arrays, stored
from ..work import Work
from .bricks import Bricks, SignBricks
from .exploration import Evaluate
from .pruning import Proofs
from .sampler import sample, sample_signs

if TYPE_CHECKING:
    from . import Plan

AnyBricks = TypeVar("AnyBricks", Bricks, SignBricks)

MANY = 64**3
"""Bricks of a lattice from which cells are proved."""


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
