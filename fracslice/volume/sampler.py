"""Sparse sampling: from a distance field to bricks that hold its whole surface and little else.

Top down, a cell is dropped when the field at its centre says that no sign change is in it or within a voxel
of it: ``|f| > L * (half diagonal + voxel)``. What remains at brick size are candidates. They are sampled from
the outside in: a candidate next to empty space, or whose centre is outside, is sampled; then every neighbour
that a sampled brick shows an outside sample to, until none is left. The inside of an escape-time fractal,
which costs every iteration and cannot be recognised from afar, is so never entered beyond its first layer.

The same rule is a safety net: where a sign change would leave the samples, the neighbour is sampled too,
whatever the bound said. A second one is the audit: grid points at random in what was not sampled, one in
every brick beside the samples and many of the rest; where the sign is not the one assumed, sampling goes on
from there. All results depend on the field only, not on threads or order.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from ..errors import VolumeError
from ..formulas.registry import Facts
from ..kernel import Kernel
from ..work import Work, chunks
from .bricks import INSIDE, OUTSIDE, Bricks, SignBricks
from .faces import FACES, SignFaces, beside, distinct
from .lattice import BRICK, Lattice
from .values import values_at

COARSEST = 16
"""Bricks along a cell of the first level: 128 voxels, as in OpenVDB's tree."""

EMPTY, CANDIDATE, FULL, QUEUED = 0, 1, 2, 3
AUDITS = 8
FAR_AUDITS = 1 << 15


def sample(
    kernel: Kernel, facts: Facts, lattice: Lattice, work: Work | None = None, guard: Kernel | None = None
) -> Bricks:
    """Samples a scene's field around its surface.

    kernel: the scene's float32 kernel. facts: the scene's facts, whose Lipschitz bound prunes. guard: the
    kernel that is pruned by, where it is another; then facts are its own (`Node.guard`). Raises `VolumeError`
    if there is no surface, or if it leaves the lattice; `Cancelled`.
    """
    values: list[np.ndarray] = []

    def keep(wave: np.ndarray) -> None:
        values.append(wave)

    run = _Run(kernel, guard or kernel, facts, lattice, work or Work(), keep)
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
    )


def sample_signs(
    kernel: Kernel, facts: Facts, lattice: Lattice, work: Work | None = None, guard: Kernel | None = None
) -> SignBricks:
    """The same bricks, in a 32nd of the memory: of each sample only its sign is kept."""
    signs, _ = _Run(kernel, guard or kernel, facts, lattice, work or Work(), None).signs()
    return signs


