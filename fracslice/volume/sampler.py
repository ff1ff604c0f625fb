"""Sparse sampling of a distance field: bricks that contain its whole surface and little else."""

from __future__ import annotations

from functools import partial

import numpy as np

from ..formulas.field import Bounds
from ..kernel import Kernel
from ..work import Work, chunks
from .bricks import Bricks, SignBricks
from .exploration import Evaluate, Exploration
from .lattice import BRICK, Lattice
from .pruning import Proofs, Pruning


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
    gathered = _gathered(values, order, run.work)
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


def _gathered(batches: list[np.ndarray], order: np.ndarray, work: Work) -> np.ndarray:
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
