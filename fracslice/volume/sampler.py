"""Sparse sampling of a field: bricks that contain its whole surface and little else; samples of earlier jobs.

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
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from ..common.arrays import distinct
from ..errors import EmptyError, VolumeError
from ..fields.depth import with_depth_advice
from ..fields.field import Bounds, Kernel
from ..store import Arrays, stored
from ..work import Work, chunks
from .bricks import BRICK, Bricks, Lattice, SignBricks
from .pruning import (
    BORDER,
    CANDIDATE,
    EMPTY,
    FACES,
    FULL,
    QUEUED,
    Proofs,
    Pruning,
    SignFaces,
    States,
    crossed_bricks,
)

if TYPE_CHECKING:
    from . import Plan


Evaluate = Callable[[np.ndarray], np.ndarray]
"""Sign bits of bricks, uint8 [n, 64], from their corners, int32 [n, 3]; see `brick_signs`."""

MANY_BRICKS = 1 << 17
"""Bricks that are worth another evaluation than by the threads at hand."""

TASKS, SHARES = 4, 8
"""Tasks for each thread, if none is smaller than this fraction of what the kernel evaluates together."""

AUDITS = 8
"""Largest number of audits."""

ROWS = 1 << 15
"""Bricks per task."""

LEAVES = "the solid reaches the border of the sampled region; give it finite <bounds>"

FAR_AUDITS = 1 << 15
"""Random bricks tested by an audit, besides those next to the samples; in a smaller lattice, all bricks."""


def brick_signs(kernel: Kernel, corners: np.ndarray, lattice: Lattice, values: np.ndarray) -> np.ndarray:
    """Sample some bricks.

    `corners`: int32 [n, 3]; `values`: float32 [n, 512]. Returns sign bits, uint8 [n, 64].
    """
    from .._native import signs

    kernel.bricks(corners, lattice.origin, lattice.voxel, values)
    bits: np.ndarray = signs(values, 1)
    return bits.reshape(-1, 64)


@dataclass
class Exploration:
    """State of one sampling."""

    pruning: Pruning  # evaluations that discard cells
    # receives the samples of each set of bricks, float32 [n, 512]; None: only signs are kept
    keep: Callable[[np.ndarray], None] | None
    evaluate: Evaluate | None = None  # evaluates large sets of bricks instead of the threads of the work
    repaired: int = 0  # as in `SignBricks`
    audited: int = 0
    left: int = 0  # candidates that are not sampled
    # flat indices and sign bits of the sampled bricks
    numbers: list[np.ndarray] = field(default_factory=list)
    bits: list[np.ndarray] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.kernel, self.bounds = self.pruning.kernel, self.pruning.bounds
        self.lattice, self.work = self.pruning.lattice, self.pruning.work

    def signs(self) -> tuple[SignBricks, np.ndarray]:
        """Sample."""
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
        seeds = states.where(lambda part: flat[part] == CANDIDATE, self.work)
        self.left = len(seeds)

        def at_edge(state: int) -> np.ndarray:
            shows = partial(states.beside, kinds=(EMPTY, BORDER))
            return states.where(lambda part: (flat[part] == state) & shows(part), self.work)

        if not self.pruning.everywhere:
            seeds = np.concatenate([seeds[outside], at_edge(CANDIDATE)])
        wrong = at_edge(FULL)  # the bound is wrong there
        self.repaired += len(wrong)
        return distinct(np.concatenate([seeds, wrong]))

    # --- outside in -----------------------------------------------------------------------------------------
    def explore(self, states: States, front: np.ndarray) -> None:
        """Sample the front, then each neighbour that must be sampled too, until the samples are closed."""
        flat = states.flat
        while len(front):
            candidates = flat[front] == CANDIDATE
            empty = self.pruning.emptied(states, front) & candidates
            bare, front = front[empty], front[~empty]
            flat[bare], flat[front] = EMPTY, QUEUED
            signs = self.sampled(states, front)
            self.numbers.append(front)
            self.bits.append(signs)
            self.left -= int(np.count_nonzero(candidates))
            known = sum(map(len, self.numbers))
            self.work.progress("sampling", known / max(known + self.left, 1))
            near = np.concatenate([bare + states.step(*face) for face in FACES])
            result = self.neighbours(states, front, signs)
            front = distinct(np.concatenate([near[flat[near] == CANDIDATE], *result]))

    def sampled(self, states: States, bricks: np.ndarray) -> np.ndarray:
        """Sample bricks; return their sign bits, uint8 [n, 8, 8], bit z of byte (x, y) set inside."""
        corners = np.empty((len(bricks), 3), np.int32)
        self.pruning.evaluations += len(bricks) * BRICK**3

        def place(part: slice) -> None:
            corners[part] = states.places(bricks[part]).T * BRICK

        self.work.map(place, chunks(len(bricks), ROWS))
        if self.evaluate and len(bricks) >= MANY_BRICKS:
            return self.evaluate(corners).reshape(-1, 8, 8)
        values = np.empty((len(bricks) if self.keep else 0, BRICK**3), np.float32)
        bits = np.empty((len(bricks), 64), np.uint8)

        def task(part: slice) -> None:
            out = values[part] if self.keep else np.empty((part.stop - part.start, BRICK**3), np.float32)
            bits[part] = brick_signs(self.kernel, corners[part], self.lattice, out)
            if self.keep and np.isnan(out.max()):
                np.nan_to_num(out, copy=False, nan=self.lattice.voxel)

        most = self.kernel.batch // BRICK**3
        size = min(max(len(bricks) // (TASKS * self.work.threads), -(-most // SHARES)), most)
        self.work.map(task, chunks(len(bricks), size))
        if self.keep:
            self.keep(values)
        return bits.reshape(-1, 8, 8)

    def neighbours(self, states: States, bricks: np.ndarray, signs: np.ndarray) -> list[np.ndarray]:
        """Bricks that must be sampled because of the signs on the faces of these bricks."""

        def task(part: slice) -> tuple[np.ndarray, int]:
            result, many, faces = [], 0, SignFaces(signs[part])
            for axis, step in FACES:
                inside, outside = faces.shown(axis, step)
                near = bricks[part] + states.step(axis, step)
                there = states.flat[near]
                if (inside & (there == BORDER)).any():
                    raise VolumeError(LEAVES)
                lost = (there == EMPTY) & inside | (there == FULL) & outside
                result.append(near[lost | (there == CANDIDATE) & outside])
                many += int(np.count_nonzero(lost))
            return np.concatenate(result), many

        done = self.work.collect(task, chunks(len(bricks), ROWS))
        self.repaired += sum(many for _, many in done)
        return [near for near, _ in done]

    def audit(self, states: States, turn: int) -> np.ndarray:
        """Unsampled bricks where a random grid point has not the assumed sign; the points are the same in
        every run.
        """
        rng, flat = np.random.default_rng(turn), states.flat
        near = states.where(lambda part: (flat[part] < QUEUED) & states.beside(part, (QUEUED,)), self.work)
        few = math.prod(self.lattice.bricks) <= FAR_AUDITS
        far = np.arange(flat.size) if few else rng.integers(flat.size, size=FAR_AUDITS)
        bricks = np.concatenate([near, far[flat[far] < QUEUED]])
        offsets = rng.integers(0, BRICK, (3, len(bricks)), np.uint8)
        inside, assumed = self.pruning.inside(states, bricks, offsets), flat[bricks]
        wrong = inside != (assumed != EMPTY)
        self.audited += len(bricks)
        # A wrong candidate violates no bound: it contains an exterior pocket that was not reached.
        self.repaired += int(np.count_nonzero(wrong & (assumed != CANDIDATE)))
        return distinct(bricks[wrong])

    # --- the result -----------------------------------------------------------------------------------------
    def finished(self, states: States) -> tuple[SignBricks, np.ndarray]:
        """Bricks touched by an edge with a sign change, in order, and their rows."""
        numbers = np.concatenate([np.empty(0, np.intp), *self.numbers])
        signs = np.concatenate([np.empty((0, 8, 8), np.uint8), *self.bits])
        order, index = crossed_bricks(states, numbers, signs, self.work)
        if not len(order):
            raise EmptyError(
                "there is no surface: the scene is empty, or all of it is thinner than a voxel of "
                f"{self.lattice.voxel:.3g}; expected more voxels"
            )
        corners, kept = np.empty((len(order), 3), np.int32), np.empty((len(order), 8, 8), np.uint8)

        def task(part: slice) -> None:
            corners[part] = states.places(numbers[order[part]]).T * BRICK
            kept[part] = signs[order[part]]

        self.work.map(task, chunks(len(order), ROWS))
        bricks = SignBricks(
            self.lattice.origin,
            self.lattice.voxel,
            corners,
            kept,
            states.inner(index, self.work),
            evaluations=self.pruning.evaluations,
            repaired=self.repaired,
            audited=self.audited,
            proved=self.pruning.share(states),
        )
        return bricks, order


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
