"""Made printable: hollow with drains, gaps closed, loose parts left out; in mm, by distances that OpenVDB
measured.

The scene's own field stays what it is, exact; beside it, sampled fields say where to take away, add or stay
within. They come from the scene's samples by fast sweeping (Zhao 2004), so a millimetre is a millimetre for
any formula.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

import numpy as np
from numba import njit

from ..errors import SliceError
from ..formulas import cylinder, difference, transform
from ..formulas.box import Box
from ..formulas.registry import Facts, Node
from ..kernel import CpuKernel
from ..volume import Bricks, Lattice, sample
from ..volume.grid import from_grid, to_grid
from ..work import Work

if TYPE_CHECKING:
    from .._native import Grid
    from .stack import Stack

VOXELS = 192
"""Along the longest side, of the samples that distances are measured on."""


@dataclass(frozen=True)
class Changes:
    """What to change, in mm; 0 leaves it. wall: the object becomes hollow with walls this thick. drain: the
    diameter of the two holes from the hollow's lowest and highest point. gap: gaps up to this width are
    closed. largest: only the largest body stays. Raises `SliceError` for values that cannot be.
    """

    wall: float = 0.0
    drain: float = 3.0
    gap: float = 0.0
    largest: bool = False

    def __post_init__(self) -> None:
        for name in ("wall", "drain", "gap"):
            if not 0 <= getattr(self, name) < float("inf"):
                raise SliceError(f"{name} {getattr(self, name):g} mm: expected a length")


@dataclass(frozen=True, eq=False)
class Term:
    """A sampled field, and what it does: "cut" takes its inside away, "add" adds it, "keep" leaves only
    what is in it.
    """

    bricks: Bricks
    does: Literal["cut", "add", "keep"]


@dataclass(frozen=True, eq=False)
class Changed:
    """A kernel with terms; evaluates like a kernel."""

    kernel: CpuKernel
    terms: tuple[Term, ...]

    @property
    def dtype(self) -> np.dtype:
        return self.kernel.dtype

    def points(self, x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
        """Field values at points, as `CpuKernel.points`."""
        f = self.kernel.points(x, y, z)
        for term in self.terms:
            g = interpolated(term.bricks, x, y, z).astype(f.dtype)
            f = np.minimum(f, g) if term.does == "add" else np.maximum(f, -g if term.does == "cut" else g)
        return f


def changed(stack: Stack, changes: Changes, work: Work | None = None) -> Stack:
    """A stack with changes. Raises `SliceError` where nothing would be left to hollow."""
    if not (changes.wall or changes.gap or changes.largest):
        return stack
    voxel = max(stack.size) / stack.scale / VOXELS
    solid = _sampled(stack, voxel, work or Work()).redistance()
    if changes.largest:
        body = solid.surfaces()[0]
        stack = _with(stack, from_grid(body.offset(voxel)), "keep")
        solid = body
    if changes.gap:
        half = changes.gap / stack.scale / 2
        closed = solid.offset(half).redistance().offset(-half)
        # Less than a sample's error inside the outline, so that it adds nothing but the gaps.
        stack = _with(stack, from_grid(closed.offset(-voxel / 4)), "add")
        solid = closed
    return _hollow(stack, solid, changes, voxel) if changes.wall else stack


def _sampled(stack: Stack, voxel: float, work: Work) -> Grid:
    from ..kernel import compile_scene

    kernel = compile_scene(stack.root)
    return to_grid(sample(kernel, stack.root.facts, Lattice.around(stack.outer, voxel), work))


def _with(stack: Stack, bricks: Bricks, does: Literal["cut", "add", "keep"]) -> Stack:
    return replace(stack, terms=(*stack.terms, Term(bricks, does)))


def _hollow(stack: Stack, solid: Grid, changes: Changes, voxel: float) -> Stack:
    wall = changes.wall / stack.scale
    hollow = from_grid(solid.offset(-wall))
    inner = np.argwhere(hollow.values < 0)
    if not len(inner):
        raise SliceError(f"walls of {changes.wall:g} mm leave nothing to hollow out")
    samples = hollow.ijk[inner[:, 0]] + np.stack([inner[:, 1] >> 6, inner[:, 1] >> 3 & 7, inner[:, 1] & 7], 1)
    points = np.array(hollow.origin) + voxel * samples
    stack = _with(stack, hollow, "cut")
    if not changes.drain:
        return stack
    low, high = points[points[:, 2].argmin()], points[points[:, 2].argmax()]
    radius = changes.drain / stack.scale / 2
    drains = _sideways(low, stack.outer, radius), _upwards(high, stack.outer, radius)
    return replace(stack, root=difference(stack.root, *drains))


def _sideways(at: np.ndarray, outer: Box, radius: float) -> Node:
    """A hole from the hollow's lowest point to the nearer side along x: one downwards would be shut by the
    plate.
    """
    right = at[0] - outer.lo[0] > outer.hi[0] - at[0]
    length = float(outer.hi[0] - at[0] if right else at[0] - outer.lo[0]) + radius
    middle = float(at[0]) + (length if right else -length) / 2
    hole = cylinder(radius=radius, height=length)
    return transform(hole, rotate=(0, 1, 0, 90), translate=(middle, float(at[1]), float(at[2]) + radius))


def _upwards(at: np.ndarray, outer: Box, radius: float) -> Node:
    """A hole from the hollow's highest point, which hangs lowest on the printer."""
    low, high = float(at[2]) - radius, outer.hi[2] + radius
    hole = cylinder(radius=radius, height=high - low)
    return transform(hole, translate=(float(at[0]), float(at[1]), (low + high) / 2))