@dataclass
class _Run:
    kernel: Kernel
    guard: Kernel
    facts: Facts
    lattice: Lattice
    work: Work
    keep: Callable[[np.ndarray], None] | None
    evaluations: int = 0
    repaired: int = 0
    audited: int = 0
    corners: list[np.ndarray] = field(default_factory=list)
    bits: list[np.ndarray] = field(default_factory=list)

    def signs(self) -> tuple[SignBricks, np.ndarray]:
        """The sampled bricks that the surface needs, and which rows of all sampled ones these are."""
        state, outside = self.probe()
        front = self.seeds(state, outside)
        for turn in range(AUDITS):
            self.explore(state, front)
            front = self.audit(state, turn)
            if not len(front):
                break
        return self.finished(state)

    # --- top down -------------------------------------------------------------------------------------------
    def probe(self) -> tuple[np.ndarray, np.ndarray]:
        """state uint8 [bx, by, bz] of every brick, and a bool array: candidates whose centre is outside."""
        state = np.full(self.lattice.bricks, EMPTY, np.uint8)
        outside = np.zeros(self.lattice.bricks, bool)
        size = COARSEST
        cells = _grid(*(-(-n // size) for n in self.lattice.bricks)) * size
        while True:
            f = self.centres(cells, size, self.guard)
            reach = self.reach(size * BRICK)
            full = (f < -reach) & (not self.facts.weak)
            for cell in cells[full]:
                state[tuple(slice(c, c + size) for c in cell)] = FULL
            near = ~((f > reach) | full)
            cells, f = cells[near], f[near]
            if size == 1:
                break
            size //= 2
            cells = (cells[:, None] + _grid(2, 2, 2)[None] * size).reshape(-1, 3)
            cells = cells[(cells < self.lattice.bricks).all(1)]
        state[tuple(cells.T)] = CANDIDATE
        own = f if self.guard is self.kernel else self.centres(cells, 1, self.kernel)
        outside[tuple(cells.T)] = ~(own < 0)
        return state, outside

    def centres(self, cells: np.ndarray, size: int, kernel: Kernel) -> np.ndarray:
        """A field at the centres of cells of `size` bricks."""
        return self.values_at(cells * BRICK + (size * BRICK - 1) / 2, kernel)

    def values_at(self, indices: np.ndarray, kernel: Kernel) -> np.ndarray:
        """A field at positions given in grid indices, [n, 3]."""
        points = np.asarray(self.lattice.origin)[:, None] + self.lattice.voxel * indices.T
        self.evaluations += len(indices)
        return values_at(kernel, points, self.work)

    def seeds(self, state: np.ndarray, outside: np.ndarray) -> np.ndarray:
        """The candidates to start from, int32 [n, 3] in bricks.

        Where the inside is as recognisable as the outside, these are all of them.
        """
        candidate = state == CANDIDATE
        if self.facts.weak:
            candidate &= _touching(state == EMPTY, True) | outside
        # Said to be full next to what is said to be empty: the bound is wrong there.
        wrong = (state == FULL) & _touching(state == EMPTY, True)
        self.repaired += int(wrong.sum())
        return np.argwhere(candidate | wrong).astype(np.int32)

    # --- outside in -----------------------------------------------------------------------------------------
    def explore(self, state: np.ndarray, front: np.ndarray) -> None:
        """Samples the front, then what it shows a sign change to, until the samples are closed."""
        while len(front):
            empty = self.emptied(front) & (state[tuple(front.T)] == CANDIDATE)
            bare, front = front[empty], front[~empty]
            state[tuple(bare.T)] = EMPTY
            state[tuple(front.T)] = QUEUED
            signs = self.sampled(front)
            self.bits.append(signs)
            known = int((state == QUEUED).sum())
            self.work.progress("sampling", known / max(known + int((state == CANDIDATE).sum()), 1))
            front = np.concatenate([self.neighbours(state, front, signs), _around(state, bare)])
            front = distinct(front, state.shape)

    def emptied(self, bricks: np.ndarray) -> np.ndarray:
        """Which bricks are empty after all, looked at in eight cells: 8 evaluations to save 512."""
        size = BRICK // 2
        middle = _grid(2, 2, 2) * size + (size - 1) / 2
        f = self.values_at((bricks[:, None] * BRICK + middle).reshape(-1, 3), self.guard).reshape(-1, 8)
        empty: np.ndarray = np.all(f > self.reach(size), axis=1)
        return empty

    def reach(self, size: int) -> float:
        """The least |f| at the centre of a cell of `size` samples that leaves no sign change within a voxel
        of it.
        """
        return self.facts.lipschitz * float(np.sqrt(3)) * self.lattice.voxel * (size + 1) / 2

    def sampled(self, bricks: np.ndarray) -> np.ndarray:
        """Samples bricks; returns their sign bits, uint8 [n, 8, 8], bit z of byte (x, y) set where inside."""
        corners = np.ascontiguousarray(bricks * BRICK, np.int32)
        values = np.empty((len(bricks) if self.keep else 0, BRICK**3), np.float32)
        signs = np.empty((len(bricks), 64), np.uint8)

        def task(part: slice) -> None:
            out = values[part] if self.keep else np.empty((part.stop - part.start, BRICK**3), np.float32)
            self.kernel.bricks(corners[part], self.lattice.origin, self.lattice.voxel, out)
            if np.isnan(out.max()):
                np.nan_to_num(out, copy=False, nan=self.lattice.voxel)
            signs[part] = np.packbits(out < 0, axis=1, bitorder="little")

        self.work.map(task, chunks(len(bricks), self.kernel.batch // BRICK**3))
        self.evaluations += len(bricks) * BRICK**3
        self.corners.append(corners)
        if self.keep:
            self.keep(values)
        return signs.reshape(-1, 8, 8)

    def neighbours(self, state: np.ndarray, bricks: np.ndarray, signs: np.ndarray) -> np.ndarray:
        """The bricks that must be sampled because of what these show on their faces."""
        found, faces = [np.empty((0, 3), np.int32)], SignFaces(signs)
        for axis, step in FACES:
            inside, outside = faces.shown(axis, step)
            near = beside(bricks, axis, step)
            within = (near[:, axis] >= 0) & (near[:, axis] < state.shape[axis])
            if not within.all():
                if (inside & ~within).any():
                    raise VolumeError(
                        "the solid reaches the border of what is sampled; give it finite <bounds>"
                    )
                near, inside, outside = near[within], inside[within], outside[within]
            there = state[tuple(near.T)]
            lost = (there == EMPTY) & inside | (there == FULL) & outside
            found.append(near[lost | (there == CANDIDATE) & outside])
            self.repaired += int(lost.sum())
        return np.concatenate(found)

    def audit(self, state: np.ndarray, turn: int) -> np.ndarray:
        """Bricks without samples, with a sample of the other sign than assumed; always the same points."""
        rng = np.random.default_rng(turn)
        bare = state != QUEUED
        near = np.argwhere(bare & _touching(~bare, False))
        far = np.flatnonzero(bare)
        chosen = np.unravel_index(rng.choice(far, min(FAR_AUDITS, len(far)), replace=False), state.shape)
        bricks = np.concatenate([near, np.stack(chosen, 1)]).astype(np.int32)
        points = bricks * BRICK + rng.integers(0, BRICK, bricks.shape)
        inside, assumed = self.values_at(points, self.kernel) < 0, state[tuple(bricks.T)]
        wrong = inside != (assumed != EMPTY)
        self.audited += len(bricks)
        # A candidate is in doubt: what is outside in it is a pocket that nothing led to, and no bound denied.
        self.repaired += int((wrong & (assumed != CANDIDATE)).sum())
        return distinct(bricks[wrong], state.shape)

    # --- the result -----------------------------------------------------------------------------------------
    def finished(self, state: np.ndarray) -> tuple[SignBricks, np.ndarray]:
        """The bricks that a crossing edge touches, in order, and their rows."""
        ijk = np.concatenate([np.empty((0, 3), np.int32), *self.corners])
        signs = np.concatenate([np.empty((0, 8, 8), np.uint8), *self.bits])
        index = np.where((state == EMPTY), OUTSIDE, INSIDE).astype(np.int32)
        kept = self.crossed(ijk // BRICK, signs, index)
        if not kept.any():
            raise VolumeError(
                "there is no surface: the scene is empty, or all of it is thinner than a voxel of "
                f"{self.lattice.voxel:.3g}; more voxels, or fewer levels or iterations, may show it"
            )
        order = np.flatnonzero(kept)[np.lexsort(ijk[kept].T[::-1])]
        index[tuple(ijk[order].T // BRICK)] = np.arange(len(order))
        bricks = SignBricks(
            self.lattice.origin,
            self.lattice.voxel,
            np.ascontiguousarray(ijk[order]),
            signs[order],
            index,
            evaluations=self.evaluations,
            repaired=self.repaired,
            audited=self.audited,
        )
        return bricks, order

    def crossed(self, bricks: np.ndarray, signs: np.ndarray, index: np.ndarray) -> np.ndarray:
        """Which sampled bricks have a sign change in them or to a neighbour; the others' sign is written to
        `index`.
        """
        faces = SignFaces(signs)
        any_in, any_out = faces.anywhere
        index[tuple(bricks.T)] = np.where(any_in, INSIDE, OUTSIDE)
        row = np.full(index.shape, -1, np.int32)
        row[tuple(bricks.T)] = np.arange(len(bricks))
        kept: np.ndarray = any_in & any_out
        plain = np.flatnonzero(~kept)
        for axis, step in FACES:
            near = beside(bricks[plain], axis, step)
            within = (near[:, axis] >= 0) & (near[:, axis] < index.shape[axis])
            other = np.full(len(plain), -1, np.int32)
            other[within] = row[tuple(near[within].T)]
            facing_in, facing_out = faces.shown(axis, -step)
            kept[plain] |= (other >= 0) & np.where(any_in[plain], facing_out[other], facing_in[other])
        return kept


def _gathered(waves: list[np.ndarray], order: np.ndarray, work: Work) -> np.ndarray:
    """The samples of the bricks in `order`; each wave is let go as soon as it is copied."""
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


def _grid(*shape: int) -> np.ndarray:
    """All indices of a small grid, int32 [n, 3]."""
    return np.ascontiguousarray(np.indices(shape, np.int32).reshape(len(shape), -1).T)


def _around(state: np.ndarray, bricks: np.ndarray) -> np.ndarray:
    """The candidates on the faces of bricks."""
    near = np.concatenate([beside(bricks, axis, step) for axis, step in FACES])
    near = near[((near >= 0) & (near < state.shape)).all(1)]
    found: np.ndarray = near[state[tuple(near.T)] == CANDIDATE]
    return found


def _touching(cells: np.ndarray, beyond: bool) -> np.ndarray:
    """Which cells of a boolean grid have a true neighbour on a face; `beyond` stands for what is outside the
    grid.
    """
    padded = np.pad(cells, 1, constant_values=beyond)
    found = np.zeros_like(cells)
    for axis in range(3):
        for start in (0, 2):
            part = [slice(1, -1)] * 3
            part[axis] = slice(start, start + cells.shape[axis])
            found |= padded[tuple(part)]
    return found
