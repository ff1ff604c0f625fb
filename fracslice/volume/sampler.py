"""Sparse sampling of a field: bricks that contain its whole surface and little else; samples of earlier
jobs.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from ..formulas.field import Bounds
from ..kernel import Kernel
from ..kernel.depth import with_depth_advice
from ..store import Arrays, stored
from ..work import Work, chunks
from .bricks import Bricks, SignBricks
from .exploration import Evaluate, Exploration
from .lattice import BRICK, Lattice
from .pruning import Proofs, Pruning

if TYPE_CHECKING:
    from . import Plan


def sample(
    kernel: Kernel,
    bounds: Bounds,
    lattice: Lattice,
    work: Work | None = None,
    conservative: Kernel | None = None,
    proofs: Proofs | None = None,
) -> Bricks:
    """Sample a scene's field around its surface.

    Parameters
    ----------
    kernel
        Float32 kernel of the scene.
    bounds
        Bounds of the field to prune by; cells are pruned by its Lipschitz bound.
    lattice
        Sampling grid.
    work
        Execution settings.
    conservative
        Kernel to prune by, if not `kernel`; `bounds` are then its own (`Node.conservative`).
    proofs
        Proofs of the cells that the bound does not discard.

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
    values: list[np.ndarray] = []
    pruning = Pruning(kernel, conservative or kernel, bounds, lattice, work or Work(), proofs)
    run = Exploration(pruning, values.append)
    signs, order = run.signs()
    gathered = _gather_samples(values, order, run.work)
    return Bricks(signs.origin, signs.voxel, signs.ijk, gathered, signs.index, **signs.counts)


def sample_signs(
    kernel: Kernel,
    bounds: Bounds,
    lattice: Lattice,
    work: Work | None = None,
    conservative: Kernel | None = None,
    proofs: Proofs | None = None,
    evaluate: Evaluate | None = None,
) -> SignBricks:
    """Sample the same bricks but keep only signs, in 1/32 of the memory.

    Parameters
    ----------
    kernel
        Float32 kernel of the scene.
    bounds
        Bounds of the field to prune by.
    lattice
        Sampling grid.
    work
        Execution settings.
    conservative
        Kernel to prune by, if not `kernel`.
    proofs
        Proofs of the cells that the bound does not discard.
    evaluate
        Evaluates large sets of bricks instead of the threads of `work`.

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
    pruning = Pruning(kernel, conservative or kernel, bounds, lattice, work or Work(), proofs)
    signs, _ = Exploration(pruning, None, evaluate).signs()
    return signs


def _gather_samples(batches: list[np.ndarray], order: np.ndarray, work: Work) -> np.ndarray:
    """Samples of the bricks in `order`. Each batch is released as soon as it is copied."""
    out, start = np.empty((len(order), BRICK**3), np.float32), 0
    while batches:
        batch = batches.pop(0)
        mine = np.flatnonzero((order >= start) & (order < start + len(batch)))
        rows = order[mine] - start
        work.map(partial(_copy, out, batch, mine, rows), chunks(len(mine), 1 << 6))
        start += len(batch)
    return out


def _copy(out: np.ndarray, batch: np.ndarray, to: np.ndarray, rows: np.ndarray, part: slice) -> None:
    out[to[part]] = batch[rows[part]]


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
    return _sample_or_read(planned, work or Work(), sample, Bricks, "values")


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
    return _sample_or_read(planned, work or Work(), take, SignBricks, "signs")


def _sample_or_read(
    planned: Plan, work: Work, take: Callable[..., AnyBricks], kind: type[AnyBricks], held: str
) -> AnyBricks:
    """Sample a planned scene or read it from the cache. `held` names the array that the bricks hold besides
    positions and index.
    """
    lattice, fresh = planned.lattice, list[AnyBricks]()

    def made() -> Arrays:
        kernel, bounds, conservative = _fields(planned, work)
        with with_depth_advice(planned.root.tree, planned.voxel):
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