def facts_of(stack: Stack) -> Facts:
    """The facts of a stack's field, terms included: an interpolated distance may grow a little faster than
    it should.
    """
    own = stack.root.facts
    return Facts(Box(own.box.lo, own.box.hi), max(own.lipschitz, 1.8), own.weak) if stack.terms else own


def interpolated(bricks: Bricks, x: np.ndarray, y: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Samples between grid points, trilinear, float64 of the points' shape; where there are none, a bound
    with their sign.
    """
    out = np.empty(np.shape(x))
    u, v, w = (np.ascontiguousarray(a, np.float64).ravel() for a in (x, y, z))
    far = 1.5 * bricks.voxel
    _interpolate(u, v, w, *bricks.origin, bricks.voxel, bricks.index, bricks.values, far, out.ravel())
    return out


@njit(cache=True, nogil=True)
def _interpolate(xs, ys, zs, x0, y0, z0, voxel, index, values, far, out):  # type: ignore[no-untyped-def]
    for n in range(len(xs)):
        u, v, w = (xs[n] - x0) / voxel, (ys[n] - y0) / voxel, (zs[n] - z0) / voxel
        i, j, k = int(np.floor(u)), int(np.floor(v)), int(np.floor(w))
        u, v, w = u - i, v - j, w - k
        total = 0.0
        for corner in range(8):
            a, b, c = corner >> 2, (corner >> 1) & 1, corner & 1
            share = (u if a else 1 - u) * (v if b else 1 - v) * (w if c else 1 - w)
            total += share * _sample(index, values, i + a, j + b, k + c, far)
        out[n] = total


@njit(cache=True, nogil=True)
def _sample(index, values, i, j, k, far):  # type: ignore[no-untyped-def]
    bi, bj, bk = i >> 3, j >> 3, k >> 3
    if min(bi, bj, bk) < 0 or bi >= index.shape[0] or bj >= index.shape[1] or bk >= index.shape[2]:
        return far
    row = index[bi, bj, bk]
    if row < 0:
        return far if row == -1 else -far
    return float(values[row, (i & 7) * 64 + (j & 7) * 8 + (k & 7)])
