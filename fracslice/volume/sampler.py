"""Sparse sampling of a distance field: bricks that contain its whole surface and little else.

Bricks that `pruning` does not discard are candidates. They are sampled from the outside in: first each
candidate next to empty space or with its centre outside, then every neighbour across a face on which a
sampled brick has an exterior sample, until none is left. The interior of an escape-time fractal, which costs
every iteration and cannot be recognised from afar, is thus never entered beyond its first layer.

The same rule guards against violated bounds: where a sign change would leave the samples, the neighbour is
sampled too, whatever the bound claims. The audit is a second check: random grid points in unsampled bricks,
one in every brick next to the samples and many in the others. Where the sign is not the assumed one, sampling
continues from there. Results depend on the field only, not on threads or order.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from ..errors import VolumeError
from ..formulas.field import Bounds
from ..kernel import Kernel
from ..work import Work, chunks
from .bricks import INSIDE, OUTSIDE, Bricks, SignBricks
from .faces import FACES, SignFaces
from .lattice import BRICK, Lattice
from .pruning import Proofs, Pruning
from .states import BORDER, CANDIDATE, EMPTY, FULL, QUEUED, States

Evaluate = Callable[[np.ndarray], np.ndarray]
"""Sign bits of bricks, uint8 [n, 64], from their corners, int32 [n, 3]; see `brick_signs`."""

MANY = 1 << 17
"""Bricks that are worth another evaluation than by the threads at hand."""

AUDITS = 8
"""Largest number of audits."""

FAR_AUDITS = 1 << 15
"""Random bricks tested by an audit, besides those next to the samples; in a smaller lattice, all bricks."""


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

    def keep(wave: np.ndarray) -> None:
        values.append(wave)

    run = _Sampling(Pruning(kernel, conservative or kernel, bounds, lattice, work or Work(), proofs), keep)
    signs, order = run.signs()
    return Bricks(
        signs.origin,
        signs.voxel,
        signs.ijk,
        _gathered(values, order, run.work),
        signs.index,
        evaluations=signs.evaluations,
        repaired=signs.repaired,
        audited=signs.audited,
        proved=signs.proved,
    )


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
    signs, _ = _Sampling(pruning, None, evaluate).signs()
    return signs


def brick_signs(kernel: Kernel, corners: np.ndarray, lattice: Lattice, values: np.ndarray) -> np.ndarray:
    """Sample some bricks.

    Parameters
    ----------
    kernel
        Float32 kernel.
    corners
        Grid indices of their first samples, int32 [n, 3].
    lattice
        Sampling grid.
    values
        Output: the samples, float32 [n, 512].

    Returns
    -------
    ndarray
        Sign bits, uint8 [n, 64], set inside.
    """
    kernel.bricks(corners, lattice.origin, lattice.voxel, values)
    if np.isnan(values.max()):
        np.nan_to_num(values, copy=False, nan=lattice.voxel)
    return np.packbits(values < 0, axis=1, bitorder="little")


@dataclass
class _Sampling:
    """State of one sampling."""

    pruning: Pruning
    keep: Callable[[np.ndarray], None] | None
    evaluate: Evaluate | None = None
    repaired: int = 0
    audited: int = 0
    numbers: list[np.ndarray] = field(default_factory=list)
    bits: list[np.ndarray] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.kernel, self.bounds = self.pruning.kernel, self.pruning.bounds
        self.lattice, self.work = self.pruning.lattice, self.pruning.work

    def signs(self) -> tuple[SignBricks, np.ndarray]:
        """Sampled bricks that the surface needs, and their rows among all sampled bricks."""
        states, outside = self.pruning.probe()
        front = self.seeds(states, outside)
        for turn in range(AUDITS):
            self.explore(states, front)
            front = self.audit(states, turn)
            if not len(front):
                break
        self.work.progress("sampling", 1.0)
        return self.finished(states)

    def seeds(self, states: States, outside: np.ndarray) -> np.ndarray:
        """Candidates to start from: all of them if the field bounds distances inside too."""
        flat = states.flat
        candidates = np.flatnonzero(flat == CANDIDATE)
        edge = states.beside((flat == EMPTY) | (flat == BORDER))
        if not self.pruning.everywhere:
            candidates = candidates[edge[candidates] | outside]
        # A full brick next to an empty one: the bound is wrong there.
        wrong = np.flatnonzero((flat == FULL) & edge)
        self.repaired += len(wrong)
        return np.concatenate([candidates, wrong])

    # --- outside in -----------------------------------------------------------------------------------------
    def explore(self, states: States, front: np.ndarray) -> None:
        """Sample the front, then each neighbour that must be sampled too, until the samples are closed."""
        flat = states.flat
        while len(front):
            empty = self.pruning.emptied(states.places(front)) & (flat[front] == CANDIDATE)
            bare, front = front[empty], front[~empty]
            flat[bare], flat[front] = EMPTY, QUEUED
            signs = self.sampled(states.places(front))
            self.numbers.append(front)
            self.bits.append(signs)
            known, left = sum(map(len, self.numbers)), int(np.count_nonzero(flat == CANDIDATE))
            self.work.progress("sampling", known / max(known + left, 1))
            near = np.concatenate([bare + states.step(*face) for face in FACES])
            result = self.neighbours(states, front, signs)
            front = states.distinct(np.concatenate([result, near[flat[near] == CANDIDATE]]))

    def sampled(self, places: np.ndarray) -> np.ndarray:
        """Sample bricks; return their sign bits, uint8 [n, 8, 8], bit z of byte (x, y) set inside."""
        corners = np.ascontiguousarray(places.T * BRICK, np.int32)
        self.pruning.evaluations += len(corners) * BRICK**3
        if self.evaluate and len(corners) >= MANY:
            return self.evaluate(corners).reshape(-1, 8, 8)
        values = np.empty((len(corners) if self.keep else 0, BRICK**3), np.float32)
        signs = np.empty((len(corners), 64), np.uint8)

        def task(part: slice) -> None:
            out = values[part] if self.keep else np.empty((part.stop - part.start, BRICK**3), np.float32)
            signs[part] = brick_signs(self.kernel, corners[part], self.lattice, out)

        self.work.map(task, chunks(len(corners), self.kernel.batch // BRICK**3))
        if self.keep:
            self.keep(values)
        return signs.reshape(-1, 8, 8)

    def neighbours(self, states: States, bricks: np.ndarray, signs: np.ndarray) -> np.ndarray:
        """Bricks that must be sampled because of the signs on the faces of these bricks."""
        result, faces = [], SignFaces(signs)
        for axis, step in FACES:
            inside, outside = faces.shown(axis, step)
            near = bricks + states.step(axis, step)
            there = states.flat[near]
            if (inside & (there == BORDER)).any():
                raise VolumeError("the solid reaches the border of what is sampled; give it finite <bounds>")
            lost = (there == EMPTY) & inside | (there == FULL) & outside
            result.append(near[lost | (there == CANDIDATE) & outside])
            self.repaired += int(np.count_nonzero(lost))
        return np.concatenate(result)

    def audit(self, states: States, turn: int) -> np.ndarray:
        """Unsampled bricks where a random grid point has not the assumed sign; the points are the same in
        every run.
        """
        rng, flat = np.random.default_rng(turn), states.flat
        bare = flat < QUEUED
        near = np.flatnonzero(bare & states.beside(flat == QUEUED))
        few = math.prod(self.lattice.bricks) <= FAR_AUDITS
        far = np.arange(flat.size) if few else rng.integers(flat.size, size=FAR_AUDITS)
        bricks = np.concatenate([near, far[bare[far]]])
        points = states.places(bricks) * BRICK + rng.integers(0, BRICK, (3, len(bricks)), np.uint8)
        inside, assumed = self.pruning.values_at(points, self.kernel) < 0, flat[bricks]
        wrong = inside != (assumed != EMPTY)
        self.audited += len(bricks)
        # A wrong candidate violates no bound: it contains an exterior pocket that was not reached.
        self.repaired += int(np.count_nonzero(wrong & (assumed != CANDIDATE)))
        return states.distinct(bricks[wrong])

    # --- the result -----------------------------------------------------------------------------------------
    def finished(self, states: States) -> tuple[SignBricks, np.ndarray]:
        """Bricks touched by an edge with a sign change, in order, and their rows."""
        numbers = np.concatenate([np.empty(0, np.intp), *self.numbers])
        signs = np.concatenate([np.empty((0, 8, 8), np.uint8), *self.bits])
        index = np.where(states.flat == EMPTY, OUTSIDE, INSIDE).astype(np.int32)
        kept = self.crossed(states, numbers, signs, index)
        if not kept.any():
            raise VolumeError(
                "there is no surface: the scene is empty, or all of it is thinner than a voxel of "
                f"{self.lattice.voxel:.3g}; more voxels, or fewer levels or iterations, may show it"
            )
        order = np.flatnonzero(kept)
        order = order[np.argsort(numbers[order])]
        index[numbers[order]] = np.arange(len(order))
        bricks = SignBricks(
            self.lattice.origin,
            self.lattice.voxel,
            np.ascontiguousarray(states.places(numbers[order]).T * BRICK, np.int32),
            signs[order],
            states.inner(index),
            evaluations=self.pruning.evaluations,
            repaired=self.repaired,
            audited=self.audited,
            proved=self.pruning.share(states),
        )
        return bricks, order

    def crossed(
        self, states: States, numbers: np.ndarray, signs: np.ndarray, index: np.ndarray
    ) -> np.ndarray:
        """Mask of the sampled bricks with a sign change in them or to a neighbour. Writes the sign of the
        others to `index`.
        """
        faces = SignFaces(signs)
        any_in, any_out = faces.anywhere
        index[numbers] = np.where(any_in, INSIDE, OUTSIDE)
        row = np.full(index.shape, -1, np.int32)
        row[numbers] = np.arange(len(numbers))
        kept: np.ndarray = any_in & any_out
        plain = np.flatnonzero(~kept)
        for axis, step in FACES:
            other = row[numbers[plain] + states.step(axis, step)]
            facing_in, facing_out = faces.shown(axis, -step)
            kept[plain] |= (other >= 0) & np.where(any_in[plain], facing_out[other], facing_in[other])
        return kept


def _gathered(waves: list[np.ndarray], order: np.ndarray, work: Work) -> np.ndarray:
    """Samples of the bricks in `order`. Each batch is released as soon as it is copied."""
    out, start = np.empty((len(order), BRICK**3), np.float32), 0
    while waves:
        wave = waves.pop(0)
        mine = np.flatnonzero((order >= start) & (order < start + len(wave)))
        rows = order[mine] - start
        work.map(partial(_copy, out, wave, mine, rows), chunks(len(mine), 1 << 6))
        start += len(wave)
    return out


def _copy(out: np.ndarray, wave: np.ndarray, to: np.ndarray, rows: np.ndarray, part: slice) -> None:
    out[to[part]] = wave[rows[part]]
